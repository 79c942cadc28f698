"""The devices on the flange that send lines of text."""

from rig.config.models import RigConfig
from rig.config.world.laboratory import WorldSection
from rig.config.world.printing_device import SimulatedLinesSection
from rig.world.board.sensor_truth import SensorTruth
from rig.world.instruments import FieldOf, InstrumentMount, MotionOf, mount_magnetometer, sensor_seed
from rig.world.lines.printer import Printer


def build_printer_mounts(config: RigConfig, world: WorldSection) -> dict[str, InstrumentMount]:
    """Return the mounts of the devices that send lines of text, by sensor name."""
    names = sorted(name for name, sensor in config.sensors.items() if sensor.part == "lines")
    return {name: _mount(config, world, name) for name in names}


def _mount(config: RigConfig, world: WorldSection, name: str) -> InstrumentMount:
    """Return the mount of the device that sends the lines of the sensor `name`."""
    sensor, simulated = config.sensors[name], world.sensors[name]
    section = simulated.lines or SimulatedLinesSection()

    def build(motion_of: MotionOf, field_of: FieldOf, time_s: float) -> Printer:
        if sensor.lines is None or sensor.serial is None:
            raise ValueError(f"{name} prints no lines")
        prints = section.prints or sensor.lines
        # It sends accelerations whether the rig reads them or not.
        truth = SensorTruth(sensor, simulated, time_s, accelerometer="ax" in prints.columns)
        magnetometer = mount_magnetometer(config, world, name)
        return Printer(
            truth,
            motion_of(truth),
            section,
            prints,
            field_at=field_of(magnetometer),
            magnetometer=magnetometer.truth,
            rate_hz=sensor.rate_hz,
            baud_rate=float(sensor.serial.baud),
            seed=sensor_seed(world, name),
            time_s=time_s,
            faulty=simulated.faulty,
        )

    return InstrumentMount("printer", build, section.pty, section.bit_error_rate, section.stolen)
