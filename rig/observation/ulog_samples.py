"""Readings from PX4's log (`.ulg`), by `pyulog`: of the sensors as they are, before the autopilot corrects them.

`sensor_gyro` and `sensor_accel` of one instance each, in rad/s and m/s²; `timestamp_sample` is the autopilot's time of
the sample in µs. An accelerometer that samples at other times is interpolated to the gyroscope's: both come from one
part as a rule, and then the times are the same.
"""

from pathlib import Path
from typing import Any

import numpy as np

from rig.data.motion_file import TIME
from rig.data.quantity import ACCELERATION, RATE, Quantity
from rig.errors import Refused
from rig.errors.extras import missing_extra
from rig.estimation.arrays import Array

SUFFIX = ".ulg"
TOPICS: dict[str, Quantity] = {"sensor_gyro": RATE, "sensor_accel": ACCELERATION}
MICRO = 1e-6


def is_ulog(path: Path) -> bool:
    """Whether a path is such a log."""
    return path.suffix == SUFFIX


def ulog_readings(path: Path, inside: str | None = None) -> dict[str, Array]:
    """The columns (n,) of readings in a log, as those of a CSV file, of the sensors whose instance stands `inside`.

    Raises Refused `no_file`, `missing_extra`, `ulog_topic`.
    """
    try:
        from pyulog import ULog
    except ImportError as error:
        raise missing_extra(error, "ulog") from error
    if not path.is_file():
        raise Refused("no_file", f"{path} is no file", "Name PX4's log, a file .ulg")
    try:
        with path.open("rb") as file:
            log = ULog(file, list(TOPICS))
    except Exception as error:  # of a damaged file it raises whatever its parser ends in
        raise Refused("no_file", f"{path} is no log that can be read: {error}", "Copy it anew from the card") from error
    there = {(each.name, each.multi_id): each.data for each in log.data_list}
    number = inside or "0"
    if not number.isdecimal() or ("sensor_gyro", int(number)) not in there:
        known = ", ".join(f"{name} {instance}" for name, instance in sorted(there)) or "neither"
        raise Refused(
            "ulog_topic",
            f"{path} holds no sensor_gyro {number}; of sensor_gyro and sensor_accel it holds {known}",
            "Let SDLOG_PROFILE log the sensors at full rate, or name another instance behind the file: LOG.ulg::1",
        )
    instance = int(number)
    gyroscope = there["sensor_gyro", instance]
    time_us, rates = _sampled(gyroscope)
    columns = {TIME: (time_us - time_us[0]) * MICRO, **dict(zip(RATE.columns, rates.T, strict=True))}
    if ("sensor_accel", instance) in there:
        other_us, forces = _sampled(there["sensor_accel", instance])
        felt = [np.interp(time_us, other_us, each) for each in forces.T]
        columns |= dict(zip(ACCELERATION.columns, felt, strict=True))
    return columns


def _sampled(data: Any) -> tuple[Array, Array]:
    """Times (n,) in µs, increasing, and readings (n, 3)."""
    time_us = np.asarray(data["timestamp_sample" if "timestamp_sample" in data else "timestamp"], dtype=np.int64)
    readings = np.column_stack([np.asarray(data[axis], dtype=np.float64) for axis in "xyz"])
    order = np.unique(time_us, return_index=True)[1]
    return time_us[order].astype(np.float64), readings[order]
