"""The KVH 1775s of the laboratory: their memories, and the instruments on the flange that use them."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rig.config.models import RigConfig
from rig.config.world.laboratory import SimulatedKvhSection, WorldSection
from rig.errors import Refused
from rig.world.board.magnetometer_truth import MountedMagnetometer
from rig.world.board.sensor_truth import SensorTruth
from rig.world.instruments import FieldOf, MotionOf
from rig.world.kvh1775.instrument import SimulatedKvh1775
from rig.world.kvh1775.memory import KvhMemory


@dataclass(slots=True)
class KvhMount:
    """The socket of one instrument, with the memory that it keeps without power."""

    kind: ClassVar[str] = "kvh"
    bit_error_rate: ClassVar[float] = 0.0
    stolen: ClassVar[float] = 0.0
    name: str
    config: RigConfig
    world: WorldSection
    memory: KvhMemory
    instrument: SimulatedKvh1775 | None = None

    @property
    def pty(self) -> bool:
        """Whether it also has a pseudo-terminal."""
        return _section(self.world, self.name).pty

    def switch_on(self, motion_of: MotionOf, field_of: FieldOf, time_s: float) -> None:
        """Switch the instrument on at the virtual time `time_s`, unless it is on."""
        if self.instrument is not None:
            return
        sensor, section = self.config.sensors[self.name], _section(self.world, self.name)
        simulated = self.world.sensors[self.name]
        # It sends accelerations whether the rig reads them or not.
        truth = SensorTruth(sensor, simulated, time_s, accelerometer=True)
        magnetometer = MountedMagnetometer(
            sensor.mounting, simulated.magnetometer, simulated.mounting_error_deg, simulated.offset_mm
        )
        self.instrument = SimulatedKvh1775(
            truth,
            motion_of(truth),
            self.memory,
            field_at=field_of(magnetometer),
            magnetometer=magnetometer.truth,
            serial_number=section.serial_number or sensor.serial_number,
            oscillator_ppm=section.oscillator_ppm,
            uptime_s=section.uptime_s,
            seed=np.random.SeedSequence([self.world.seed, sorted(self.world.sensors).index(self.name)]),
            time_s=time_s,
            faulty=simulated.faulty,
        )

    def switch_off(self) -> None:
        """Switch the instrument off."""
        self.instrument = None


def build_kvh_mounts(config: RigConfig, world: WorldSection) -> dict[str, KvhMount]:
    """Return the instruments by sensor name. Raise `Refused` `kvh_settings` for an unknown setting."""
    mounts = {}
    for name in sorted(name for name, sensor in config.sensors.items() if sensor.part == "kvh1775"):
        try:
            mounts[name] = KvhMount(name, config, world, KvhMemory(_section(world, name).settings))
        except ValueError as error:
            raise Refused(
                "kvh_settings", f"world.sensors.{name}.kvh1775.settings: {error}", "Give settings of its commands"
            ) from None
    return mounts


def _section(world: WorldSection, name: str) -> SimulatedKvhSection:
    return world.sensors[name].kvh1775 or SimulatedKvhSection()
