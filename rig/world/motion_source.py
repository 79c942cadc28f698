"""The interface of the turners in the simulated laboratory: an arm's flange, a servo's shaft, an operator's hand."""

from typing import Protocol

from rig.world.magnetic_field import Frames
from rig.world.ur10e.motion.flange_motion import BodyMotion, Components


class MotionSource(Protocol):
    """The turner of the sensors, simulated tick by tick.

    Times are virtual. They lie inside the last tick, or a little before it, because delayed sensors sense the past.
    """

    @property
    def time_s(self) -> float:
        """The world's time at the end of the last tick, s."""
        ...

    @property
    def tick_s(self) -> float:
        """The duration of a tick, s."""
        ...

    @property
    def waiting(self) -> bool:
        """Whether the turner stays at rest until a client acts."""
        ...

    @property
    def ideal(self) -> bool:
        """Whether the turner has no errors and the ground is still: `rate_at` then gives all that gyroscopes sense."""
        ...

    def step(self) -> None:
        """Simulate one tick."""
        ...

    def rate_at(self, time_s: float) -> Components:
        """Return the angular rate, rad/s, of the body with the sensors, in its own frame; valid only if `ideal`."""
        ...

    def motion_at(self, time_s: float) -> BodyMotion:
        """Return the motion of the body with the sensors, in its own frame."""
        ...

    def frames_at(self, time_s: float) -> Frames:
        """Return the frames of all bodies: the fixed body first, that with the sensors last.

        A frame is a rotation matrix to the axes of the fixed body, row by row, and a position in these axes, m.
        """
        ...
