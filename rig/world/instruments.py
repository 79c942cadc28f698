"""The interface that all instruments with a port of their own share with the simulated laboratory and its sockets."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rig.config.models import RigConfig
from rig.config.world.laboratory import WorldSection
from rig.world.board.magnetometer_truth import MountedMagnetometer
from rig.world.board.sensing_element import MotionAt
from rig.world.board.sensor_truth import SensorTruth
from rig.world.board.serial_line import Device

MotionOf = Callable[[SensorTruth], MotionAt]
FieldOf = Callable[[MountedMagnetometer], MotionAt]


class SimulatedInstrument(Device, Protocol):
    """A simulated instrument while it has power."""

    def advance(self, time_s: float) -> None:
        """Simulate until the virtual time `time_s`, which lies in the laboratory's last tick."""

    @property
    def misbehave(self) -> Callable[..., None]:
        """A function that sets the instrument's faults by keyword; omitted faults keep their value."""


@dataclass(slots=True)
class InstrumentMount:
    """The place of an instrument in the simulated laboratory, with its port.

    - kind: its name in control requests.
    - build: returns the instrument, switched on at a virtual time, s. Non-volatile memory is kept by this function,
      because the instrument exists only while it has power.
    - pty: whether its port is also a pseudo-terminal.
    - bit_error_rate: the fraction of wrong bits on its line when the world starts.
    - stolen: the fraction of its bytes that another program on the port reads, when the world starts.
    - instrument: the instrument, None without power.
    """

    kind: str
    build: Callable[[MotionOf, FieldOf, float], SimulatedInstrument]
    pty: bool = False
    bit_error_rate: float = 0.0
    stolen: float = 0.0
    instrument: SimulatedInstrument | None = None

    def switch_on(self, motion_of: MotionOf, field_of: FieldOf, time_s: float) -> None:
        """Switch the instrument on at the virtual time `time_s`, s, unless it is on."""
        if self.instrument is None:
            self.instrument = self.build(motion_of, field_of, time_s)

    def switch_off(self) -> None:
        """Switch the instrument off."""
        self.instrument = None


def sensor_seed(world: WorldSection, name: str, *more: int) -> np.random.SeedSequence:
    """Return the seed of the noise and drift of the sensor `name`; `more` distinguishes sensors with the same name."""
    return np.random.SeedSequence([world.seed, sorted(world.sensors).index(name), *more])


def mount_magnetometer(config: RigConfig, world: WorldSection, name: str) -> MountedMagnetometer:
    """Return an instrument's own magnetometer, which is configured as the sensor `name`."""
    simulated = world.sensors[name]
    return MountedMagnetometer(
        config.sensors[name].mounting, simulated.magnetometer, simulated.mounting_error_deg, simulated.offset_mm
    )
