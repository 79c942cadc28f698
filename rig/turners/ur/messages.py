"""What parent and child say to each other over the pipe: small frozen values, pickled."""

from dataclasses import dataclass

from rig.errors import Problem
from rig.motion.carried import Carried
from rig.motion.state import ArmState, Joints

# Parent to child ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class TakeControl:
    """Upload the control script and set the payload. Answered by `ScriptStarted` and `ControlTaken`, or by `Failed`."""

    carried: Carried


@dataclass(frozen=True, slots=True)
class Move:
    """Start a joint-space movement. Answered by `MoveStarted` and `MoveFinished`, or by `Failed`."""

    target_q_rad: Joints
    speed_rad_s: float
    acceleration_rad_s2: float


@dataclass(frozen=True, slots=True)
class Stop:
    """Brake at once and end the control script; served while a movement runs. Answered by `Braked`."""

    deceleration_rad_s2: float


@dataclass(frozen=True, slots=True)
class Alive:
    """The parent still runs; when these stop coming, the child stops the arm itself. Not answered."""


Request = TakeControl | Move | Stop | Alive

# Child to parent ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Connected:
    """The controller sends states; `version` is its software's: major, minor, bugfix, build."""

    version: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """The child lives; `states` are those that came since the last heartbeat, oldest first.

    For at least `silent_s` nothing at all has come from the controller: see `StateStream`.
    """

    states: tuple[ArmState, ...]
    silent_s: float = 0.0


@dataclass(frozen=True, slots=True)
class ScriptStarted:
    """The control script runs, and the payload is being set."""


@dataclass(frozen=True, slots=True)
class ControlTaken:
    """The control script runs and the payload is set."""


@dataclass(frozen=True, slots=True)
class MoveStarted:
    """The controller has taken the movement on."""


@dataclass(frozen=True, slots=True)
class MoveFinished:
    """The controller reports the end of the movement."""


@dataclass(frozen=True, slots=True)
class Failed:
    """The request, or the connection, failed."""

    problem: Problem


@dataclass(frozen=True, slots=True)
class Braked:
    """The client was told to brake; `taken` says whether its script did so."""

    taken: bool


@dataclass(frozen=True, slots=True)
class Disturbed:
    """What the states showed, unasked: nothing can go on after it."""

    problem: Problem


Answer = ScriptStarted | ControlTaken | MoveStarted | MoveFinished | Failed
Message = Connected | Heartbeat | Answer | Braked | Disturbed
