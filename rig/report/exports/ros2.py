"""A ROS 2 bag of `sensor_msgs/Imu`, a topic for each sensor, written without ROS."""

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
from rig.report.exports.names import plain_names
from rig.report.exports.recorded import Exported

BAG = "bag"
FORMAT: Final = 9  # of ROS 2 Jazzy and later
NANO = 10**9
SAID = (
    "angular_velocity in rad/s and linear_acceleration in m/s^2 (upwards at rest) as they were recorded, in each "
    "sensor's own axes; covariances are diagonal, of one sample at rest, zero where that is not known. "
    "orientation_covariance[0] = -1: no attitude is known; linear_acceleration_covariance[0] = -1: none was recorded. "
    "Stamps: the recording's start in UTC, to a second, from there {clock}. Lost: temperature, magnetometers, counts, "
    "the motion beside, the calibration."
)


def write_bag(recordings: Sequence[Exported], folder: Path) -> list[Path]:
    """The folder `bag`, which must not be there: whole, or not at all.

    Raises Refused `report_folder`, `nothing_to_export`, OSError.
    """
    path = folder / BAG
    if path.exists():
        raise Refused("report_folder", f"{path} is there already", "Choose another with --out")
    if not (gyroscopes := recordings[0].run.measuring(RATE)):
        raise Refused("nothing_to_export", "no gyroscope was recorded", "Export its readings as csv")
    try:
        _write(recordings, gyroscopes, path)
    except BaseException as error:
        shutil.rmtree(path, ignore_errors=True)
        if isinstance(error, sqlite3.Error):  # which the bag is written with
            raise OSError(f"{error}: {path}") from error
        raise
    return [path]


def _write(recordings: Sequence[Exported], gyroscopes: Iterable[str], path: Path) -> None:
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    message = store.types["sensor_msgs/msg/Imu"].__msgtype__
    with Writer(path, version=FORMAT) as bag:
        bag.set_custom_data("convention", SAID.format(clock=recordings[0].clock))
        for name, plain in plain_names(gyroscopes).items():
            connection = bag.add_connection(f"/{plain}/imu", message, typestore=store)
            for recording in recordings:
                for stamp, imu in _messages(store.types, recording, name, plain):
                    bag.write(connection, stamp, store.serialize_cdr(imu, message))


def _messages(types: Mapping[str, Any], recording: Exported, name: str, frame: str) -> Iterator[tuple[int, Any]]:
    """Stamp in ns and message of each sample."""
    imu, header, time = (
        types[each] for each in ("sensor_msgs/msg/Imu", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    sensor, samples = recording.run.sensors[name], recording.run.samples[name]
    rates, feels = sensor.channel(RATE).values(samples), sensor.measures(ACCELERATION)
    felt = sensor.channel(ACCELERATION).values(samples) if feels else np.zeros_like(rates)
    unknown = np.array([-1.0, *[0.0] * 8])
    of_rate = _covariance(recording.noise(name, RATE))
    of_force = _covariance(recording.noise(name, ACCELERATION)) if feels else unknown
    nobody = quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    for stamp, rate, force in zip(_stamps(recording, name), rates, felt, strict=True):
        at = time(sec=stamp // NANO, nanosec=stamp % NANO)
        yield (
            stamp,
            imu(
                header=header(stamp=at, frame_id=frame),
                orientation=nobody,
                orientation_covariance=unknown,
                angular_velocity=vector(*rate.tolist()),
                angular_velocity_covariance=of_rate,
                linear_acceleration=vector(*force.tolist()),
                linear_acceleration_covariance=of_force,
            ),
        )


def _covariance(noises: Sequence[Array]) -> Array:
    """(9,) covariance of one sample, row by row; zeros, which ROS reads as not known, where nothing stood still."""
    variance = np.mean(np.square(noises), axis=0) if noises else np.zeros(3)
    return np.diag(variance).ravel()


def _stamps(recording: Exported, name: str) -> list[int]:
    """ns since 1970 of a sensor's samples."""
    began_s = datetime.fromisoformat(recording.run.provenance.started_utc).timestamp()
    stamps: list[int] = (int(began_s) * NANO + np.rint(recording.since_s(name) * NANO).astype(np.int64)).tolist()
    return stamps
