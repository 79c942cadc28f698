"""A small log as PX4 writes it: the ULog file format, version 1 (docs.px4.io, "ULog File Format")."""

from pathlib import Path
from struct import pack

import numpy as np

FORMATS = {name: f"{name}:uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float x;float y;float z;"
           "float temperature;uint8_t[4] _padding0;" for name in ("sensor_gyro", "sensor_accel")}  # fmt: skip


COMBINED = (
    "sensor_combined:uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;"
    "int32_t accelerometer_timestamp_relative;float[3] accelerometer_m_s2;uint32_t accelerometer_integral_dt;"
)


def write_ulog(
    path: Path,
    time_us: np.ndarray,
    rates: np.ndarray,
    forces: np.ndarray,
    raw_every: int = 1,
    *,
    rates_at: np.ndarray | None = None,
    forces_at: np.ndarray | None = None,
    devices: np.ndarray | None = None,
    sampled_us: int | None = None,
) -> None:
    """Write a log of one IMU, with readings (n, 3) rad/s and m/s² at times (n,) in µs.

    With `raw_every` > 1 the raw topics hold every `raw_every`-th reading, and `sensor_combined` all. `rates_at` and
    `forces_at` are the rows that each sensor has, all by default; `devices` (n,) the sensors' identities; `sampled_us`
    stands for the time of every sample in the raw topics.
    """
    rows_of = [None if at is None else {*at.tolist()} for at in (rates_at, forces_at)]
    with path.open("wb") as file:
        file.write(b"ULog\x01\x12\x35\x01" + pack("<Q", int(time_us[0])))

        def message(kind: bytes, body: bytes) -> None:
            file.write(pack("<HB", len(body), kind[0]) + body)

        message(b"B", bytes(40))
        for form in FORMATS.values():
            message(b"F", form.encode())
        message(b"F", COMBINED.encode())
        if raw_every > 1:
            message(b"A", pack("<BH", 0, len(FORMATS)) + b"sensor_combined")
        for number, name in enumerate(FORMATS):
            if rows_of[number] != set():
                message(b"A", pack("<BH", 0, number) + name.encode())
        for row, (stamp_us, rate, force) in enumerate(
            zip(time_us.tolist(), rates.tolist(), forces.tolist(), strict=True)
        ):
            if raw_every > 1:
                message(b"D", pack("<HQ3fIi3fI", len(FORMATS), stamp_us, *rate, 5000, 0, *force, 5000))
            if row % raw_every:
                continue
            device = 1234 if devices is None else int(devices[row])
            for number, reading in enumerate((rate, force)):
                of_sample_us = stamp_us if sampled_us is None else sampled_us
                if (rows := rows_of[number]) is None or row in rows:
                    message(b"D", pack("<HQQI4f", number, stamp_us + 300, of_sample_us, device, *reading, 25.0))
