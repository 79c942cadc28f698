"""The uncertainty that a run has reached so far. Pure functions."""

from collections.abc import Sequence

from rig.analysis.design.candidate_search import ReachedUncertainty
from rig.analysis.environment import find_environment
from rig.analysis.gyroscope.calibration import observe_recordings, solve_observed
from rig.analysis.numeric_errors import solvable
from rig.data.quantity import RATE
from rig.data.recording.run_data import RunData
from rig.errors import Fault


def assess_reached(runs: Sequence[RunData], estimator: str) -> ReachedUncertainty | None:
    """Return the largest U of all sensors to calibrate, from the recordings so far; None if a sensor has no U yet."""
    settings = runs[0].settings
    try:
        with solvable():
            recordings = observe_recordings(runs)
            if not recordings:
                return None
            environment = find_environment(recordings, settings)
            sensors = runs[0].measuring(RATE)
            results = solve_observed(sensors, recordings, environment, estimator, settings.matrix_corrected)
    except Fault:  # the end of the run reports the fault
        return None
    budgets = {name: results[name].uncertainty for name in settings.to_calibrate}
    known_budgets = {name: budget for name, budget in budgets.items() if budget is not None}
    return (
        ReachedUncertainty.worst_case(known_budgets) if known_budgets and len(known_budgets) == len(budgets) else None
    )
