"""The speed of the emulated board: `python benchmarks/laboratory/emulator.py [virtual seconds]`."""

import sys
import time
from pathlib import Path

from firmware_host.emulator.chip.flash_memory import FlashMemory
from firmware_host.emulator.machine import EmulatedBoard
from firmware_host.emulator.parts.accelerometer import AccelerometerTruth
from firmware_host.emulator.parts.adis16465 import Adis16465
from firmware_host.emulator.parts.gyroscope import GyroTruth
from firmware_host.emulator.parts.lsm9ds1 import Lsm9ds1
from firmware_host.emulator.parts.mpu9250 import Mpu9250
from firmware_host.frames import FrameReader, encode

IMAGE = Path(__file__).parents[2] / "firmware_host" / "firmware" / "image"
TICK_S = 0.002


PARTS = (Lsm9ds1, Mpu9250, Adis16465)  # in the order of the board's sensor table
RANGES_DEG_S = (245.0, 250.0, 500.0)
RANGES_G = (2.0, 2.0, 8.0)
ALL_HZ = (238.0, 200.0, 200.0)
# One data rate for each sensor, and whether accelerations come with the turn rates
RUNS = (
    *((rates_hz, False) for rates_hz in ((), (119.0,), (238.0,), (476.0,), (952.0,), ALL_HZ)),
    (ALL_HZ, True),  # configs/imu.yaml has half these rates
)


def main(duration_s: float) -> None:
    """Print how many times as fast as real time the emulated board runs, for each set of parts."""
    for rates_hz, accelerating in RUNS:
        truth, acceleration = GyroTruth(noise_rad_s=0.035), AccelerometerTruth(noise_m_s2=0.03)
        board = EmulatedBoard(
            flash=FlashMemory((IMAGE / "rig_l432.bin").read_bytes()),
            elf=(IMAGE / "rig_l432.elf").read_bytes(),
            devices=[
                part(
                    lambda _time_s: (0.1, 0.2, 0.3, 0.0, 0.0, 1.0),
                    truth,
                    acceleration=acceleration,
                    temperature_c=22.0,
                    seed=1,
                )
                for part in PARTS[: len(rates_hz)]
            ],
            unique_id=bytes(12),
            crystal_ppm=35.0,
            boot_time_s=0.0,
        )
        board.advance(0.1)
        for sensor, rate_hz in enumerate(rates_hz):
            settings = {"sensor": sensor, "rate_hz": rate_hz, "range_deg_s": RANGES_DEG_S[sensor]}
            settings |= {"range_g": RANGES_G[sensor] if accelerating else 0, "range_gauss": 0}
            board.receive(encode("configure", 1, settings))
        board.receive(encode("start", 2, {"sensors": 0}))
        board.advance(0.2)
        reader, samples = FrameReader(), 0
        reader.feed(board.take_sent())
        start_s, start_cpu_s = time.perf_counter(), time.process_time()
        for step in range(1, round(duration_s / TICK_S) + 1):
            board.advance(0.2 + step * TICK_S)
            frames = reader.feed(board.take_sent())
            samples += sum(len(frame.items) for frame in frames if frame.name in ("samples", "imu_samples"))
        elapsed_s, cpu_s = time.perf_counter() - start_s, time.process_time() - start_cpu_s
        rates = " + ".join(f"{rate_hz:g}" for rate_hz in rates_hz) or "no"
        print(
            f"{rates} Hz{' with accelerations' if accelerating else ''}: {duration_s / elapsed_s:.1f} times real "
            f"time, {duration_s / cpu_s:.1f} with a core to itself, {samples} samples in {duration_s:g} s"
        )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0)
