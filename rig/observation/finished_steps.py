"""The sweeps and dwells that a recording holds from start to end, and their times. Pure functions."""

from rig.data.recording.run_data import RunData
from rig.observation.windows import dwelt, swept


def complete_sweeps(run: RunData) -> frozenset[int]:
    """Return the indices of the sweeps that a recording contains from start to end."""
    return frozenset(finished.sweep.index for finished in swept(run))


def complete_dwells(run: RunData) -> frozenset[int]:
    """Return the indices of the dwells that a recording contains from start to end."""
    return frozenset(finished.dwell.index for finished in dwelt(run))


def dwell_times_s(run: RunData) -> dict[int, tuple[float, float]]:
    """Return the start and end of each finished dwell on the controller's clock, by the dwell's index."""
    return {finished.dwell.index: (finished.window.start_s, finished.window.end_s) for finished in dwelt(run)}
