"""The product's image on an emulated board, spoken to over its serial line at virtual times."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from firmware_host.emulator.gyroscope import GyroTruth
from firmware_host.emulator.lsm9ds1 import Lsm9ds1
from firmware_host.emulator.machine import EmulatedBoard
from firmware_host.protocol import Frame, FrameReader, encode

IMAGE = Path(__file__).parents[1] / "firmware_host" / "firmware" / "image"
CRYSTAL_PPM = 35.0
UNIQUE_ID = bytes(range(12))


class Session:
    """A board, its one gyroscope, and every frame it has sent. The virtual clock moves by `tick_s` at a time."""

    def __init__(
        self,
        *,
        rate_at: Callable[[float], Sequence[float]] = lambda _time_s: (0.1, -0.2, 1.0),
        noise_rad_s: float = 0.035,
        seed: int = 1,
        tick_s: float = 0.002,
        boot_time_s: float = 0.137,
    ) -> None:
        truth = GyroTruth((1.1771, 1.1554, 1.1440), (0.0077, -0.0100, -0.0051), noise_rad_s)
        self.board = EmulatedBoard(
            image=(IMAGE / "rig_l432.bin").read_bytes(),
            elf=(IMAGE / "rig_l432.elf").read_bytes(),
            devices=[Lsm9ds1(rate_at, truth, temperature_c=22.0, seed=seed)],
            unique_id=UNIQUE_ID,
            crystal_ppm=CRYSTAL_PPM,
            boot_time_s=boot_time_s,
        )
        self.sent = b""  # all the board has said
        self.time_s = 0.0
        self._tick_s = tick_s
        self._reader = FrameReader()
        self._frames: list[Frame] = []

    def run(self, duration_s: float) -> list[Frame]:
        """Let time pass. Returns the frames that arrived in it."""
        for _ in range(round(duration_s / self._tick_s)):
            self.time_s += self._tick_s
            self.board.advance(self.time_s)
            data = self.board.transmitted()
            self.sent += data
            self._frames += self._reader.feed(data)
        assert self._reader.damaged == 0
        frames, self._frames = self._frames, []
        return frames

    def ask(self, name: str, **values: Any) -> Frame:
        """Send a request. Returns its answer, which comes within 50 ms."""
        self.board.receive(encode(name, 77, values))
        (answer,) = [frame for frame in self.run(0.05) if frame.values.get("reply_to") == 77]
        return answer

    def stream(self, duration_s: float, rate_hz: float = 238.0, range_deg_s: float = 245.0) -> np.ndarray:
        """Configure and start the gyroscope, then run. Returns what `samples` does."""
        assert self.ask("configure", sensor=0, rate_hz=rate_hz, range_deg_s=range_deg_s).name == "setup"
        self.board.receive(encode("start", 78, {"sensors": 0}))
        return samples(self.run(duration_s))


def samples(frames: Sequence[Frame]) -> np.ndarray:
    """The samples in `frames`, (n,) records: time_us, counts (3,), temperature, sequence."""
    dtype = [("time_us", "u8"), ("counts", "i2", 3), ("temperature", "i2"), ("sequence", "u4")]
    parts = [np.empty(0, dtype)]
    for frame in frames:
        if frame.name == "samples":
            part = np.empty(len(frame.items), dtype)
            part["time_us"] = frame.values["base_time_us"] + frame.items["delta_us"].astype("u8")
            part["counts"] = frame.items["counts"]
            part["temperature"] = frame.items["temperature_counts"]
            part["sequence"] = frame.values["sequence"] + np.arange(len(frame.items))
            parts.append(part)
    return np.concatenate(parts)
