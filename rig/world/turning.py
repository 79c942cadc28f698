"""What turns the sensors in the laboratory, as far as they feel it: an arm's flange, or an operator's hand."""

from typing import Protocol

from rig.world.magnetic_field import Frames
from rig.world.ur10e.motion.flange_motion import Components, Felt


class Turning(Protocol):
    """What turns the sensors, tick by tick.

    Times are the world's, inside the last tick or the memory that delayed sensors need.
    """

    @property
    def time_s(self) -> float:
        """The world's time at the end of the last tick."""
        ...

    @property
    def tick_s(self) -> float:
        """How long a tick lasts."""
        ...

    @property
    def waiting(self) -> bool:
        """Whether nothing but a client can let it move."""
        ...

    @property
    def ideal(self) -> bool:
        """Whether the rate is all that anybody can feel of it."""
        ...

    def step(self) -> None:
        """One tick of it."""
        ...

    def rate_at(self, time_s: float) -> Components:
        """Angular rate of what carries the sensors, in its own frame, rad/s, of what is `ideal`."""
        ...

    def felt_at(self, time_s: float) -> Felt:
        """All that a body feels that is carried."""
        ...

    def frames_at(self, time_s: float) -> Frames:
        """Rotation (rows) and place (m) of what stands still, and of all that moves, what carries the sensors last."""
        ...
