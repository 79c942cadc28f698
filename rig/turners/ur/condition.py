"""What stands in the arm's way, read from one state: pure, shared by pre-flight and by the watch over a move."""

from rig.errors import Problem
from rig.motion.state import ArmState, RobotMode, RuntimeState, SafetyMode

# The slider is reported as a fraction; anything below 99.9 % stretches a sweep measurably.
FULL_SPEED_FRACTION = 0.999


_UNLOCK = "Find out what stopped the arm, clear it, unlock on the pendant (not before 5 s), then start again"
_RELEASE = "Make the cell safe, release the emergency stop, switch the arm on again, then start again"

# Bits of `safety_status_bits` that mean the same as a safety mode; the bits may come one packet before the mode.
_SAFETY_BITS: dict[int, int] = {
    2: SafetyMode.PROTECTIVE_STOP,
    3: SafetyMode.RECOVERY,
    4: SafetyMode.SAFEGUARD_STOP,
    5: SafetyMode.SYSTEM_EMERGENCY_STOP,
    6: SafetyMode.ROBOT_EMERGENCY_STOP,
    7: SafetyMode.ROBOT_EMERGENCY_STOP,
    8: SafetyMode.VIOLATION,
    9: SafetyMode.FAULT,
    1: SafetyMode.REDUCED,
}

_SAFETY_PROBLEMS: dict[int, Problem] = {
    SafetyMode.REDUCED: Problem(
        "reduced_mode",
        "the arm is in reduced mode, which limits its speed",
        "Leave the reduced mode (safety input or plane) so that the sweeps run at the planned speed",
    ),
    SafetyMode.PROTECTIVE_STOP: Problem("protective_stop", "the arm is in a protective stop", _UNLOCK),
    SafetyMode.RECOVERY: Problem(
        "recovery_mode",
        "the arm is in recovery mode",
        "Move it back inside its limits from the pendant, then start again",
    ),
    SafetyMode.SAFEGUARD_STOP: Problem(
        "safeguard_stop", "a safeguard input has stopped the arm", "Close the safeguard and reset it, then start again"
    ),
    SafetyMode.SYSTEM_EMERGENCY_STOP: Problem("emergency_stop", "the system's emergency stop is pressed", _RELEASE),
    SafetyMode.ROBOT_EMERGENCY_STOP: Problem("emergency_stop", "the arm's emergency stop is pressed", _RELEASE),
    SafetyMode.VIOLATION: Problem("safety_violation", "the safety system reports a violation", _UNLOCK),
    SafetyMode.FAULT: Problem(
        "safety_fault", "the safety system reports a fault", "Read the pendant's log, then restart the arm"
    ),
}


def readiness(state: ArmState) -> Problem | None:
    """The first reason why the arm cannot move as planned, or None."""
    if safety := _safety_problem(state):
        return safety
    if state.robot_mode != RobotMode.RUNNING:
        return Problem(
            "arm_not_running",
            f"the arm's mode is {_mode_name(state.robot_mode)}, not RUNNING",
            "Switch the arm on and release its brakes on the pendant",
        )
    if state.target_speed_fraction < FULL_SPEED_FRACTION:
        return Problem(
            "speed_slider",
            f"the speed slider is at {100 * state.target_speed_fraction:.0f} %, so sweeps run slower than planned",
            "Set the speed slider on the pendant to 100 %",
        )
    return None


def local_control(host: str) -> Problem:
    """The pendant has not handed control over."""
    return Problem(
        "not_in_remote_control",
        f"the arm at {host} is in local control",
        "Switch the pendant to remote control (top right corner)",
    )


def program_interruption(state: ArmState) -> Problem | None:
    """Why the control program no longer runs, or None while it does."""
    if state.runtime_state in (RuntimeState.PAUSING, RuntimeState.PAUSED, RuntimeState.RESUMING):
        return Problem("arm_paused", "the program was paused at the pendant", "Start the procedure again when ready")
    if state.runtime_state != RuntimeState.PLAYING:
        return Problem(
            "program_stopped",
            "the control program on the arm was stopped (pendant, dashboard or another client)",
            "Make sure nobody else drives the arm, then start again",
        )
    return None


def _safety_problem(state: ArmState) -> Problem | None:
    mode = state.safety_mode
    if mode == SafetyMode.NORMAL:
        mode = next((named for bit, named in _SAFETY_BITS.items() if state.safety_status_bits >> bit & 1), mode)
    if mode == SafetyMode.NORMAL:
        return None
    unknown = Problem(
        "safety_not_normal", f"the arm's safety mode is {mode}, not NORMAL", "See the pendant's safety display"
    )
    return _SAFETY_PROBLEMS.get(mode, unknown)


def _mode_name(mode: int) -> str:
    return next((known.name for known in RobotMode if known == mode), str(mode))
