"""The check that a gyroscope's bias from increments between attitudes agrees with its readings at rest.

A gyroscope at rest reads its bias, plus any motion that the reference does not show. The uncertainty of such motion
follows from the scatter of the reference's rates in the rests. The reference's errors while the body moves are not
used, because time stamps may cause them.
"""

from dataclasses import replace

import numpy as np

from rig.data.quantity import RATE
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.earth import EARTH_RATE_RAD_S
from rig.estimation.external.increment_solution import ROUNDING, IncrementSolution
from rig.estimation.reference.reference_model import BIAS
from rig.estimation.statistics.coverage import false_alarm_of_each
from rig.observation.external.means_at_rest import MeansAtRest

FALSE_ALARM_PROBABILITY = 1e-3  # for the worst of three axes, if the recording's bias is that at rest
G_SENSITIVITY_RAD_S = 1e-3  # effect of 1 g on a MEMS gyroscope, which rests in one attitude and moves through many
MIN_ROUNDING = 1e-3  # of the variance of the bias; less does not matter
TAIL_FRACTION = 0.1  # of the readings at either end of their range, which may not belong to a rest
# Largest half of the range of the readings at rest: the body may move a little although it seems to rest.
MAX_HALF_RANGE_RAD_S = 2 * RATE.steady


def include_rounding(solution: IncrementSolution, at_rest: MeansAtRest | None) -> IncrementSolution:
    """Return the solution with rounding added to the uncertainty of its bias, if readings at rest have coarse steps.

    At rest a reading without much noise repeats one rounded number, whose error no mean and no other rest reduces.
    """
    if at_rest is None or not (at_rest.rounding > MIN_ROUNDING * np.diag(solution.covariance)[BIAS]).any():
        return solution
    rounding = np.zeros_like(solution.covariance)
    rounding[BIAS, BIAS] = np.diag(at_rest.rounding)
    causes = {**solution.causes, ROUNDING: rounding}
    return replace(solution, covariance=solution.covariance + rounding, causes=causes)


def check_rests_agree(solution: IncrementSolution, at_rest: MeansAtRest | None) -> None:
    """Raise Fault `bias_contradicts_rests` if the bias differs too much from the mean of the readings at rest.

    They may differ by the scatter of the rests, by motion that the reference does not show, and by the effect of
    gravity on a gyroscope. Raise Fault `bias_jumped` if the readings at rest themselves differ by more than a drift.
    """
    if at_rest is None:
        return
    readings, turned = at_rest.readings_rad_s, at_rest.rates_rad_s @ solution.matrix.T
    bias = np.median(readings, axis=0) - turned.mean(axis=0)
    half_range = np.ptp(np.quantile(readings, (TAIL_FRACTION, 1 - TAIL_FRACTION), axis=0), axis=0) / 2
    _check_steady(half_range)
    other = G_SENSITIVITY_RAD_S**2 + EARTH_RATE_RAD_S**2
    std = np.sqrt(np.diag(solution.covariance)[BIAS] + half_range**2 + _motion_std_rad_s(turned) ** 2 + other)
    normalised = np.abs(solution.bias - bias) / std
    worst = int(np.argmax(normalised))
    if normalised[worst] <= _critical_value(np.inf):
        return
    raise Fault(
        "bias_contradicts_rests",
        f"at rest the gyroscope reads {bias[worst]:+.2g} rad/s on {RATE.axes[worst]}, but the increments between "
        f"attitudes give a bias of {solution.bias[worst]:+.2g} ± {2 * std[worst]:.1g} rad/s: one of them is wrong",
        "See that both files use one clock and that no readings are missing; turn more slowly, or add rows at rest",
    )


def _check_steady(half_range_rad_s: Array) -> None:
    """Raise Fault `bias_jumped` if half the range (3,) of the readings at rest exceeds a plausible bias drift."""
    axis = int(np.argmax(half_range_rad_s))
    if half_range_rad_s[axis] > MAX_HALF_RANGE_RAD_S:
        raise Fault(
            "bias_jumped",
            f"where the attitudes show the body at rest, the gyroscope reads {2 * half_range_rad_s[axis]:.2g} rad/s "
            f"more on {RATE.axes[axis]} at some times than at others",
            "Solve the parts before and after the change separately; look for a knock, or a range that was switched",
        )


def _critical_value(dof: float) -> float:
    """Return Student's critical value for the worst of three axes, at the probability `FALSE_ALARM_PROBABILITY`."""
    from scipy.special import ndtri, stdtrit

    tail = false_alarm_of_each(FALSE_ALARM_PROBABILITY, 2 * len(RATE.axes))
    return -float(ndtri(tail) if np.isinf(dof) else stdtrit(dof, tail))


def _motion_std_rad_s(turned_rad_s: Array) -> float:
    """Return the standard deviation of the mean rate, about any axis, by which the body moves undetected at rest.

    It is estimated from the scatter of the reference's rates (k, 3) in k rests. For few rests it is inflated, so that a
    normal critical value acts like Student's.
    """
    count = len(turned_rad_s)
    scatter = float(np.sqrt(np.var(turned_rad_s, axis=0, ddof=1).mean()))
    wider = _critical_value(float(3 * (count - 1))) / _critical_value(np.inf)
    return wider * scatter / float(np.sqrt(count))
