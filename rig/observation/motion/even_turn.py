"""A whole turn of a shaft whose single readings scatter, from a reading to its recurrence one turn later.

An arm's encoder resolves microradians, so a turn begins and ends at a reading. A servo's encoder resolves a
milliradian, and has errors of a degree that recur at the same angle of the shaft. A sweep is a quarter of a turn longer
than one turn, so that many readings recur; the scatter averages out over these. In the time of one turn the gyroscope
rotates by 2π, wherever this time begins in the even part of the sweep; this module chooses the middle.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault
from rig.estimation.arrays import Array, median_step
from rig.motion.steps import TURN_RAD, Sweep
from rig.observation.motion.revolution import MAX_STATE_GAP_S, Ends, arm_states_lost, check_constant, describe
from rig.observation.motion.turn_speed import MIN_PAIRS, turn_speed

SMOOTHING_S = 0.12  # a straight line fits the angle in it: shorter than the gear's ripple
MIN_ANGLES = 5
USUAL_QUANTILE, DELAY_RATIO = 0.25, 4.0  # of the requests' durations; a delayed one exceeds it by the ratio
KNOT_STRIDE = 3  # of the smoothed angles, as adjacent ones share nearly all readings
GUARD_RAD = float(np.radians(1.5))  # angle left out next to the ramps: the shaft's lag and its encoder's error


def well_timed(states: NDArray[Any]) -> NDArray[Any]:
    """Return the states whose requests were fast; in a slow request the servo measures at an unknown moment."""
    if "took_s" not in (states.dtype.names or ()) or not len(states):
        return states
    in_time: NDArray[Any] = states[states["took_s"] <= DELAY_RATIO * np.quantile(states["took_s"], USUAL_QUANTILE)]
    return in_time


def fit_lines(time_s: Array, q_rad: Array) -> tuple[Array, Array, Array]:
    """Fit lines to angles (m, n) in k windows; return the windows' middles (k,), and angles and rates (k, n) there."""
    count = max(MIN_ANGLES, round(SMOOTHING_S / median_step(time_s)))
    half = count // 2
    windows = np.lib.stride_tricks.sliding_window_view
    times = windows(np.pad(time_s, half, mode="edge"), 2 * half + 1)[::KNOT_STRIDE]
    angles = windows(np.pad(q_rad, ((half, half), (0, 0)), mode="edge"), 2 * half + 1, axis=0)[::KNOT_STRIDE]
    middles_s = times.mean(axis=1)
    offset_s = times - middles_s[:, None]
    rates = np.einsum("km,knm->kn", offset_s, angles) / np.sum(offset_s**2, axis=1)[:, None]
    is_distinct = np.append(True, np.diff(middles_s) > 0)
    return middles_s[is_distinct], angles.mean(axis=2)[is_distinct], rates[is_distinct]


def find_even_turn(states: NDArray[Any], sweep: Sweep, settings: ObservationThresholds) -> Ends:
    """Return the turn of one sweep from the turner's `states` (n,), in the middle of the part at even speed.

    Raise Fault `incomplete_revolution`, `arm_states_lost`, `speed_not_constant`, `turn_too_short`.
    """
    where = describe(sweep)
    time_s, angle = states["time_s"], states["q_rad"][:, sweep.joint]
    growing = sweep.growing
    travelled = growing * (angle - sweep.start_q_rad[sweep.joint])
    whole = growing * (sweep.end_q_rad[sweep.joint] - sweep.start_q_rad[sweep.joint])
    ramp = sweep.speed_rad_s**2 / (2 * sweep.acceleration_rad_s2) + GUARD_RAD
    even = np.flatnonzero((travelled >= ramp) & (travelled <= whole - ramp))
    if not len(even) or even[0] == 0 or even[-1] == len(travelled) - 1 or np.ptp(travelled[even]) < TURN_RAD:
        angle_rad = float(np.ptp(travelled)) if len(travelled) else 0.0
        raise Fault(
            "incomplete_revolution",
            f"in {where} the joint turned {np.degrees(angle_rad):.0f}° and not through the whole revolution",
            "Repeat the sweep; resume the run if it was interrupted",
        )
    inside = slice(int(even[0]), int(even[-1]) + 1)
    time_s, travelled = time_s[inside], travelled[inside]
    gap = float(np.diff(time_s).max())
    if gap > MAX_STATE_GAP_S:
        raise arm_states_lost(where, f"for {gap:.2f} s")
    if (
        np.sum(travelled < travelled[-1] - TURN_RAD) < MIN_PAIRS
        or np.sum(travelled > travelled[0] + TURN_RAD) < MIN_PAIRS
    ):
        raise arm_states_lost(where, "where the turn begins or where it ends")
    rates = fit_lines(time_s, travelled[:, None])[2][:, 0]
    check_constant(rates / rates.mean(), where, settings)
    speed = turn_speed(time_s, travelled)
    start_s = float(time_s[0] + time_s[-1] - speed.period_s) / 2
    end_s = start_s + speed.period_s
    within = time_s[(time_s >= start_s) & (time_s <= end_s)]
    return Ends(start_s, end_s, speed.speed_std_rad_s / speed.speed_rad_s * speed.period_s, within)
