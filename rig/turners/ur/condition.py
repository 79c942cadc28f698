"""What stands in the arm's way, read from one state: pure, shared by pre-flight and by the watch over a move."""

from rig.errors import Problem
from rig.motion.carried import Carried
from rig.motion.state import ArmState, RobotMode, RuntimeState, SafetyMode

# The slider is reported as a fraction; anything below 99.9 % stretches a sweep measurably.
FULL_SPEED_FRACTION = 0.999
MAKERS_SIMULATOR = ("127.0.0.1", "localhost")  # where the client does not ask for remote control

LIMITED_REMEDY = (
    "Widen that limit in the arm's safety settings (speed of tool, elbow or joint, momentum, power, a safety plane), "
    "or lower procedure.speed_deg_s and arm.transfer_speed_deg_s"
)

_UNLOCK = "Find out what stopped the arm, clear it, unlock on the pendant (not before 5 s), then start again"
_SWITCH_ON = "Switch the arm on and release its brakes on the pendant"
_WAIT = (
    "Wait until the pendant shows the arm ready, which takes some minutes where firmware is updated; then switch it on"
)
# What a mode asks for beside switching the arm on.
_MODE_REMEDIES: dict[int, str] = {
    RobotMode.NO_CONTROLLER: "Look at the pendant: the controller's own software does not run. Restart the control box",
    RobotMode.DISCONNECTED: "Look at the cable between control box and arm, then restart the control box",
    RobotMode.CONFIRM_SAFETY: "Confirm the safety settings on the pendant, then switch the arm on",
    RobotMode.BOOTING: _WAIT,
    RobotMode.UPDATING_FIRMWARE: _WAIT,
    RobotMode.BACKDRIVE: "End the backdrive (freedrive without motors) on the pendant, then switch the arm on",
}
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
            _MODE_REMEDIES.get(state.robot_mode, _SWITCH_ON),
        )
    if state.target_speed_fraction < FULL_SPEED_FRACTION:
        return Problem(
            "speed_slider",
            f"the speed slider is at {100 * state.target_speed_fraction:.0f} %, so sweeps run slower than planned",
            "Set the speed slider on the pendant to 100 %",
        )
    return None


def switched_to_local_control(host: str, how: str) -> Problem:
    """The pendant has taken control back while the arm was under the rig's."""
    return Problem(
        "switched_to_local_control",
        f"of the arm at {host} {how}, in which it takes no stop but the client's",
        "Leave the pendant in remote control while a run goes on, or lock its mode by a password (Settings, Password, "
        "Mode); look at the arm, switch it back to remote control, then start again",
    )


def local_control(host: str) -> Problem:
    """The pendant has not handed control over."""
    return Problem(
        "not_in_remote_control",
        f"the arm at {host} is in local control",
        "Switch the pendant to remote control (top right corner)",
    )


def speed_limited(state: ArmState) -> Problem:
    """A limit of the safety settings slows the arm down, with the slider at 100 %."""
    return Problem(
        "speed_limited",
        f"the controller runs its program at {100 * state.speed_scaling:.0f} % of the programmed speed, with the speed "
        "slider at 100 %: a limit of the safety settings slows it down",
        LIMITED_REMEDY,
    )


def payload_refused(carried: Carried) -> Problem:
    """The controller has ended the program over the payload that it was given."""
    return Problem(
        "payload_not_set",
        f"the controller does not take a payload of {carried.payload_kg:g} kg",
        "Correct arm.payload_kg and arm.payload_centre_mm, or the payload limits in the arm's installation",
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
