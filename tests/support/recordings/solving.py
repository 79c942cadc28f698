"""Calibrations from recordings in one step."""

from collections.abc import Sequence

from rig.analysis.environment import find_environment
from rig.analysis.estimator_names import DEFAULT_ESTIMATOR, find_estimator
from rig.analysis.gyroscope.calibration import SensorResult, observe_recordings, solve_observed
from rig.data.recording.run_data import RunData


def solve_runs(
    runs: Sequence[RunData], estimator: str = DEFAULT_ESTIMATOR, matrix_corrected: Sequence[str] = ()
) -> dict[str, SensorResult]:
    """Calibrate every sensor from one recording, or from all recordings of a run that was resumed."""
    chosen = find_estimator(estimator)  # before the work of observing
    recordings = observe_recordings(runs)
    environment = find_environment(recordings, runs[0].settings)
    return solve_observed(runs[0].sensors, recordings, environment, chosen, matrix_corrected)
