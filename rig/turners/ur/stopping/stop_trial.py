"""A trial of the stop before anything moves, on a PolyScope X, whose only independent stop gives no acknowledgement.

The primary interface acknowledges no line, and accepts lines only in remote control, which controllers before 10.12 do
not report. So the trial starts a program that moves nothing, and ends it by the line that would stop the arm.
"""

from collections.abc import Callable
from contextlib import closing, suppress

from rig.errors import Problem
from rig.motion.turner_state import RuntimeState
from rig.turners.ur.condition import local_control
from rig.turners.ur.controller.primary_stop import PrimaryStop
from rig.turners.ur.controller.robot_api import RobotApi
from rig.turners.ur.supervision import describe_early_end

NAME = "rig_stop_trial"
PROGRAM = f"def {NAME}():\n  while True:\n    sync()\n  end\nend\n"
MAX_BEGIN_S = 5.0  # time for which the client's own program may take to start
MAX_END_S = 2.0


def stop_trial(host: str, api: RobotApi, shows: Callable[[RuntimeState, float], bool]) -> Problem | None:
    """Run a program that moves nothing and stop it; return why the primary interface could not, None if it could.

    `shows(state, timeout_s)` waits for this state of the arm's program and returns whether it occurred.
    """
    if api.is_in_remote_control() is False:
        return local_control(host)
    try:
        with closing(PrimaryStop(host, MAX_BEGIN_S)) as primary:
            primary.send(PROGRAM)
            if not shows(RuntimeState.PLAYING, MAX_BEGIN_S):
                not_started = _not_proved(host, "began no program that was sent to it there")
                return describe_early_end(not_started) if _has_ended_at_once(primary) else not_started
            primary.stop_program()
            if not shows(RuntimeState.STOPPED, MAX_END_S):
                return _not_proved(host, "did not end a program that moves nothing, which may still run")
    except OSError as error:
        return _not_proved(host, f"does not answer ({error})")
    return None


def _has_ended_at_once(primary: PrimaryStop) -> bool:
    """Return whether the controller reports the end of a program that no state showed as running."""
    with suppress(OSError):
        primary.program_running()
    return NAME in primary.stopped_programs


def _not_proved(host: str, what: str) -> Problem:
    return Problem(
        "stop_not_proved",
        f"the rig could not stop the arm at {host} by its primary interface (port 30001): the controller {what}",
        "Switch the pendant to remote control, and enable the primary client interface in the security settings",
    )
