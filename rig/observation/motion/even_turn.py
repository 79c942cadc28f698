"""A whole turn of a shaft whose single readings scatter: known by the same reading one turn later.

An arm's encoder tells where a joint is to microradians, so its turn begins and ends where a reading says so. A servo's
tells it to a milliradian, and is out by a degree besides; that is the same at the same place of the shaft, and a
quarter of a turn of readings that come again averages the scatter. What the gyroscope feels in the time of one turn is
then 2π, wherever in the even part of the sweep that time begins; here it lies in the middle.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.motion.steps import TURN_RAD, Sweep
from rig.observation.motion.revolution import MAX_STATE_GAP_S, Ends, arm_states_lost, describe, not_constant
from rig.observation.motion.turn_speed import FEWEST_PLACES, turn_speed

SMOOTHED_S = 0.12  # a window in which a straight line stands for the angle: the gear's ripple is longer
FEWEST = 5
USUAL, HELD_UP = 0.25, 4.0  # the quartile of how long asking takes when nothing holds it up; and so many times that
KNOTS = 3  # every so many of the smoothed angles is a knot of a spline: neighbours share nearly all readings
GUARD_RAD = float(np.radians(1.5))  # away from the ramps: how late a shaft follows, and what its encoder is out


def well_timed(states: NDArray[Any]) -> NDArray[Any]:
    """The states that were measured when they say: of those that tell how long asking took, not the held-up ones.

    The moment of the measurement lies somewhere within that time.
    """
    if "took_s" not in (states.dtype.names or ()) or not len(states):
        return states
    in_time: NDArray[Any] = states[states["took_s"] <= HELD_UP * np.quantile(states["took_s"], USUAL)]
    return in_time


def smoothed(time_s: Array, q_rad: Array) -> tuple[Array, Array, Array]:
    """Times (k,), angles (k, n) and rates (k, n) by straight lines through windows of readings (m, n) that scatter."""
    count = max(FEWEST, round(SMOOTHED_S / float(np.median(np.diff(time_s)))))
    half = count // 2
    windows = np.lib.stride_tricks.sliding_window_view
    times = windows(np.pad(time_s, half, mode="edge"), 2 * half + 1)[::KNOTS]
    angles = windows(np.pad(q_rad, ((half, half), (0, 0)), mode="edge"), 2 * half + 1, axis=0)[::KNOTS]
    middles_s = times.mean(axis=1)
    away_s = times - middles_s[:, None]
    rates = np.einsum("km,knm->kn", away_s, angles) / np.sum(away_s**2, axis=1)[:, None]
    apart = np.append(True, np.diff(middles_s) > 0)
    return middles_s[apart], angles.mean(axis=2)[apart], rates[apart]


def find_even_turn(states: NDArray[Any], sweep: Sweep, settings: ObservationThresholds) -> Ends:
    """The turn of one sweep, of which `states` (n,) of the turner tell, in the middle of what it turned evenly.

    Raises Fault `incomplete_revolution`, `arm_states_lost`, `speed_not_constant`, `turn_too_short`.
    """
    where = describe(sweep)
    time_s, angle = states["time_s"], states["q_rad"][:, sweep.joint]
    growing = sweep.growing
    gone = growing * (angle - sweep.start_q_rad[sweep.joint])
    whole = growing * (sweep.end_q_rad[sweep.joint] - sweep.start_q_rad[sweep.joint])
    ramp = sweep.speed_rad_s**2 / (2 * sweep.acceleration_rad_s2) + GUARD_RAD
    even = np.flatnonzero((gone >= ramp) & (gone <= whole - ramp))
    if not len(even) or even[0] == 0 or even[-1] == len(gone) - 1 or np.ptp(gone[even]) < TURN_RAD:
        turned = float(np.ptp(gone)) if len(gone) else 0.0
        raise Fault(
            "incomplete_revolution",
            f"in {where} the joint turned {np.degrees(turned):.0f}° and not through the whole revolution",
            "Repeat the sweep; resume the run if it was interrupted",
        )
    inside = slice(int(even[0]), int(even[-1]) + 1)
    time_s, gone = time_s[inside], gone[inside]
    gap = float(np.diff(time_s).max())
    if gap > MAX_STATE_GAP_S:
        raise arm_states_lost(where, f"for {gap:.2f} s")
    if np.sum(gone < gone[-1] - TURN_RAD) < FEWEST_PLACES or np.sum(gone > gone[0] + TURN_RAD) < FEWEST_PLACES:
        raise arm_states_lost(where, "where the turn begins or where it ends")
    _check_speed(time_s, gone, where, settings)
    found = turn_speed(time_s, gone)
    start_s = float(time_s[0] + time_s[-1] - found.period_s) / 2
    end_s = start_s + found.period_s
    within = time_s[(time_s >= start_s) & (time_s <= end_s)]
    return Ends(start_s, end_s, found.speed_std_rad_s / found.speed_rad_s * found.period_s, within)


def _check_speed(time_s: Array, gone: Array, where: str, settings: ObservationThresholds) -> None:
    """The smoothed rate must stay near its mean: a gear's ripple passes, a halt on the way does not."""
    rates = smoothed(time_s, gone[:, None])[2][:, 0]
    deviation = float(np.max(np.abs(rates / rates.mean() - 1)))
    if deviation > settings.max_speed_deviation:
        raise not_constant(where, deviation, settings)
