"""The interface that all instruments with a port of their own share with the laboratory and its sockets."""

from collections.abc import Callable
from typing import Protocol

from rig.world.board.magnetometer_truth import MountedMagnetometer
from rig.world.board.sensing_element import MotionAt
from rig.world.board.sensor_truth import SensorTruth
from rig.world.board.serial_line import Device

MotionOf = Callable[[SensorTruth], MotionAt]
FieldOf = Callable[[MountedMagnetometer], MotionAt]


class SimulatedInstrument(Device, Protocol):
    """An instrument that has power."""

    def advance(self, time_s: float) -> None:
        """Simulate until the virtual time `time_s`, which lies in the laboratory's last tick."""

    @property
    def misbehave(self) -> Callable[..., None]:
        """A function that sets the instrument's faults by keyword; omitted faults keep their value."""


class InstrumentMount(Protocol):
    """The socket of an instrument, with the state that it keeps without power.

    `kind`: its name in control requests; `pty`: whether its port is also a pseudo-terminal. Initially `bit_error_rate`
    is the fraction of wrong bits on its line, and `stolen` the fraction of bytes that another program reads.
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
    def instrument(self) -> SimulatedInstrument | None:
        """The instrument; None without power."""

    def switch_on(self, motion_of: MotionOf, field_of: FieldOf, time_s: float) -> None:
        """Switch the instrument on at the virtual time `time_s`, s, unless it is on."""

    def switch_off(self) -> None:
        """Switch the instrument off."""
