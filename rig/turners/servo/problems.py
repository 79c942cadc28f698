"""The problems of a servo in motion, as messages: name, what, remedy."""

from rig.errors import Problem
from rig.motion.steps import Motion
from rig.turners.servo.packet_handler import BusError, InstructionDenied, PortGone


def port_lost(error: PortGone) -> Problem:
    """Return the problem of a port that has failed."""
    return Problem(
        "servo_port_lost",
        f"the servo's port has failed ({error})",
        "Look at the adapter and its cable, then start again",
    )


def silent(silent_s: float, mostly_damaged: bool) -> Problem:
    """Return the problem of a servo that has sent no valid reply for `silent_s`."""
    if mostly_damaged:
        return Problem(
            "servo_replies_damaged",
            f"only damaged replies have come from the servo for {silent_s:.1f} s",
            "Look for a second servo with its ID, and at the cable and the adapter's ground",
        )
    return Problem(
        "servo_link_lost",
        f"no reply has come from the servo for {silent_s:.1f} s",
        "Look at its supply and its cable, then start again",
    )


def servo_restarted() -> Problem:
    """Return the problem of a servo that has lost its supply and restarted."""
    return Problem(
        "servo_restarted",
        "the servo's clock started again from zero: it was switched off or restarted, and has lost its goal and turns",
        "Look at its supply; hold the board, and start again",
    )


def torque_lost() -> Problem:
    """Return the problem of torque that another program has switched off."""
    return Problem(
        "servo_torque_lost",
        "the servo's torque is off, and the rig did not switch it off",
        "End other programs that use the servo; hold the board, and start again",
    )


def watchdog_tripped() -> Problem:
    """Return the problem of a servo stopped by its own watchdog."""
    return Problem(
        "servo_watchdog_tripped",
        "the servo's watchdog has stopped it: no instruction came in time",
        "Look at the load of the computer and at the cable, then start again",
    )


def driver_died(error: Exception) -> Problem:
    """Return the problem of a link's thread that has failed."""
    return Problem("servo_driver_died", f"the servo's driver has failed ({error!r})", "Report it, with the log")


def driver_hung(silent_s: float) -> Problem:
    """Return the problem of a link whose thread hangs."""
    return Problem(
        "servo_driver_hung",
        f"the thread that drives the servo's line has not run for {silent_s:.1f} s",
        "Look at the adapter and its cable, then start again",
    )


def state_not_taken(error: Exception) -> Problem:
    """Return the problem of a state that could not be recorded."""
    return Problem("servo_state_not_taken", f"a state could not be passed on ({error})", "See the log")


def move_unsupervised(for_s: float, doing: str) -> Problem:
    """Return the problem of a move that was unsupervised for `for_s`."""
    return Problem(
        "servo_unwatched",
        f"nobody has supervised the servo for {for_s:.0f} s during {doing}",
        "See the log for what delayed the program, then start again",
    )


def slower_than_planned(motion: Motion, within_s: float) -> Problem:
    """Return the problem of a move that has not ended in time."""
    return Problem(
        "servo_slower_than_planned",
        f"{motion.name} did not end within {within_s:.1f} s, planned were {motion.duration_s:.1f} s",
        "Look for what holds the shaft, and whether the servo's supply is strong enough",
    )


def does_not_hear(error: BusError) -> Problem:
    """Return the problem of an instruction without an acknowledgement."""
    return Problem(
        "servo_does_not_hear",
        f"the servo did not acknowledge an instruction ({error})",
        "Look at its supply and its cable, then start again",
    )


def refuses(error: InstructionDenied) -> Problem:
    """Return the problem of an instruction that the servo refuses."""
    return Problem(
        "servo_refuses",
        f"the servo refuses an instruction: {error}",
        "Switch it off and on; look its registers up in the maker's Dynamixel Wizard 2.0",
    )
