"""Problems of an arm that one state shows. Pure, for pre-flight and for supervision of a move."""

from rig.errors import Problem
from rig.motion.carried import FlangeLoad
from rig.motion.turner_state import ArmState, RobotMode, RuntimeState, SafetyMode

FULL_SPEED_FRACTION = 0.999  # of the slider: anything lower prolongs a sweep measurably
SIMULATOR_HOSTS = ("127.0.0.1", "localhost")  # at which the client skips the check of remote control

LIMITED_REMEDY = (
    "Widen that limit in the arm's safety settings (speed of tool, elbow or joint, momentum, power, a safety plane), "
    "or lower procedure.speed_deg_s and arm.transfer_speed_deg_s"
)

_UNLOCK = (
    "Find out what stopped the arm, clear it, unlock on the pendant (5 s after the stop or later), then start again"
)
_SWITCH_ON = "Switch the arm on and release its brakes on the pendant"
_WAIT = (
    "Wait until the pendant shows the arm ready, which takes some minutes where firmware is updated; then switch it on"
)
# Modes that need more than switching the arm on.
_MODE_REMEDIES: dict[int, str] = {
    RobotMode.NO_CONTROLLER: "Look at the pendant: the controller's own software does not run. Restart the control box",
    RobotMode.DISCONNECTED: "Look at the cable between control box and arm, then restart the control box",
    RobotMode.CONFIRM_SAFETY: "Confirm the safety settings on the pendant, then switch the arm on",
    RobotMode.BOOTING: _WAIT,
    RobotMode.UPDATING_FIRMWARE: _WAIT,
    RobotMode.BACKDRIVE: "End the backdrive (freedrive without motors) on the pendant, then switch the arm on",
}
_RELEASE = "Make the cell safe, release the emergency stop, switch the arm on again, then start again"

# Bits of `safety_status_bits` equivalent to a safety mode; they may come one packet before the mode.
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
    """Return the first reason why the arm cannot move as planned; None if it can."""
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
            f"the speed slider is at {100 * state.target_speed_fraction:.0f} %, but the plan needs 100 %",
            "Set the speed slider on the pendant to 100 %",
        )
    return None


def local_control_during_run(what: str) -> Problem:
    """Return the problem of a pendant that was switched to local control in a run; `what` states how that showed."""
    return Problem(
        "switched_to_local_control",
        what,
        "Look at the arm, switch its pendant back to remote control, then start again. Leave it there during a run: in "
        "local control the controller accepts no independent stop. A password locks it (Settings, Password, Mode)",
    )


def local_control(host: str) -> Problem:
    """Return the problem of a pendant in local control."""
    return Problem(
        "not_in_remote_control",
        f"the arm at {host} is in local control",
        "Switch the pendant to remote control (top right corner)",
    )


def speed_limited(state: ArmState) -> Problem:
    """Return the problem of an arm slowed by a limit of the safety settings, with the slider at 100 %."""
    return Problem(
        "speed_limited",
        f"the controller runs its program at {100 * state.speed_scaling:.0f} % of the programmed speed, with the speed "
        "slider at 100 %: a limit of the safety settings slows it down",
        LIMITED_REMEDY,
    )


def payload_refused(carried: FlangeLoad) -> Problem:
    """Return the problem of a program that the controller has ended because of the payload on the flange."""
    return Problem(
        "payload_not_set",
        f"the controller does not take a payload of {carried.payload_kg:g} kg",
        "Correct arm.payload_kg and arm.payload_centre_mm, or the payload limits in the arm's installation",
    )


def program_interruption(state: ArmState) -> Problem | None:
    """Return why the control program no longer runs; None while it runs."""
    if state.runtime_state in (RuntimeState.PAUSING, RuntimeState.PAUSED, RuntimeState.RESUMING):
        return Problem("arm_paused", "the program was paused at the pendant", "Start the procedure again when ready")
    if state.runtime_state != RuntimeState.PLAYING:
        return Problem(
            "program_stopped",
            "the control program on the arm was stopped (pendant, dashboard or another client)",
            "Make sure that nobody else drives the arm, and that no fieldbus without a connection stops programs; then "
            "start again",
        )
    return None


def _safety_problem(state: ArmState) -> Problem | None:
    """Return the problem of a safety mode other than normal, as the mode or the safety bits show it."""
    mode = state.safety_mode
    if mode == SafetyMode.NORMAL:
        mode = next((bit_mode for bit, bit_mode in _SAFETY_BITS.items() if state.safety_status_bits >> bit & 1), mode)
    if mode == SafetyMode.NORMAL:
        return None
    other_mode = Problem(
        "safety_not_normal", f"the arm's safety mode is {mode}, not NORMAL", "See the pendant's safety display"
    )
    return _SAFETY_PROBLEMS.get(mode, other_mode)


def _mode_name(mode: int) -> str:
    return next((robot_mode.name for robot_mode in RobotMode if robot_mode == mode), str(mode))
