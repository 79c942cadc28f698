"""A small log as PX4 writes it: the ULog file format, version 1 (docs.px4.io, "ULog File Format")."""

from pathlib import Path
from struct import pack

import numpy as np

FORMATS = {name: f"{name}:uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float x;float y;float z;"
           "float temperature;uint8_t[4] _padding0;" for name in ("sensor_gyro", "sensor_accel")}  # fmt: skip


def write_ulog(path: Path, time_us: np.ndarray, rates: np.ndarray, forces: np.ndarray) -> None:
    """A log of one IMU, its readings (n, 3) rad/s and m/s² at times (n,) in µs."""
    with path.open("wb") as file:
        file.write(b"ULog\x01\x12\x35\x01" + pack("<Q", int(time_us[0])))

        def message(kind: bytes, body: bytes) -> None:
            file.write(pack("<HB", len(body), kind[0]) + body)

        message(b"B", bytes(40))
        for form in FORMATS.values():
            message(b"F", form.encode())
        for number, name in enumerate(FORMATS):
            message(b"A", pack("<BH", 0, number) + name.encode())
        for at, rate, force in zip(time_us.tolist(), rates.tolist(), forces.tolist(), strict=True):
            for number, reading in enumerate((rate, force)):
                message(b"D", pack("<HQQI4f", number, at + 300, at, 1234, *reading, 25.0))
