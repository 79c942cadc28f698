"""The mean speed of a shaft over a whole turn, from its own encoder and a clock alone.

A reading recurs one turn later at the same angle of the shaft, so the encoder's nonlinearity cancels over a whole turn,
as does all unevenness with the period of a turn (a gear's ripple, backlash, an unbalanced load). The noise and steps of
the readings, and the clock's jitter, remain. Pure functions.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault

TURN_RAD = 2 * np.pi
MIN_PAIRS = 20
MAX_STEPS = 50  # of the search for the period by secants; three or four are enough
CONVERGED_STEP_RATIO = 1e-12  # of the period


@dataclass(frozen=True, slots=True)
class TurnSpeed:
    """The signed mean speed of whole turns, its standard deviation, and the time `period_s` of one turn."""

    speed_rad_s: float
    speed_std_rad_s: float
    period_s: float


def turn_speed(time_s: NDArray[np.float64], q_rad: NDArray[np.float64]) -> TurnSpeed:
    """Return the speed 2π/T of a shaft that turns evenly through more than a whole turn.

    `time_s` (n,): rising; `q_rad` (n,): the encoder's readings without the ramps, continuous over several turns. T is
    the mean time between readings one turn apart. For example, a 12-bit encoder with a noise of 0.06° that is read at
    100 Hz over 1¼ turns at 60°/s determines T to 2e-5. The standard deviation of T follows from the scatter of the
    readings' differences over one turn, if the noise of single readings is white. Raise Fault `turn_too_short` if the
    shaft stands still, or if there are fewer than `MIN_PAIRS` readings beyond one turn.
    """
    far_rad = abs(float(q_rad[-1] - q_rad[0])) if len(q_rad) > MIN_PAIRS else 0.0
    if far_rad <= TURN_RAD:
        raise _too_short(far_rad)
    direction = float(np.sign(q_rad[-1] - q_rad[0]))
    angle_rad = direction * (q_rad - q_rad[0])
    rate_rad_s = float(np.polyfit(time_s - time_s[0], angle_rad, 1)[0])
    period_s = TURN_RAD / rate_rad_s
    pairs = int(np.searchsorted(time_s, time_s[-1] - period_s, side="right"))
    if pairs < MIN_PAIRS:
        raise _too_short(far_rad)
    first_s, first_rad = time_s[:pairs], angle_rad[:pairs]

    def excess_rad(period_s: float) -> NDArray[np.float64]:
        """Return the angles (pairs,), rad, by which the shaft exceeds one turn after a trial period."""
        ahead: NDArray[np.float64] = np.interp(first_s + period_s, time_s, angle_rad) - first_rad - TURN_RAD
        return ahead

    for _ in range(MAX_STEPS):
        step_s = float(excess_rad(period_s).mean()) / rate_rad_s
        period_s -= step_s
        if abs(step_s) < CONVERGED_STEP_RATIO * period_s:
            break
    std_s = _std_of_mean(first_s + period_s, time_s, excess_rad(period_s)) / rate_rad_s
    speed_rad_s = TURN_RAD / period_s
    return TurnSpeed(direction * speed_rad_s, speed_rad_s * std_s / period_s, period_s)


def _std_of_mean(later_s: NDArray[np.float64], time_s: NDArray[np.float64], beyond_rad: NDArray[np.float64]) -> float:
    """Return the standard deviation of the mean of `beyond_rad` (n,).

    Element i is the angle turned from `time_s[i]` to `later_s[i]`, minus one turn. The angle at `later_s[i]` is
    interpolated between readings j and j + 1, with weight w. If the readings have white errors e, element i has the
    error (1 − w) e_j + w e_{j+1} − e_i. The scatter of the elements gives the variance of a single reading; the
    variance of their mean follows from the total weight of each reading in all elements.
    """
    pairs, count = len(beyond_rad), len(time_s)
    after = np.searchsorted(time_s, later_s, side="right").clip(1, count - 1)
    weight = (later_s - time_s[after - 1]) / (time_s[after] - time_s[after - 1])
    weight = weight.clip(0.0, 1.0)
    weights = np.zeros(count)
    np.add.at(weights, after, weight)
    np.add.at(weights, after - 1, 1.0 - weight)
    weights[:pairs] -= 1.0
    variances = 1.0 + weight**2 + (1.0 - weight) ** 2
    single = float(np.sum((beyond_rad - beyond_rad.mean()) ** 2)) / float(variances.sum()) * pairs / (pairs - 1)
    return float(np.sqrt(single * np.sum(weights**2))) / pairs


def _too_short(far_rad: float) -> Fault:
    return Fault(
        "turn_too_short",
        f"the shaft has turned {far_rad / TURN_RAD:.2f} of a turn evenly, which is too little to come to the "
        "same positions again",
        "Turn a quarter of a turn more than the turn that is measured, between the ramps",
    )
