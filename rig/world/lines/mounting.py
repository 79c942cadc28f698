"""The devices of the laboratory that print lines, on the flange."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rig.config.models import RigConfig
from rig.config.sensor_sections import AccelerationSection
from rig.config.world_lines import SimulatedLinesSection
from rig.config.world_models import WorldSection
from rig.world.board.magnetometer_truth import MountedMagnetometer
from rig.world.board.sensor_truth import SensorTruth
from rig.world.lines.printer import Printer

MotionAt = Callable[[float], Sequence[float]]


@dataclass(slots=True)
class PrinterMount:
    """One device's place."""

    name: str
    config: RigConfig
    world: WorldSection
    printer: Printer | None = None  # None: without power

    def switch_on(
        self,
        motion_of: Callable[[SensorTruth], MotionAt],
        field_of: Callable[[MountedMagnetometer], MotionAt],
        time_s: float,
    ) -> None:
        """Give it power at the virtual time `time_s`, if it has none."""
        if self.printer is not None:
            return
        sensor, simulated = self.config.sensors[self.name], self.world.sensors[self.name]
        if sensor.lines is None or sensor.serial is None:
            raise ValueError(f"{self.name} prints no lines")
        section, baud = simulated.lines or SimulatedLinesSection(), sensor.serial.baud
        prints = section.prints or sensor.lines
        if "ax" in prints.columns:  # it prints accelerations whether the rig reads them or not
            sensor = sensor.model_copy(update={"acceleration": sensor.acceleration or AccelerationSection()})
        truth = SensorTruth(sensor, simulated, time_s)
        magnetometer = MountedMagnetometer(
            sensor.mounting, simulated.magnetometer, simulated.mounting_error_deg, simulated.offset_mm
        )
        self.printer = Printer(
            truth,
            motion_of(truth),
            section,
            prints,
            field_at=field_of(magnetometer),
            magnetometer=magnetometer.truth,
            rate_hz=sensor.rate_hz,
            baud_rate=float(baud),
            seed=np.random.SeedSequence([self.world.seed, sorted(self.world.sensors).index(self.name)]),
            time_s=time_s,
        )

    def switch_off(self) -> None:
        """Take its power away."""
        self.printer = None


def printer_mounts(config: RigConfig, world: WorldSection) -> dict[str, PrinterMount]:
    """Devices by sensor name."""
    printing = sorted(name for name, sensor in config.sensors.items() if sensor.part == "lines")
    return {name: PrinterMount(name, config, world) for name in printing}
