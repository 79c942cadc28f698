"""A trial of the stop, before anything moves: on a PolyScope X, where the only way beside the client's tells nothing.

Its primary interface takes lines in remote control alone, which controllers before 10.12 do not tell, and acknowledges
none. So it is given a program that moves nothing, and told to end it by the line that has to stop the arm.
"""

from collections.abc import Callable
from contextlib import closing, suppress

from rig.errors import Problem
from rig.motion.state import RuntimeState
from rig.turners.ur.condition import local_control
from rig.turners.ur.controller.primary_stop import PrimaryStop
from rig.turners.ur.controller.robot_api import RobotApi
from rig.turners.ur.supervision import stopped_at_start

NAME = "rig_stop_trial"
PROGRAM = f"def {NAME}():\n  while True:\n    sync()\n  end\nend\n"
BEGIN_S = 5.0  # as long as the client's own program may take to begin
END_S = 2.0


def stop_trial(host: str, api: RobotApi, shows: Callable[[RuntimeState, float], bool]) -> Problem | None:
    """Why the arm at `host` could not be stopped by its primary interface, or None: a program was, just now.

    `shows(state, timeout_s)` waits for a state of the arm in which its program is so.
    """
    if api.in_remote_control() is False:
        return local_control(host)
    try:
        with closing(PrimaryStop(host, BEGIN_S)) as primary:
            primary.send(PROGRAM)
            if not shows(RuntimeState.PLAYING, BEGIN_S):
                begun_none = _not_proved(host, "began no program that was sent to it there")
                return stopped_at_start(begun_none) if _ended_at_once(primary) else begun_none
            primary.stop_program()
            if not shows(RuntimeState.STOPPED, END_S):
                return _not_proved(host, "did not end a program that moves nothing, which may still run")
    except OSError as error:
        return _not_proved(host, f"does not answer ({error})")
    return None


def _ended_at_once(primary: PrimaryStop) -> bool:
    """Whether the controller says that the program ended, which no state showed running."""
    with suppress(OSError):
        primary.program_running()
    return NAME in primary.stopped_programs


def _not_proved(host: str, what: str) -> Problem:
    return Problem(
        "stop_not_proved",
        f"the rig could not stop the arm at {host} by its primary interface (port 30001): the controller {what}",
        "Switch the pendant to remote control, and enable the primary client interface in the security settings",
    )
