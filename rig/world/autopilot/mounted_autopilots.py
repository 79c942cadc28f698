"""The autopilots of the laboratory: their parameters, and their IMUs on the flange."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rig.config.models import RigConfig
from rig.config.world.autopilot import SimulatedAutopilotSection
from rig.config.world.laboratory import WorldSection
from rig.errors import Refused
from rig.world.autopilot.autopilot import SimulatedAutopilot
from rig.world.autopilot.autopilot_imu import SimulatedImu
from rig.world.autopilot.parameters import Parameters
from rig.world.board.sensor_truth import SensorTruth
from rig.world.instruments import FieldOf, MotionOf


@dataclass(slots=True)
class AutopilotMount:
    """The socket of one autopilot, with the state that it keeps without power.

    `imus`: sensor names by IMU number. An IMU without a sensor, between others, has the first one's motion.
    """

    kind: ClassVar[str] = "autopilot"
    bit_error_rate: ClassVar[float] = 0.0
    config: RigConfig
    world: WorldSection
    imus: dict[int, str]
    section: SimulatedAutopilotSection
    configured_baud: int
    parameters: Parameters
    instrument: SimulatedAutopilot | None = None

    @property
    def pty(self) -> bool:
        """Whether it also has a pseudo-terminal."""
        return self.section.pty

    @property
    def stolen(self) -> float:
        """The fraction of its bytes that another program reads."""
        return self.section.stolen

    def switch_on(self, motion_of: MotionOf, field_of: FieldOf, time_s: float) -> None:
        """Switch the autopilot on at the virtual time `time_s`, unless it is on."""
        if self.instrument is not None:
            return
        section = self.section
        autopilot = SimulatedAutopilot(
            section.firmware,
            [self._imu(index, motion_of, time_s) for index in range(max(self.imus) + 1)],
            self.parameters,
            baud=section.baud or self.configured_baud,
            uid=section.uid,
            clock_ppm=section.clock_ppm,
            uptime_s=section.uptime_s,
            armed=section.armed,
            provides_temperature=section.provides_temperature,
            mavlink_version=section.mavlink_version,
            seed=self.world.seed,
            time_s=time_s,
        )
        faults = autopilot.faults
        faults.lost, faults.doubled, faults.slowest = section.lost, section.doubled, section.slowest
        self.instrument = autopilot

    def switch_off(self) -> None:
        """Switch the autopilot off."""
        self.instrument = None

    def _imu(self, index: int, motion_of: MotionOf, time_s: float) -> SimulatedImu:
        name = self.imus.get(index, next(iter(self.imus.values())))
        # It has an accelerometer whether the rig reads it or not.
        truth = SensorTruth(self.config.sensors[name], self.world.sensors[name], time_s, accelerometer=True)
        extra_entropy = [] if index in self.imus else [index]
        seed = np.random.SeedSequence([self.world.seed, sorted(self.world.sensors).index(name), *extra_entropy])
        px4 = self.section.firmware == "px4"
        faulty = self.world.sensors[name].faulty
        return SimulatedImu(index, truth, motion_of(truth), self.parameters, px4=px4, seed=seed, faulty=faulty)


def build_autopilot_mounts(config: RigConfig, world: WorldSection) -> dict[str, AutopilotMount]:
    """Return the autopilots by port. Raise `Refused` `autopilot_parameters` for a parameter that one does not have."""
    imus_by_port: dict[str, dict[int, str]] = {}
    for name, sensor in config.sensors.items():
        if sensor.mavlink is not None:
            imus_by_port.setdefault(sensor.mavlink.port, {})[sensor.mavlink.instance] = name
    bauds = {sensor.mavlink.port: sensor.mavlink.baud for sensor in config.sensors.values() if sensor.mavlink}
    mounts = {}
    for port, imus in imus_by_port.items():
        sections = (world.sensors[name].autopilot for name in config.sensors if name in imus.values())
        section = next((section for section in sections if section is not None), SimulatedAutopilotSection())
        try:
            file = section.parameter_file
            parameters = Parameters(section.firmware, max(imus) + 1, section.parameters, file)
        except ValueError as error:
            raise Refused(
                "autopilot_parameters", f"world.sensors.{imus[min(imus)]}.autopilot.parameters: {error}",
                "Give parameters that its firmware has",
            ) from None  # fmt: skip
        mounts[port] = AutopilotMount(config, world, dict(sorted(imus.items())), section, bauds[port], parameters)
    return mounts
