"""The messages between parent and child over the pipe: small frozen values, pickled."""

from dataclasses import dataclass

from rig.errors import Problem
from rig.motion.carried import FlangeLoad
from rig.motion.turner_state import ArmState, Joints

# Parent to child ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class TakeControl:
    """The request to upload the script and set the payload, answered by `ScriptStarted` and `ControlTaken`."""

    carried: FlangeLoad


@dataclass(frozen=True, slots=True)
class MoveRequest:
    """The request to start a joint-space movement. Answers: `MoveStarted` and `MoveFinished`, or `RequestFailed`."""

    target_q_rad: Joints
    speed_rad_s: float
    acceleration_rad_s2: float


@dataclass(frozen=True, slots=True)
class BrakeRequest:
    """The request to brake at once and end the control script, also served during a movement. Answer: `Braked`."""

    deceleration_rad_s2: float


@dataclass(frozen=True, slots=True)
class Alive:
    """The parent's sign of life; without it the child stops the arm itself. This message is not answered."""


Request = TakeControl | MoveRequest | BrakeRequest | Alive

# Child to parent ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Connected:
    """The start of the controller's states; `version`: its software's major, minor, bugfix and build number."""

    version: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class ChildHeartbeat:
    """The child's sign of life; `states` are the arm's states since the child's last heartbeat, oldest first.

    `silent_s`: a lower bound of the time since data came from the controller (`StateStream`).
    """

    states: tuple[ArmState, ...]
    silent_s: float = 0.0


@dataclass(frozen=True, slots=True)
class ScriptStarted:
    """The start of the control script; the payload is being set."""


@dataclass(frozen=True, slots=True)
class ControlTaken:
    """The beginning of full control: the control script runs and the payload is set."""


@dataclass(frozen=True, slots=True)
class MoveStarted:
    """The controller's acceptance of the movement."""


@dataclass(frozen=True, slots=True)
class MoveFinished:
    """The controller's report of the movement's end."""


@dataclass(frozen=True, slots=True)
class RequestFailed:
    """The failure of a request, or of the connection."""

    problem: Problem


@dataclass(frozen=True, slots=True)
class Braked:
    """The answer to a brake request; `confirmed`: whether the client's script has confirmed it."""

    confirmed: bool


@dataclass(frozen=True, slots=True)
class Disturbed:
    """A problem that the states show, and after which the run cannot continue. The child sends it unasked."""

    problem: Problem


Answer = ScriptStarted | ControlTaken | MoveStarted | MoveFinished | RequestFailed
Message = Connected | ChildHeartbeat | Answer | Braked | Disturbed
