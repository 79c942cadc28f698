"""What the instruments with a port of their own have in common: the laboratory and its sockets know no more of them."""

from collections.abc import Callable
from typing import Protocol

from rig.world.board.magnetometer_truth import MountedMagnetometer
from rig.world.board.sensing_element import MotionAt
from rig.world.board.sensor_truth import SensorTruth
from rig.world.board.serial_line import Device

MotionOf = Callable[[SensorTruth], MotionAt]
FieldOf = Callable[[MountedMagnetometer], MotionAt]


class Instrument(Device, Protocol):
    """What stands at a place while it has power."""

    def advance(self, time_s: float) -> None:
        """Live until this virtual time, which lies in the laboratory's last tick."""

    @property
    def misbehave(self) -> Callable[..., None]:
        """What makes it misbehave: takes its own faults by their names; those that are not given stay as they are."""


class Place(Protocol):
    """An instrument's place, and what stays there when it is switched off.

    `kind` is the word for it in requests; `pty` says that its port is to be a pseudo-terminal too. Of the bits on its
    line the share `bit_error_rate` is wrong, to begin with, and the share `stolen` is read by another program.
    """

    @property
    def kind(self) -> str: ...
    @property
    def pty(self) -> bool: ...
    @property
    def bit_error_rate(self) -> float: ...
    @property
    def stolen(self) -> float: ...
    @property
    def instrument(self) -> Instrument | None:
        """What stands there; None without power."""

    def switch_on(self, motion_of: MotionOf, field_of: FieldOf, time_s: float) -> None:
        """Give it power at the virtual time `time_s`, if it has none."""

    def switch_off(self) -> None:
        """Take its power away."""
