"""Readings from PX4's log (`.ulg`), by `pyulog`: the sensors' readings before the autopilot corrects them.

The readings are those of one instance of `sensor_gyro` and one of `sensor_accel`, in rad/s and m/s²; `timestamp_sample`
is the autopilot's time of the sample in µs. If gyroscope and accelerometer are separate chips, the accelerometer's
readings are interpolated to the gyroscope's times; if they are one chip, both have the same times. Where the
accelerometer has a gap there is no row; if it has no reading for most rows, the gyroscope is read alone.

PX4's default profile logs these topics once a second or not at all. Then `sensor_combined`, at about 200 Hz, is read,
with a note on its shortcomings. The reader runs in a process of its own (`rig.observation.formats.sample_files`).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.processes.reading_parts import Part
from rig.data.quantity import ACCELERATION, RATE, Quantity
from rig.data.recording.motion_file import TIME
from rig.errors import Refused
from rig.errors.extras import missing_extra
from rig.errors.quoting import list_first, shorten
from rig.estimation.arrays import Array
from rig.observation.formats.table_parts import LEFT_OUT, NOTE

SUFFIX = ".ulg"
TOPICS: dict[str, Quantity] = {"sensor_gyro": RATE, "sensor_accel": ACCELERATION}
COMBINED_TOPIC = "sensor_combined"
COMBINED_FIELDS = {RATE: "gyro_rad", ACCELERATION: "accelerometer_m_s2"}
MAX_STEP_RATIO = 3.0  # of two readings between which others are interpolated to the usual step; beyond, it is a gap
MIN_COVERED_FRACTION = 0.5  # of the gyroscope's readings, for which there are accelerations
MIN_RATE_RATIO = 0.5  # to `sensor_combined`: a raw topic with a lower rate lacks some of the readings
COMBINED_NOTE = (
    "sensor_combined of PX4: the selected sensor, which may change in flight, averaged, and corrected by the "
    "autopilot's own calibration (CAL_GYRO, CAL_ACC): the result is relative to that"
)
MICROSECOND_S = 1e-6


@dataclass(frozen=True, slots=True)
class LogReadings:
    """The `columns` (n,) of a log by name, the number of rows `left_out`, and a `note` on what the readings lack."""

    columns: dict[str, Array]
    left_out: int = 0
    note: str = ""


def is_ulog(path: Path) -> bool:
    """Return whether a path names a ULog file, by its suffix."""
    return path.suffix.lower() == SUFFIX


def ulog_readings(path: Path, inside: str | None = None) -> Iterator[Part]:
    """Yield, in blocks, the readings of one instance of each sensor in a log, or those of `sensor_combined`.

    `inside` is the number of the instance, or "sensor_combined". If it is None, instance 0 is read, or
    `sensor_combined` if instance 0 of the gyroscope is missing or logged less than half as often.

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
        readings = _read_combined(topics[COMBINED_TOPIC, 0])
    else:
        readings = _read_raw(topics, int(inside or "0"))
    yield np.column_stack(list(readings.columns.values()))
    yield {"columns": list(readings.columns), LEFT_OUT: readings.left_out, NOTE: readings.note}


def _is_combined(path: Path, topics: Mapping[tuple[str, int], Any], inside: str | None) -> bool:
    """Return whether to read `sensor_combined`: if `inside` names it, or is None and `sensor_gyro` is rare or missing.

    Raise Refused `ulog_topic` if the log does not hold the named topic.
    """
    rates_hz = {topic: _rate_hz(data) for topic, data in topics.items()}
    combined_hz = rates_hz.get((COMBINED_TOPIC, 0))
    number = inside or "0"
    raw_hz = rates_hz.get(("sensor_gyro", int(number))) if number.isdecimal() else None
    is_better = combined_hz is not None and (raw_hz is None or raw_hz < MIN_RATE_RATIO * combined_hz)
    if combined_hz is not None and (inside == COMBINED_TOPIC or (inside is None and is_better)):
        return True
    if raw_hz is None and not (number.isdecimal() and ("sensor_accel", int(number)) in rates_hz):
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


