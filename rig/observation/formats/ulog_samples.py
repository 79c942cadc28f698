"""Readings from PX4's log (`.ulg`), by `pyulog`: those of the sensors, before the autopilot corrects them.

`sensor_gyro` and `sensor_accel` of one instance each, in rad/s and m/s²; `timestamp_sample` is the autopilot's time of
the sample in µs. An accelerometer that samples at other times is interpolated to the gyroscope's: both usually belong
to one part, and then the times are the same. The reader runs in a process of its own
(`rig.observation.formats.sample_files`).
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rig.data.processes.reading_process import Part
from rig.data.quantity import ACCELERATION, RATE, Quantity
from rig.data.recording.motion_file import TIME
from rig.errors import Refused
from rig.errors.extras import missing_extra
from rig.errors.quoting import listing, shorten
from rig.estimation.arrays import Array

SUFFIX = ".ulg"
TOPICS: dict[str, Quantity] = {"sensor_gyro": RATE, "sensor_accel": ACCELERATION}
MICRO = 1e-6


def is_ulog(path: Path) -> bool:
    """Return whether a path is such a log."""
    return path.suffix == SUFFIX


def ulog_readings(path: Path, inside: str | None = None) -> Iterator[Part]:
    """Yield, in blocks, the readings in a log of the sensors of the instance `inside`.

    Raise Refused `missing_extra` or `ulog_topic`, and for a damaged log whatever its parser raises.
    """
    try:
        from pyulog import ULog
    except ImportError as error:
        raise missing_extra(error, "ulog") from error
    with path.open("rb") as file:
        log = ULog(file, list(TOPICS))
    topics = {(topic.name, topic.multi_id): topic.data for topic in log.data_list}
    number = inside or "0"
    if not number.isdecimal() or ("sensor_gyro", int(number)) not in topics:
        instances = listing(f"{name} {instance}" for name, instance in sorted(topics))
        raise Refused(
            "ulog_topic",
            f"{path} holds no sensor_gyro {shorten(number)}; of sensor_gyro and sensor_accel it holds {instances}",
            "Let SDLOG_PROFILE log the sensors at full rate, or name another instance behind the file: LOG.ulg::1",
        )
    instance = int(number)
    time_us, rates = _read_topic("sensor_gyro", topics["sensor_gyro", instance])
    columns = {TIME: (time_us - time_us[0]) * MICRO, **dict(zip(RATE.columns, rates.T, strict=True))}
    if ("sensor_accel", instance) in topics:
        other_us, forces = _read_topic("sensor_accel", topics["sensor_accel", instance])
        accelerations = [np.interp(time_us, other_us, topic) for topic in forces.T]
        columns |= dict(zip(ACCELERATION.columns, accelerations, strict=True))
    yield np.column_stack(list(columns.values()))
    yield {"columns": list(columns)}


def _read_topic(topic: str, data: Any) -> tuple[Array, Array]:
    """Return times (n,) in µs, increasing, and readings (n, 3). Raise ValueError if the topic has other fields."""
    stamp = "timestamp_sample" if "timestamp_sample" in data else "timestamp"
    if missing := [name for name in (stamp, *"xyz") if name not in data]:
        raise ValueError(f"its {topic} has no {' and no '.join(missing)}")
    time_us = np.asarray(data[stamp], dtype=np.int64)
    readings = np.column_stack([np.asarray(data[axis], dtype=np.float64) for axis in "xyz"])
    order = np.unique(time_us, return_index=True)[1]
    return time_us[order].astype(np.float64), readings[order]
