"""Whether a state is one that an arm can be in, and whether it follows the one before in time. Pure.

A controller whose clock is set while it runs, or whose states are no numbers, cannot be solved afterwards: the times of
the states are the reference of a recording. So both end a run at once, by name.
"""

import math
from collections.abc import Sequence
from itertools import chain

from rig.errors import Problem
from rig.motion.state import JOINT_NAMES, ArmState

# No arm turns so far or so fast, or has other modes: a UR3e's wrist 3 turns without end, and counts its turns.
ANGLE_RAD, SPEED_RAD_S, MODES = 1e3, 20.0, range(-1, 64)
# A joint of the fastest arm of this kind turns by 6.3 rad/s, and by 3.14 under the rig; three times that is none.
ENCODER_RAD, FASTEST_RAD_S = 0.03, 10.0
CYCLE_S = 0.002  # of the controller, at whose ends states are made: of a CB3 one is four of these
OFF_CYCLE = 0.3  # of a period: a time stamp that far from its place is none
LOST_S = 0.1  # so long states may be missing without anything else that shows it
RESTART = "Restart the controller if it happens again"


def impossible_state(state: ArmState) -> Problem | None:
    """Why no arm is in such a state: values that are no numbers, or that no arm and no mode of it has."""
    values = {
        "time": (state.time_s,),
        "speed slider": (state.target_speed_fraction,),
        "speed scaling": (state.speed_scaling,),
    }
    for name, numbers in chain(values.items(), _joints(state)):
        if not all(map(math.isfinite, numbers)):
            return _impossible(f"its {name} is {numbers[0]:g}")
    for name, (angle, speed) in _joints(state):
        if abs(angle) > ANGLE_RAD or abs(speed) > SPEED_RAD_S:
            return _impossible(f"its {name} stands at {angle:.4g} rad and turns at {speed:.4g} rad/s")
    if not 0.0 <= state.target_speed_fraction <= 1.0:
        return _impossible(f"its speed slider is at {100 * state.target_speed_fraction:.4g} %")
    for name in ("robot_mode", "safety_mode", "runtime_state"):
        if (mode := getattr(state, name)) not in MODES:
            return _impossible(f"its {name} is {mode}")
    return None


def impossible_payload(mass_kg: float, centre_m: Sequence[float]) -> Problem | None:
    """Why no controller reckons with such a payload: a value of it is no number."""
    numbers = (mass_kg, *centre_m)
    return None if all(map(math.isfinite, numbers)) else _impossible(f"its payload is {mass_kg:g} kg at {centre_m} m")


def impossible_way(before: ArmState, after: ArmState) -> Problem | None:
    """Why no arm goes from one state to the next: a joint would have turned farther than any can in that time."""
    step_s = abs(after.time_s - before.time_s)
    for name, q1, q2 in zip(JOINT_NAMES, before.q_rad, after.q_rad, strict=True):
        if abs(q2 - q1) > ENCODER_RAD + FASTEST_RAD_S * step_s:
            return _impossible(f"its {name} went by {math.degrees(q2 - q1):+.1f}° in {step_s:.3f} s")
    return None


def clock_step(before_s: float, after_s: float, period_s: float, missed_s: float) -> Problem | None:
    """Why a state's time is not the last one's plus so many periods, of which states may have been lost.

    `missed_s` is for how long, by the controller's clock, states may have been lost of late.
    """
    step_s = after_s - before_s
    whole_s = period_s if _divides(period_s) else CYCLE_S
    off_s = abs(step_s - max(1, round(step_s / whole_s)) * whole_s)
    if off_s <= OFF_CYCLE * whole_s and step_s - period_s <= LOST_S + missed_s:
        return None
    return Problem(
        "arm_clock_stepped",
        f"the controller's time went from {before_s:.3f} s to {after_s:.3f} s from one state to the next, where "
        f"{period_s:.3f} s belong: its clock was set",
        f"Look whether a second controller answers at arm.host, then start again. {RESTART}",
    )


def _divides(period_s: float) -> bool:
    """Whether a period is made of whole cycles of the controller's; else states come now earlier, now later."""
    cycles = period_s / CYCLE_S
    return abs(cycles - round(cycles)) < 1e-6


def _joints(state: ArmState) -> list[tuple[str, tuple[float, float]]]:
    return list(zip(JOINT_NAMES, zip(state.q_rad, state.qd_rad_s, strict=True), strict=True))


def _impossible(what: str) -> Problem:
    return Problem(
        "arm_state_impossible",
        f"the controller sends a state that no arm is in: {what}",
        f"Look at the arm, and read the pendant's log for a fault of an encoder. {RESTART}",
    )
