"""A ROS 2 bag of `sensor_msgs/Imu`, one topic for each sensor, written without ROS."""

import shutil
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, Final

import numpy as np

from rig.data.quantity import ACCELERATION, RATE
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.report.exports.columns import plain_names
from rig.report.exports.exported_recording import Exported

BAG = "bag"
FORMAT: Final = 9  # version in ROS 2 Jazzy and later
NANO = 10**9
CONVENTION = (
    "angular_velocity in rad/s and linear_acceleration in m/s^2 (upwards at rest) as recorded, in each "
    "sensor's own axes; covariances are diagonal, of one sample at rest, zero if unknown. "
    "orientation_covariance[0] = -1: no attitude is known; linear_acceleration_covariance[0] = -1: none was recorded. "
    "Stamps: the recording's start in UTC, to a second, from there {clock}. Lost: temperature, magnetometers, counts, "
    "the motion, the calibration."
)


def write_bag(recordings: Sequence[Exported], folder: Path) -> list[Path]:
    """Write the new folder `bag`, completely or not at all, and return its path.

    Raise OSError, Refused `report_folder`, `nothing_to_export`.
    """
    path = folder / BAG
    if path.exists():
        raise Refused("report_folder", f"{path} exists already", "Choose another with --out")
    if not (gyroscopes := recordings[0].run.measuring(RATE)):
        raise Refused("nothing_to_export", "no gyroscope was recorded", "Export its readings as csv")
    try:
        _write(recordings, gyroscopes, path)
    except BaseException as error:
        shutil.rmtree(path, ignore_errors=True)
        if isinstance(error, sqlite3.Error):  # the bag is an SQLite file
            raise OSError(f"{error}: {path}") from error
        raise
    return [path]


def _write(recordings: Sequence[Exported], gyroscopes: Iterable[str], path: Path) -> None:
    """Write the bag of all recordings: one topic for each gyroscope, its accelerations included."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    message = store.types["sensor_msgs/msg/Imu"].__msgtype__
    with Writer(path, version=FORMAT) as bag:
        bag.set_custom_data("convention", CONVENTION.format(clock=recordings[0].clock))
        for name, plain in plain_names(gyroscopes).items():
            connection = bag.add_connection(f"/{plain}/imu", message, typestore=store)
            for recording in recordings:
                for stamp, imu in _messages(store.types, recording, name, plain):
                    bag.write(connection, stamp, store.serialize_cdr(imu, message))


def _messages(types: Mapping[str, Any], recording: Exported, name: str, frame: str) -> Iterator[tuple[int, Any]]:
    """Yield the time stamp, ns, and the message of each sample."""
    imu, header, time = (
        types[name] for name in ("sensor_msgs/msg/Imu", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    sensor, samples = recording.run.sensors[name], recording.run.samples[name]
    rates, has_forces = sensor.channel(RATE).values(samples), sensor.measures(ACCELERATION)
    forces = sensor.channel(ACCELERATION).values(samples) if has_forces else np.zeros_like(rates)
    unknown = np.array([-1.0, *[0.0] * 8])
    rate_covariance = _covariance(recording.noise(name, RATE))
    force_covariance = _covariance(recording.noise(name, ACCELERATION)) if has_forces else unknown
    no_rotation = quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    for stamp, rate, force in zip(_stamps(recording, name), rates, forces, strict=True):
        time_stamp = time(sec=stamp // NANO, nanosec=stamp % NANO)
        yield (
            stamp,
            imu(
                header=header(stamp=time_stamp, frame_id=frame),
                orientation=no_rotation,
                orientation_covariance=unknown,
                angular_velocity=vector(*rate.tolist()),
                angular_velocity_covariance=rate_covariance,
                linear_acceleration=vector(*force.tolist()),
                linear_acceleration_covariance=force_covariance,
            ),
        )


def _covariance(noises: Sequence[Array]) -> Array:
    """Return the covariance (9,) of one sample, row by row; zeros without rests, which ROS reads as "unknown"."""
    variance = np.mean(np.square(noises), axis=0) if noises else np.zeros(3)
    return np.diag(variance).ravel()


def _stamps(recording: Exported, name: str) -> list[int]:
    """Return the times of a sensor's samples in ns since 1970."""
    start_s = datetime.fromisoformat(recording.run.provenance.started_utc).timestamp()
    stamps: list[int] = (int(start_s) * NANO + np.rint(recording.since_s(name) * NANO).astype(np.int64)).tolist()
    return stamps
