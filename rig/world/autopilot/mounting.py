"""The autopilots of the laboratory: their parameters, and the IMUs on the flange that they read."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rig.config.models import RigConfig
from rig.config.world.autopilot import SimulatedAutopilotSection
from rig.config.world.laboratory import WorldSection
from rig.errors import Refused
from rig.world.autopilot.autopilot import SimulatedAutopilot
from rig.world.autopilot.imu import SimulatedImu
from rig.world.autopilot.parameters import Parameters
from rig.world.board.sensor_truth import SensorTruth
from rig.world.instruments import FieldOf, MotionOf


@dataclass(slots=True)
class AutopilotMount:
    """One autopilot's place: what stays there when it is switched off. `imus`: its IMU of each place, by sensor name.

    A place between that no sensor names has an IMU too, which reads what the first one does.
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
        """Whether a pseudo-terminal is wanted too."""
        return self.section.pty

    @property
    def stolen(self) -> float:
        """Share of what it sends that another program reads."""
        return self.section.stolen

    def switch_on(self, motion_of: MotionOf, field_of: FieldOf, time_s: float) -> None:
        """Give it power at the virtual time `time_s`, if it has none."""
        if self.instrument is not None:
            return
        section = self.section
        made = SimulatedAutopilot(
            section.firmware,
            [self._imu(place, motion_of, time_s) for place in range(max(self.imus) + 1)],
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
        made.faults.lost, made.faults.doubled, made.faults.slowest = section.lost, section.doubled, section.slowest
        self.instrument = made

    def switch_off(self) -> None:
        """Take its power away."""
        self.instrument = None

    def _imu(self, place: int, motion_of: MotionOf, time_s: float) -> SimulatedImu:
        name = self.imus.get(place, next(iter(self.imus.values())))
        # It has an accelerometer whether the rig reads it or not.
        truth = SensorTruth(self.config.sensors[name], self.world.sensors[name], time_s, accelerometer=True)
        of_another = [] if place in self.imus else [place]
        seed = np.random.SeedSequence([self.world.seed, sorted(self.world.sensors).index(name), *of_another])
        px4 = self.section.firmware == "px4"
        faulty = self.world.sensors[name].faulty
        return SimulatedImu(place, truth, motion_of(truth), self.parameters, px4=px4, seed=seed, faulty=faulty)


def build_autopilot_mounts(config: RigConfig, world: WorldSection) -> dict[str, AutopilotMount]:
    """Autopilots by port. Raises `Refused` `autopilot_parameters` for a parameter that one does not have."""
    at: dict[str, dict[int, str]] = {}
    for name, sensor in config.sensors.items():
        if sensor.mavlink is not None:
            at.setdefault(sensor.mavlink.port, {})[sensor.mavlink.instance] = name
    bauds = {sensor.mavlink.port: sensor.mavlink.baud for sensor in config.sensors.values() if sensor.mavlink}
    found = {}
    for port, imus in at.items():
        said = (world.sensors[name].autopilot for name in config.sensors if name in imus.values())
        section = next((each for each in said if each is not None), SimulatedAutopilotSection())
        try:
            kept = section.parameter_file
            parameters = Parameters(section.firmware, max(imus) + 1, section.parameters, kept)
        except ValueError as error:
            raise Refused(
                "autopilot_parameters", f"world.sensors.{imus[min(imus)]}.autopilot.parameters: {error}",
                "Give parameters that its firmware has",
            ) from None  # fmt: skip
        found[port] = AutopilotMount(config, world, dict(sorted(imus.items())), section, bauds[port], parameters)
    return found
