"""The autopilots of the simulated laboratory: their parameters, and their IMUs on the flange."""

from rig.config.models import RigConfig
from rig.config.world.autopilot import SimulatedAutopilotSection
from rig.config.world.laboratory import WorldSection
from rig.errors import Refused
from rig.world.autopilot.autopilot import SimulatedAutopilot
from rig.world.autopilot.autopilot_imu import SimulatedImu
from rig.world.autopilot.parameters import Parameters
from rig.world.board.sensor_truth import SensorTruth
from rig.world.instruments import FieldOf, InstrumentMount, MotionOf, sensor_seed


def build_autopilot_mounts(config: RigConfig, world: WorldSection) -> dict[str, InstrumentMount]:
    """Return the autopilots by port. Raise Refused `autopilot_parameters` for a parameter that an autopilot lacks."""
    imus_by_port: dict[str, dict[int, str]] = {}
    for name, sensor in config.sensors.items():
        if sensor.mavlink is not None:
            imus_by_port.setdefault(sensor.mavlink.port, {})[sensor.mavlink.instance] = name
    bauds = {sensor.mavlink.port: sensor.mavlink.baud for sensor in config.sensors.values() if sensor.mavlink}
    return {port: _mount(config, world, dict(sorted(imus.items())), bauds[port]) for port, imus in imus_by_port.items()}


def _mount(config: RigConfig, world: WorldSection, imus: dict[int, str], baud: int) -> InstrumentMount:
    """Return an autopilot with the configured sensors `imus`, by the numbers of its IMUs.

    An IMU of the autopilot that is not among them moves as the first of them.
    """
    sections = (world.sensors[name].autopilot for name in config.sensors if name in imus.values())
    section = next((section for section in sections if section is not None), SimulatedAutopilotSection())
    try:
        parameters = Parameters(section.firmware, max(imus) + 1, section.parameters, section.parameter_file)
    except ValueError as error:
        raise Refused(
            "autopilot_parameters", f"world.sensors.{imus[min(imus)]}.autopilot.parameters: {error}",
            "Give parameters that its firmware has",
        ) from None  # fmt: skip

    def build_imu(index: int, motion_of: MotionOf, time_s: float) -> SimulatedImu:
        name = imus.get(index, next(iter(imus.values())))
        # It has an accelerometer whether the rig reads it or not.
        truth = SensorTruth(config.sensors[name], world.sensors[name], time_s, accelerometer=True)
        seed = sensor_seed(world, name, *(() if index in imus else (index,)))
        px4, faulty = section.firmware == "px4", world.sensors[name].faulty
        return SimulatedImu(index, truth, motion_of(truth), parameters, px4=px4, seed=seed, faulty=faulty)

    def build(motion_of: MotionOf, _field_of: FieldOf, time_s: float) -> SimulatedAutopilot:
        autopilot = SimulatedAutopilot(
            section.firmware,
            [build_imu(index, motion_of, time_s) for index in range(max(imus) + 1)],
            parameters,
            baud=section.baud or baud,
            uid=section.uid,
            clock_ppm=section.clock_ppm,
            uptime_s=section.uptime_s,
            armed=section.armed,
            provides_temperature=section.provides_temperature,
            mavlink_version=section.mavlink_version,
            seed=world.seed,
            time_s=time_s,
        )
        faults = autopilot.faults
        faults.lost, faults.doubled, faults.slowest = section.lost, section.doubled, section.slowest
        return autopilot

    return InstrumentMount("autopilot", build, section.pty, stolen=section.stolen)
