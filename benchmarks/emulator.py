"""How fast the emulated board runs: `python benchmarks/emulator.py [virtual seconds]`."""

import sys
import time
from pathlib import Path

from firmware_host.emulator.flash_memory import FlashMemory
from firmware_host.emulator.gyroscope import GyroTruth
from firmware_host.emulator.lsm9ds1 import Lsm9ds1
from firmware_host.emulator.machine import EmulatedBoard
from firmware_host.protocol import FrameReader, encode

IMAGE = Path(__file__).parents[1] / "firmware_host" / "firmware" / "image"
TICK_S = 0.002


def main(duration_s: float) -> None:
    for rate_hz in (0.0, 119.0, 238.0, 476.0, 952.0):
        gyro = Lsm9ds1(lambda _time_s: (0.1, 0.2, 0.3), GyroTruth(noise_rad_s=0.035), temperature_c=22.0, seed=1)
        board = EmulatedBoard(
            flash=FlashMemory((IMAGE / "rig_l432.bin").read_bytes()),
            elf=(IMAGE / "rig_l432.elf").read_bytes(),
            devices=[gyro],
            unique_id=bytes(12),
            crystal_ppm=35.0,
            boot_time_s=0.0,
        )
        board.advance(0.1)
        if rate_hz:
            settings = {"sensor": 0, "rate_hz": rate_hz, "range_deg_s": 245.0}
            board.receive(encode("configure", 1, settings) + encode("start", 2, {"mode": 0}))
        board.advance(0.2)
        reader, samples = FrameReader(), 0
        reader.feed(board.transmitted())
        start = time.perf_counter()
        for step in range(1, round(duration_s / TICK_S) + 1):
            board.advance(0.2 + step * TICK_S)
            frames = reader.feed(board.transmitted())
            samples += sum(len(frame.items) for frame in frames if frame.name == "samples")
        elapsed_s = time.perf_counter() - start
        print(f"{rate_hz:5g} Hz: {duration_s / elapsed_s:5.1f} times real time, {samples} samples in {duration_s:g} s")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0)
