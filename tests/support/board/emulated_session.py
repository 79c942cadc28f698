"""The product's image on an emulated board, addressed over its serial line at virtual times."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from firmware_host.emulator.chip.flash_memory import FlashMemory
from firmware_host.emulator.chip.spi_device import SpiDevice
from firmware_host.emulator.machine import EmulatedBoard
from firmware_host.emulator.parts.accelerometer import AccelerometerTruth
from firmware_host.emulator.parts.gyroscope import GyroTruth, Temperature
from firmware_host.emulator.parts.magnetometer import MagnetometerTruth
from firmware_host.frames import Frame, FrameReader, encode
from firmware_host.parts import BOARD_PARTS, GYROSCOPES, MAGNETOMETERS
from rig.config.sensors import sensor_catalogue
from support.paths import IMAGE

CRYSTAL_PPM = 35.0
UNIQUE_ID = bytes(range(12))
FIRST_RECORD = 0x3D000  # in the flash: the first sensor's pages have been there since firmware 0.1


FIELD_T = (20e-6, -5e-6, 43e-6)
MAGNETIC = MagnetometerTruth((1.02, 0.97, 1.01), (12e-6, -30e-6, 8e-6))


def magnetometer(motion_at: Callable[[float], Sequence[float]], *_truth: Any, seed: int, **_others: Any) -> SpiDevice:
    """Return a magnetometer in a constant field; its conversions are counted like those of the gyroscopes."""

    def field_at(time_s: float) -> Sequence[float]:
        motion_at(time_s)
        return FIELD_T

    return MAGNETOMETERS["lsm9ds1_magnetometer"].register_model(field_at, MAGNETIC, seed=seed)


# The gyroscopes, in the order of the board's sensor table
PARTS: dict[str, Callable[..., SpiDevice]] = {name: part.register_model for name, part in GYROSCOPES.items()}
OTHER_PARTS = {"lsm9ds1_magnetometer": magnetometer}
RANGE_G = 8.0  # which every part has
RATES_AND_RANGES = {
    name: (usual.default_rate_hz, usual.default_range_deg_s)
    for name, usual in sensor_catalogue.PARTS.items()
    if name in GYROSCOPES
}
TRUTH = GyroTruth((1.1771, 1.1554, 1.1440), (0.0077, -0.0100, -0.0051))
ACCELERATION = AccelerometerTruth((1.02, 0.99, 1.01), (0.2, -0.1, 0.3))


def make_shipped_flash() -> FlashMemory:
    """Return a flash with the shipped program."""
    return FlashMemory((IMAGE / "rig_l432.bin").read_bytes())


class Session:
    """A board with the sensors `parts`, and every frame it has sent. Virtual time passes in steps of `tick_s`.

    `sensors`: the simulated parts by name, whose faults can be set; `readings`: the number of conversions of each.
    `flash`: that of another session, after a power cut.
    """

    def __init__(
        self,
        *,
        parts: Sequence[str] = ("lsm9ds1",),
        flash: FlashMemory | None = None,
        rate_at: Callable[[float], Sequence[float]] = lambda _time_s: (0.1, -0.2, 1.0),
        noise_rad_s: float = 0.035,
        seed: int = 1,
        tick_s: float = 0.002,
        boot_time_s: float = 0.137,
        temperature_c: float | Temperature = 22.0,
    ) -> None:
        """Power up a board; a count is kept of the readings of each part."""
        truth = replace(TRUTH, noise_rad_s=noise_rad_s)
        self.readings = dict.fromkeys(parts, 0)
        self.sensors: dict[str, SpiDevice] = {
            part: (PARTS | OTHER_PARTS)[part](
                self._counted(part, rate_at), truth, acceleration=ACCELERATION, temperature_c=temperature_c, seed=seed
            )
            for part in parts
        }
        self.flash = flash or make_shipped_flash()
        self.board = EmulatedBoard(
            flash=self.flash,
            elf=(IMAGE / "rig_l432.elf").read_bytes(),
            devices=list(self.sensors.values()),
            unique_id=UNIQUE_ID,
            crystal_ppm=CRYSTAL_PPM,
            boot_time_s=boot_time_s,
        )
        self.sent = bytearray()  # all bytes from the board
        self.time_s = 0.0
        self._tick_s = tick_s
        self.reader = FrameReader()
        self._frames: list[Frame] = []
        self._asked = 0  # number of the latest request

    def _counted(self, part: str, rate_at: Callable[[float], Sequence[float]]) -> Callable[[float], Sequence[float]]:
        def counted_rate_at(time_s: float) -> Sequence[float]:
            self.readings[part] += 1
            return rate_at(time_s)

        return counted_rate_at

    def run(self, duration_s: float) -> list[Frame]:
        """Let time pass; return the frames that arrived meanwhile."""
        for _ in range(round(duration_s / self._tick_s)):
            self.time_s += self._tick_s
            self.board.advance(self.time_s)
            data = self.board.take_sent()
            self.sent += data
            self._frames += self.reader.feed(data)
        assert self.reader.damaged == 0
        frames = self._frames
        self._frames = []
        return frames

    def ask(self, name: str, **values: Any) -> Frame:
        """Send a request; return its answer, which must come within 50 ms."""
        self._asked = self._asked % 255 + 1
        self.board.receive(encode(name, self._asked, values))
        (answer,) = [frame for frame in self.run(0.05) if frame.values.get("reply_to") == self._asked]
        return answer

    def configure(
        self, part: str, rate_hz: float | None = None, range_deg_s: float | None = None, range_g: float = 0.0
    ) -> Frame:
        """Set a part up, by default at its usual rate and range, without accelerations. Return the board's `setup`."""
        usual_rate_hz, usual_range_deg_s = RATES_AND_RANGES[part]
        setup = self.ask(
            "configure",
            sensor=list(PARTS).index(part),
            rate_hz=rate_hz or usual_rate_hz,
            range_deg_s=range_deg_s or usual_range_deg_s,
            range_g=range_g,
            range_gauss=0.0,
        )
        assert setup.name == "setup", setup
        return setup

    def configure_magnetometer(self, rate_hz: float = 80.0, range_gauss: float = 4.0) -> Frame:
        """Set the magnetometer up; return the board's `setup`."""
        ranges = {"range_deg_s": 0.0, "range_g": 0.0, "range_gauss": range_gauss}
        number = list(BOARD_PARTS).index("lsm9ds1_magnetometer")
        return self.ask("configure", sensor=number, rate_hz=rate_hz, **ranges)

    def stream(self, duration_s: float, rate_hz: float = 238.0, range_deg_s: float = 245.0) -> np.ndarray:
        """Configure and start the LSM9DS1, then run. Return its samples as `samples` does."""
        self.configure("lsm9ds1", rate_hz, range_deg_s)
        self.board.receive(encode("start", 78, {"sensors": 0}))
        return samples(self.run(duration_s))


def samples(frames: Sequence[Frame], sensor: int = 0) -> np.ndarray:
    """Return one sensor's samples (n,) in `frames`: time_us, counts (3,), acceleration (3,), temperature, sequence.

    Accelerations that were not sent are zeros.
    """
    dtype = [
        ("time_us", "u8"),
        ("counts", "i2", 3),
        ("acceleration", "i2", 3),
        ("temperature", "i2"),
        ("sequence", "u4"),
    ]
    parts = [np.empty(0, dtype)]
    for frame in frames:
        if frame.name in ("samples", "imu_samples") and frame.values["sensor"] == sensor:
            part = np.zeros(len(frame.items), dtype)
            part["time_us"] = frame.values["base_time_us"] + frame.items["delta_us"].astype("u8")
            part["counts"] = frame.items["counts"]
            if frame.name == "imu_samples":
                part["acceleration"] = frame.items["acceleration"]
            part["temperature"] = frame.items["temperature_counts"]
            part["sequence"] = frame.values["sequence"] + np.arange(len(frame.items))
            parts.append(part)
    return np.concatenate(parts)
