"""Checks that a state is possible for an arm, and that its time follows the previous one. Pure.

The times of the states are the reference of a recording. If the controller's clock is set during a run, or its states
are not finite, the run cannot be solved, so either of these ends a run at once, with a named error.
"""

import math
from collections.abc import Sequence
from itertools import chain

from rig.errors import Problem
from rig.motion.turner_state import JOINT_NAMES, ArmState

# Beyond all arms; the angle is large because a UR3e's wrist 3 turns without limit and counts its revolutions.
MAX_ANGLE_RAD, MAX_SPEED_RAD_S, MODES = 1e3, 20.0, range(-1, 64)
# A joint of the fastest arm of this kind turns by 6.3 rad/s, and by 3.14 under the rig; three times that is impossible.
MAX_ENCODER_ERROR_RAD, MAX_TRAVEL_RAD_S = 0.03, 10.0
CYCLE_S = 0.002  # the controller's cycle, at whose ends states are made: four of these for a CB3
MAX_CYCLE_ERROR = 0.3  # fraction of a cycle between a time stamp and its cycle
MAX_GAP_S = 0.1  # in the states, that other evidence need not confirm
RESTART_REMEDY = "Restart the controller if it happens again"


def impossible_state(state: ArmState) -> Problem | None:
    """Return the problem of a state with values that are not finite or not possible for an arm; None if possible."""
    if _is_possible(state):  # five hundred states a second are; to name what is wrong takes ten times as long
        return None
    values = {
        "time": (state.time_s,),
        "speed slider": (state.target_speed_fraction,),
        "speed scaling": (state.speed_scaling,),
    }
    for name, numbers in chain(values.items(), _joints(state)):
        if not all(map(math.isfinite, numbers)):
            return _impossible(f"its {name} is {numbers[0]:g}")
    for name, (angle, speed) in _joints(state):
        if abs(angle) > MAX_ANGLE_RAD or abs(speed) > MAX_SPEED_RAD_S:
            return _impossible(f"its {name} is at {angle:.4g} rad and turns at {speed:.4g} rad/s")
    if not 0.0 <= state.target_speed_fraction <= 1.0:
        return _impossible(f"its speed slider is at {100 * state.target_speed_fraction:.4g} %")
    for name in ("robot_mode", "safety_mode", "runtime_state"):
        if (mode := getattr(state, name)) not in MODES:
            return _impossible(f"its {name} is {mode}")
    return None


def _is_possible(state: ArmState) -> bool:
    """Return whether every value is finite and within its limits."""
    q_rad, qd_rad_s, fraction = state.q_rad, state.qd_rad_s, state.target_speed_fraction
    return (
        math.isfinite(state.time_s + state.speed_scaling + sum(q_rad) + sum(qd_rad_s))
        and max(map(abs, q_rad)) <= MAX_ANGLE_RAD
        and max(map(abs, qd_rad_s)) <= MAX_SPEED_RAD_S
        and 0.0 <= fraction <= 1.0
        and state.robot_mode in MODES
        and state.safety_mode in MODES
        and state.runtime_state in MODES
    )


def impossible_payload(mass_kg: float, centre_m: Sequence[float]) -> Problem | None:
    """Return the problem of a payload that is not finite; None for a finite payload."""
    numbers = (mass_kg, *centre_m)
    return None if all(map(math.isfinite, numbers)) else _impossible(f"its payload is {mass_kg:g} kg at {centre_m} m")


def impossible_motion(before: ArmState, after: ArmState) -> Problem | None:
    """Return the problem of two states between which a joint turned farther than any arm can."""
    step_s = abs(after.time_s - before.time_s)
    for name, q1, q2 in zip(JOINT_NAMES, before.q_rad, after.q_rad, strict=True):
        if abs(q2 - q1) > MAX_ENCODER_ERROR_RAD + MAX_TRAVEL_RAD_S * step_s:
            return _impossible(f"its {name} went by {math.degrees(q2 - q1):+.1f}° in {step_s:.3f} s")
    return None


def clock_step(before_s: float, after_s: float, period_s: float, missed_s: float) -> Problem | None:
    """Return a problem unless the time `after_s` is a whole number of periods after `before_s`.

    `missed_s` is the longest recent gap, on the controller's clock, in which states may have been lost. A longer step
    is a problem too.
    """
    step_s = after_s - before_s
    step_unit_s = period_s if _divides(period_s) else CYCLE_S
    error_s = abs(step_s - max(1, round(step_s / step_unit_s)) * step_unit_s)
    if error_s <= MAX_CYCLE_ERROR * step_unit_s and step_s - period_s <= MAX_GAP_S + missed_s:
        return None
    return Problem(
        "arm_clock_stepped",
        f"the controller's time went from {before_s:.3f} s to {after_s:.3f} s from one state to the next, instead "
        f"of by {period_s:.3f} s: its clock was set",
        f"Look whether a second controller answers at arm.host, then start again. {RESTART_REMEDY}",
    )


def _divides(period_s: float) -> bool:
    """Return whether a period is a whole number of the controller's cycles; otherwise the states' times jitter."""
    cycles = period_s / CYCLE_S
    return abs(cycles - round(cycles)) < 1e-6


def _joints(state: ArmState) -> list[tuple[str, tuple[float, float]]]:
    return list(zip(JOINT_NAMES, zip(state.q_rad, state.qd_rad_s, strict=True), strict=True))


def _impossible(what: str) -> Problem:
    return Problem(
        "arm_state_impossible",
        f"the controller sends a state that no arm is in: {what}",
        f"Look at the arm, and read the pendant's log for a fault of an encoder. {RESTART_REMEDY}",
    )
