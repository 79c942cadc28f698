"""The KVH 1775s of the simulated laboratory: their memories, and the instruments on the flange that use them."""

from rig.config.models import RigConfig
from rig.config.world.laboratory import SimulatedKvhSection, WorldSection
from rig.errors import Refused
from rig.world.board.sensor_truth import SensorTruth
from rig.world.instruments import FieldOf, InstrumentMount, MotionOf, mount_magnetometer, sensor_seed
from rig.world.kvh1775.instrument import SimulatedKvh1775
from rig.world.kvh1775.memory import KvhMemory


def build_kvh_mounts(config: RigConfig, world: WorldSection) -> dict[str, InstrumentMount]:
    """Return the instruments by sensor name. Raise Refused `kvh_settings` for an unknown setting."""
    names = sorted(name for name, sensor in config.sensors.items() if sensor.part == "kvh1775")
    return {name: _mount(config, world, name) for name in names}


def _mount(config: RigConfig, world: WorldSection, name: str) -> InstrumentMount:
    """Return the mount of one simulated KVH 1775. Raise Refused `kvh_settings`."""
    sensor, simulated = config.sensors[name], world.sensors[name]
    section = simulated.kvh1775 or SimulatedKvhSection()
    try:
        memory = KvhMemory(section.settings)
    except ValueError as error:
        raise Refused(
            "kvh_settings", f"world.sensors.{name}.kvh1775.settings: {error}", "Give settings of its commands"
        ) from None

    def build(motion_of: MotionOf, field_of: FieldOf, time_s: float) -> SimulatedKvh1775:
        # It sends accelerations whether the rig reads them or not.
        truth = SensorTruth(sensor, simulated, time_s, accelerometer=True)
        magnetometer = mount_magnetometer(config, world, name)
        return SimulatedKvh1775(
            truth,
            motion_of(truth),
            memory,
            field_at=field_of(magnetometer),
            magnetometer=magnetometer.truth,
            serial_number=section.serial_number or sensor.serial_number,
            oscillator_ppm=section.oscillator_ppm,
            uptime_s=section.uptime_s,
            seed=sensor_seed(world, name),
            time_s=time_s,
            faulty=simulated.faulty,
        )

    return InstrumentMount("kvh", build, pty=section.pty)
