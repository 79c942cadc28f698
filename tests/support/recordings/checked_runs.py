"""Consistency checks of recordings, and the p-values of their findings."""

from collections.abc import Sequence

from rig.analysis.check import Check
from rig.analysis.consistency.contradictions import contradictions
from rig.analysis.consistency.false_alarms import CHECKS, FALSE_ALARM_PROBABILITY
from rig.analysis.environment import MeasurementEnvironment, find_environment
from rig.analysis.gyroscope.calibration import SensorResult, observe_recordings, solve_observed
from rig.data.recording.run_data import RunData
from rig.observation.observed_run import ObservedRun

STATISTICS = len(CHECKS)  # of a gyroscope
RATE = FALSE_ALARM_PROBABILITY / STATISTICS  # of each

Solved = tuple[tuple[ObservedRun, ...], dict[str, SensorResult], MeasurementEnvironment]


def solve_inputs(run: RunData) -> Solved:
    """Return the inputs of the checks for a recording of one gyroscope."""
    recordings = observe_recordings([run])
    environment = find_environment(recordings, recordings[0].run.settings)
    return recordings, solve_observed(run.sensors, recordings, environment), environment


def checks_of(inputs: Solved, rate: float = RATE) -> tuple[Check, ...]:
    """Check with limits that undamaged recordings exceed with this probability each."""
    recordings, results, environment = inputs
    return contradictions(
        recordings,
        results,
        ["gyro"],
        environment,
        recordings[0].run.settings,
        false_alarms=rate * STATISTICS,
        has_limits=False,
    ).checks


def check_run(run: RunData) -> tuple[Check, ...]:
    """Check a recording as a run is judged."""
    return checks_of(solve_inputs(run))


def list_failed(checks: Sequence[Check]) -> set[str]:
    """Return the names of failed checks, without the sensor's and the sweep's."""
    return {kind_of(check) for check in checks if not check.passed}


def kind_of(check: Check) -> str:
    """Return the name of a check without its sensor and sweep."""
    return check.name.split(".")[1]


def probability(check: Check, rate: float = RATE) -> float:
    """Return the probability of a χ² as large, with the degrees of freedom that the limit for that rate implies."""
    from scipy.special import chdtrc, chdtri

    limit = float(check.limit or 0.0)
    dof = min(range(1, 400), key=lambda index: abs(float(chdtri(index, rate)) - limit))
    return float(chdtrc(dof, float(check.value or 0.0)))
