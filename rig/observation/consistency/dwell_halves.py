"""The difference of the means of a dwell's halves, for a test against noise. Pure functions."""

from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps
from rig.observation.consistency.raw_dwells import RawDwell
from rig.observation.statistics.mean import mean_at_rest
from rig.observation.windows import Window


def compare_halves(dwell: RawDwell, steps: Steps) -> tuple[Array, Array]:
    """Return the difference (3,) of the means of a dwell's halves, in counts, and its variance (3,) due to noise.

    `steps` is the resolution of the counts. The arm's oscillation, as encoders measure it, is removed.
    """
    window, middle_s = dwell.window, dwell.middle_s
    halves = Window(window.start_s, middle_s), Window(middle_s, window.end_s)
    early = dwell.time_s < middle_s
    first, last = (
        mean_at_rest(dwell.still_counts[inside], dwell.time_s[inside], half, steps)[0]
        for half, inside in zip(halves, (early, ~early), strict=True)
    )
    return last.mean - first.mean, first.variance + last.variance
