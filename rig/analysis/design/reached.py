"""Whether a run that goes on has reached what is wanted: its recordings so far, solved as at its end. Pure."""

from collections.abc import Sequence

from rig.analysis.design.shortest import Reached
from rig.analysis.gyroscope.calibration import observe_recordings, solve_observed
from rig.analysis.solvable import solvable
from rig.analysis.surroundings import surroundings_of
from rig.data.quantity import RATE
from rig.data.recording.run_file import RunData
from rig.errors import Fault


def reached_so_far(runs: Sequence[RunData], estimator: str) -> Reached | None:
    """The worst U of all sensors to calibrate by what is recorded yet; None where that tells no uncertainty."""
    settings = runs[0].settings
    try:
        with solvable():
            recordings = observe_recordings(runs)
            if not recordings:
                return None
            surroundings = surroundings_of(recordings, settings)
            sensors = runs[0].measuring(RATE)
            found = solve_observed(sensors, recordings, surroundings, estimator, settings.matrix_corrected)
    except Fault:  # what is wrong with it, the end of the run will say
        return None
    budgets = {name: found[name].uncertainty for name in settings.to_calibrate}
    known = {name: each for name, each in budgets.items() if each is not None}
    return Reached.by(known) if known and len(known) == len(budgets) else None
