"""The false-alarm probability of the checks for contradictions, divided among them."""

from rig.analysis.consistency import converter_tests, gyroscope_checks
from rig.analysis.consistency.gyroscope_checks import DISTURBED_SWEEP
from rig.estimation.statistics.coverage import false_alarm_of_each

FALSE_ALARM_PROBABILITY = 0.001  # that any of these checks, of any sensor, fails a run without a fault
NON_ORTHOGONALITY = "non_orthogonality"
# The checks of a gyroscope, which share the false-alarm probability. Other kinds of readings have as many.
CHECKS = (*gyroscope_checks.CHECKS, DISTURBED_SWEEP, *converter_tests.CHECKS, NON_ORTHOGONALITY)


def false_alarm_per_check(kinds: int, *, of_all: float = FALSE_ALARM_PROBABILITY) -> float:
    """Return the false-alarm probability of one check, if all checks together have the probability `of_all`.

    `kinds` is the number of kinds of readings, such as the rates of one gyroscope, each of which has as many checks.
    """
    return false_alarm_of_each(of_all, len(CHECKS) * kinds)
