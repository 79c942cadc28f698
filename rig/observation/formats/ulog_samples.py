"""Readings from PX4's log (`.ulg`), by `pyulog`: the sensors' readings before the autopilot corrects them.

The readings are those of one instance of `sensor_gyro` and one of `sensor_accel`, in rad/s and m/s²; `timestamp_sample`
is the autopilot's time of the sample in µs. If gyroscope and accelerometer are separate chips, the accelerometer's
readings are interpolated to the gyroscope's times; if they are one chip, both have the same times.

PX4's default profile logs these topics once a second or not at all. Then `sensor_combined`, at about 200 Hz, is read,
with a note on its shortcomings. The reader runs in a process of its own (`rig.observation.formats.sample_files`).
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rig.data.processes.reading_parts import Part
from rig.data.quantity import ACCELERATION, RATE, Quantity
from rig.data.recording.motion_file import TIME
from rig.errors import Refused
from rig.errors.extras import missing_extra
from rig.errors.quoting import list_first, shorten
from rig.estimation.arrays import Array
from rig.observation.formats.table_parts import NOTE

SUFFIX = ".ulg"
TOPICS: dict[str, Quantity] = {"sensor_gyro": RATE, "sensor_accel": ACCELERATION}
COMBINED_TOPIC = "sensor_combined"
COMBINED_FIELDS = {RATE: "gyro_rad", ACCELERATION: "accelerometer_m_s2"}
MIN_RATE_RATIO = 0.5  # to `sensor_combined`: a raw topic with a lower rate lacks some of the readings
COMBINED_NOTE = (
    "sensor_combined of PX4: the selected sensor, which may change in flight, averaged, and corrected by the "
    "autopilot's own calibration (CAL_GYRO, CAL_ACC): the result is relative to that"
)
MICROSECOND_S = 1e-6


def is_ulog(path: Path) -> bool:
    """Return whether a path names a ULog file, by its suffix."""
    return path.suffix.lower() == SUFFIX


def ulog_readings(path: Path, inside: str | None = None) -> Iterator[Part]:
    """Yield, in blocks, a log's readings: those of the instance `inside` of each sensor, or those of `sensor_combined`.

    Raise Refused `missing_extra` or `ulog_topic`, and any error of the parser for a damaged log.
    """
    try:
        from pyulog.core import ULog
    except ImportError as error:
        raise missing_extra(error, "ulog") from error
    with path.open("rb") as file:
        log = ULog(file, [*TOPICS, COMBINED_TOPIC])
    topics = {(topic.name, topic.multi_id): topic.data for topic in log.data_list}
    if _is_combined(path, topics, inside):
        columns, note = _read_combined(topics[COMBINED_TOPIC, 0]), COMBINED_NOTE
    else:
        columns, note = _read_raw(topics, int(inside or "0")), ""
    yield np.column_stack(list(columns.values()))
    yield {"columns": list(columns), NOTE: note}


def _is_combined(path: Path, topics: Mapping[tuple[str, int], Any], inside: str | None) -> bool:
    """Return whether to read `sensor_combined`, because it is named, or because the raw topic is rare or missing.

    Raise Refused `ulog_topic` if the log does not hold the named topic.
    """
    rates_hz = {topic: _rate_hz(data) for topic, data in topics.items()}
    combined_hz = rates_hz.get((COMBINED_TOPIC, 0))
    number = inside or "0"
    raw_hz = rates_hz.get(("sensor_gyro", int(number))) if number.isdecimal() else None
    is_better = combined_hz is not None and (raw_hz is None or raw_hz < MIN_RATE_RATIO * combined_hz)
    if combined_hz is not None and (inside == COMBINED_TOPIC or (inside is None and is_better)):
        return True
    if raw_hz is None:
        logged = [f"{name} {instance} at {rate_hz:.3g} Hz" for (name, instance), rate_hz in sorted(rates_hz.items())]
        wanted = COMBINED_TOPIC if inside == COMBINED_TOPIC else f"sensor_gyro {shorten(number)}"
        raise Refused(
            "ulog_topic",
            f"{path} holds no {wanted}; of sensor_gyro, sensor_accel and sensor_combined it holds {list_first(logged)}",
            "Let SDLOG_PROFILE log the sensors at full rate, or name another instance after the file: LOG.ulg::1",
        )
    return False


def _rate_hz(data: Any) -> float:
    time_us = np.asarray(data["timestamp"], dtype=np.int64)
    span_us = int(time_us[-1] - time_us[0]) if len(time_us) else 0
    return float((len(time_us) - 1) / (span_us * MICROSECOND_S)) if span_us > 0 else 0.0


def _read_raw(topics: Mapping[tuple[str, int], Any], instance: int) -> dict[str, Array]:
    time_us, rates = _read_topic("sensor_gyro", topics["sensor_gyro", instance])
    columns = {TIME: (time_us - time_us[0]) * MICROSECOND_S, **dict(zip(RATE.columns, rates.T, strict=True))}
    if ("sensor_accel", instance) in topics:
        other_us, forces = _read_topic("sensor_accel", topics["sensor_accel", instance])
        accelerations = [np.interp(time_us, other_us, topic) for topic in forces.T]
        columns |= dict(zip(ACCELERATION.columns, accelerations, strict=True))
    return columns


def _read_combined(data: Any) -> dict[str, Array]:
    """Return the columns of `sensor_combined`. Raise ValueError if it lacks a field."""
    fields = [f"{field}[{axis}]" for field in COMBINED_FIELDS.values() for axis in range(3)]
    time_us, readings = _read_topic(COMBINED_TOPIC, data, fields)
    names = [name for quantity in COMBINED_FIELDS for name in quantity.columns]
    return {TIME: (time_us - time_us[0]) * MICROSECOND_S, **dict(zip(names, readings.T, strict=True))}


def _read_topic(topic: str, data: Any, fields: Sequence[str] = tuple("xyz")) -> tuple[Array, Array]:
    """Return times (n,) in µs, increasing, and readings (n, k). Raise ValueError if the topic lacks a field."""
    stamp = "timestamp_sample" if "timestamp_sample" in data else "timestamp"
    if missing := [name for name in (stamp, *fields) if name not in data]:
        raise ValueError(f"its {topic} has no {' and no '.join(missing)}")
    time_us = np.asarray(data[stamp], dtype=np.int64)
    readings = np.column_stack([np.asarray(data[axis], dtype=np.float64) for axis in fields])
    order = np.unique(time_us, return_index=True)[1]
    return time_us[order].astype(np.float64), readings[order]