def _read_raw(topics: Mapping[tuple[str, int], Any], instance: int) -> LogReadings:
    """Return the readings of one instance of `sensor_gyro` and `sensor_accel`, or of the only one that is logged."""
    read = {
        quantity: _read_topic(f"{topic} {instance}", topics[topic, instance])
        for topic, quantity in TOPICS.items()
        if (topic, instance) in topics
    }
    if RATE not in read:
        return LogReadings(_columns(*read[ACCELERATION], ACCELERATION), note=f"the log holds no sensor_gyro {instance}")
    time_us, rates = read[RATE]
    columns = _columns(time_us, rates, RATE)
    if ACCELERATION not in read:
        return LogReadings(columns)
    accelerations, covered = _interpolate(time_us, *read[ACCELERATION])
    if covered.mean() < MIN_COVERED_FRACTION:
        note = f"sensor_accel {instance} has readings at {covered.mean():.0%} of the times of sensor_gyro {instance}"
        return LogReadings(columns, note=f"{note}: it is not read")
    columns |= dict(zip(ACCELERATION.columns, accelerations.T, strict=True))
    return LogReadings({name: column[covered] for name, column in columns.items()}, int((~covered).sum()))


def _interpolate(time_us: Array, other_us: Array, readings: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return readings (m, 3), taken at `other_us` (m,), at the times `time_us` (n,), and a mask (n,) of covered times.

    A time is covered if it lies between two readings without a gap. Before the first reading, and after the last one,
    times are covered up to the usual interval between readings.
    """
    other_us, order = np.unique(other_us, return_index=True)
    steps_us = np.diff(other_us)
    usual_us = float(np.median(steps_us)) if len(steps_us) else 0.0
    near = (time_us >= other_us[0] - usual_us) & (time_us <= other_us[-1] + usual_us)
    around_us = np.concatenate([[0.0], steps_us, [0.0]])  # the steps before and after each reading
    least_us = np.min([around_us[np.searchsorted(other_us, time_us, side)] for side in ("left", "right")], axis=0)
    covered = near & (least_us <= MAX_STEP_RATIO * usual_us)
    return np.column_stack([np.interp(time_us, other_us, axis) for axis in readings[order].T]), covered


def _read_combined(data: Any) -> LogReadings:
    """Return the readings of `sensor_combined`. Raise ValueError if it lacks a field."""
    fields = [f"{field}[{axis}]" for field in COMBINED_FIELDS.values() for axis in range(3)]
    return LogReadings(_columns(*_read_topic(COMBINED_TOPIC, data, fields), *COMBINED_FIELDS), note=COMBINED_NOTE)


def _columns(time_us: Array, readings: Array, *quantities: Quantity) -> dict[str, Array]:
    """Return the columns of a table: times since the first row, s, and readings (n, 3) of each quantity."""
    names = [name for quantity in quantities for name in quantity.columns]
    return {TIME: (time_us - time_us[0]) * MICROSECOND_S, **dict(zip(names, readings.T, strict=True))}


def _read_topic(topic: str, data: Any, fields: Sequence[str] = tuple("xyz")) -> tuple[Array, Array]:
    """Return times (n,) in µs and readings (n, k) in the order of the log.

    Raise Refused `ulog_topic` for readings of several sensors, ValueError if the topic lacks a field.
    """
    stamp = "timestamp_sample" if np.any(data.get("timestamp_sample", 0)) else "timestamp"
    if missing := [name for name in (stamp, *fields) if name not in data]:
        raise ValueError(f"its {topic} has no {' and no '.join(missing)}")
    if len(sensors := np.unique(data.get("device_id", 0))) > 1:
        raise Refused(
            "ulog_topic",
            f"{topic} holds readings of {len(sensors)} sensors: device_id {list_first(map(str, sensors))}",
            "Give a log of a flight in which the sensor did not change, or name another instance: LOG.ulg::1",
        )
    time_us = np.asarray(data[stamp], dtype=np.int64)
    return time_us.astype(np.float64), np.column_stack([np.asarray(data[axis], dtype=np.float64) for axis in fields])
