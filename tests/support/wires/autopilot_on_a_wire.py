"""A simulated autopilot on a pseudo-terminal, without a laboratory around it, with a given motion."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np

from rig.config.sensors.sensor_sections import SensorSection
from rig.config.world.laboratory import SimulatedAccelerometerSection, SimulatedSensorSection
from rig.world.autopilot.autopilot import SimulatedAutopilot
from rig.world.autopilot.autopilot_imu import SimulatedImu
from rig.world.autopilot.parameters import Parameters
from rig.world.board.sensor_truth import SensorTruth
from support.wires.device_on_a_wire import DeviceOnAWire

UID = "0a0b0c0d0e0f"
TICK_S = 0.0025
STILL = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
BIAS_RAD_S = (0.02, -0.03, 0.05)
PERFECT = SimulatedSensorSection(
    scale=(1, 1, 1),
    bias_rad_s=BIAS_RAD_S,
    noise_rad_s=1e-5,
    accelerometer=SimulatedAccelerometerSection(noise_m_s2=1e-4),
)


def section(port: str, imu: str = "HIGHRES_IMU", **changes: Any) -> SensorSection:
    """Return the section of an IMU of the autopilot at `port`."""
    line = {"port": port, "baud": changes.pop("baud", 921600), "imu": imu, "uid": changes.pop("uid", None)}
    line["temperature"] = changes.pop("temperature", None)
    sensor = {"part": "mavlink", "serial_number": "FC-1", "mavlink": line, "acceleration": {"range_g": 16}, **changes}
    return SensorSection.model_validate(sensor)


class AutopilotOnAWire:
    """The autopilot, at most `pace` times as fast as real time."""

    def __init__(
        self,
        firmware: Literal["ardupilot", "px4"],
        stored_parameters: Mapping[str, float],
        motion_at: Callable[[float], Sequence[float]],
        *,
        imus: int = 1,
        pace: float = 4.0,
        uptime_s: float = 5.0,
        file: Path | None = None,
        dead: bool = False,
        armed: bool = False,
        simulated: SimulatedSensorSection = PERFECT,
        clock_ppm: float = 0.0,
        provides_temperature: bool = True,
        mavlink_version: int = 2,
    ) -> None:
        """Listen for a client; a `dead` autopilot never answers."""
        self.parameters = Parameters(firmware, imus, stored_parameters, file)
        self._firmware, self._motion_at, self._imus = firmware, motion_at, imus
        self._on_for_s, self._armed = uptime_s, armed
        self._simulated, self._clock_ppm = simulated, clock_ppm
        self._provides_temperature, self._mavlink_version = provides_temperature, mavlink_version
        self.autopilot: SimulatedAutopilot | None = None
        self.wire = DeviceOnAWire(lambda: self.autopilot, TICK_S, pace, dead=dead)
        self.line, self.port = self.wire.line, self.wire.port
        self.switch_on()
        self.wire.live(self._advance)

    @property
    def time_s(self) -> float:
        return self.wire.time_s

    def switch_on(self) -> None:
        truth = SensorTruth(section("/dev/ttyUSB0"), self._simulated)
        px4 = self._firmware == "px4"
        imus = [
            SimulatedImu(index, truth, self._motion_at, self.parameters, px4=px4, seed=np.random.SeedSequence(index))
            for index in range(self._imus)
        ]
        self.autopilot = SimulatedAutopilot(
            self._firmware,
            imus,
            self.parameters,
            baud=921600,
            uid=UID,
            clock_ppm=self._clock_ppm,
            uptime_s=self._on_for_s,
            armed=self._armed,
            provides_temperature=self._provides_temperature,
            mavlink_version=self._mavlink_version,
            seed=3,
            time_s=self.time_s,
        )

    def switch_off(self) -> None:
        self.autopilot = None

    @property
    def faults(self) -> Any:
        assert self.autopilot is not None
        return self.autopilot.faults

    def close(self) -> None:
        self.wire.close()

    def _advance(self, time_s: float) -> None:
        if (alive := self.autopilot) is not None:
            alive.advance(time_s)


@contextmanager
def autopilot_on_a_wire(
    firmware: Literal["ardupilot", "px4"] = "ardupilot",
    stored_parameters: Mapping[str, float] | None = None,
    motion_at: Callable[[float], Sequence[float]] = lambda time_s: STILL,
    **of_it: Any,
) -> Iterator[AutopilotOnAWire]:
    """Run the autopilot during the `with` block."""
    wire = AutopilotOnAWire(firmware, stored_parameters or {}, motion_at, **of_it)
    try:
        yield wire
    finally:
        wire.close()
