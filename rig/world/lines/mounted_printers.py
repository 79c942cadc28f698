"""The devices on the flange that print lines of text."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rig.config.models import RigConfig
from rig.config.world.laboratory import WorldSection
from rig.config.world.printing_device import SimulatedLinesSection
from rig.world.board.magnetometer_truth import MountedMagnetometer
from rig.world.board.sensor_truth import SensorTruth
from rig.world.instruments import FieldOf, MotionOf
from rig.world.lines.printer import Printer


@dataclass(slots=True)
class PrinterMount:
    """The place of one device."""

    kind: ClassVar[str] = "printer"
    name: str
    config: RigConfig
    world: WorldSection
    instrument: Printer | None = None

    @property
    def section(self) -> SimulatedLinesSection:
        """The device's section of the world."""
        return self.world.sensors[self.name].lines or SimulatedLinesSection()

    @property
    def pty(self) -> bool:
        """Whether it also has a pseudo-terminal."""
        return self.section.pty

    @property
    def bit_error_rate(self) -> float:
        """The fraction of wrong bits on its line."""
        return self.section.bit_error_rate

    @property
    def stolen(self) -> float:
        """The fraction of the device's bytes that another program on the port reads."""
        return self.section.stolen

    def switch_on(self, motion_of: MotionOf, field_of: FieldOf, time_s: float) -> None:
        """Switch the printing device on at the virtual time `time_s`, unless it is on."""
        if self.instrument is not None:
            return
        sensor, simulated = self.config.sensors[self.name], self.world.sensors[self.name]
        if sensor.lines is None or sensor.serial is None:
            raise ValueError(f"{self.name} prints no lines")
        baud, prints = sensor.serial.baud, self.section.prints or sensor.lines
        # It prints accelerations whether the rig reads them or not.
        truth = SensorTruth(sensor, simulated, time_s, accelerometer="ax" in prints.columns)
        magnetometer = MountedMagnetometer(
            sensor.mounting, simulated.magnetometer, simulated.mounting_error_deg, simulated.offset_mm
        )
        self.instrument = Printer(
            truth,
            motion_of(truth),
            self.section,
            prints,
            field_at=field_of(magnetometer),
            magnetometer=magnetometer.truth,
            rate_hz=sensor.rate_hz,
            baud_rate=float(baud),
            seed=np.random.SeedSequence([self.world.seed, sorted(self.world.sensors).index(self.name)]),
            time_s=time_s,
            faulty=simulated.faulty,
        )

    def switch_off(self) -> None:
        """Switch the printing device off."""
        self.instrument = None


def build_printer_mounts(config: RigConfig, world: WorldSection) -> dict[str, PrinterMount]:
    """Return the devices by sensor name."""
    printing = sorted(name for name, sensor in config.sensors.items() if sensor.part == "lines")
    return {name: PrinterMount(name, config, world) for name in printing}
