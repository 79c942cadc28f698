"""A ROS 2 bag of `sensor_msgs/Imu`, a topic for each sensor, written without ROS."""

import shutil
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, Final

import numpy as np

from rig.data.quantity import ACCELERATION, RATE
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.observation.acceleration import accelerations
from rig.observation.observed_run import ObservedRun
from rig.report.exports.names import plain_names

BAG = "bag"
FORMAT: Final = 9  # of ROS 2 Jazzy and later
NANO = 10**9
SAID = (
    "angular_velocity in rad/s and linear_acceleration in m/s^2 (upwards at rest) as the board sent them, in each "
    "sensor's own axes; covariances are diagonal, of one sample at rest. orientation_covariance[0] = -1: no attitude "
    "is known; linear_acceleration_covariance[0] = -1: none was recorded. Stamps: the recording's start in UTC, to a "
    "second, from there the arm controller's clock. Lost: temperature, magnetometers, counts, the arm's states, the "
    "calibration."
)


def write_bag(recordings: Sequence[ObservedRun], folder: Path) -> list[Path]:
    """The folder `bag`, which must not be there: whole, or not at all. Raises Refused `report_folder`, OSError."""
    path = folder / BAG
    if path.exists():
        raise Refused("report_folder", f"{path} is there already", "Choose another with --out")
    try:
        _write(recordings, path)
    except BaseException as error:
        shutil.rmtree(path, ignore_errors=True)
        if isinstance(error, sqlite3.Error):  # which the bag is written with
            raise OSError(f"{error}: {path}") from error
        raise
    return [path]


def _write(recordings: Sequence[ObservedRun], path: Path) -> None:
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    message = store.types["sensor_msgs/msg/Imu"].__msgtype__
    with Writer(path, version=FORMAT) as bag:
        bag.set_custom_data("convention", SAID)
        for name, plain in plain_names(recordings[0].run.measuring(RATE)).items():
            connection = bag.add_connection(f"/{plain}/imu", message, typestore=store)
            for recording in recordings:
                for stamp, imu in _messages(store.types, recording, name, plain):
                    bag.write(connection, stamp, store.serialize_cdr(imu, message))


def _messages(types: Mapping[str, Any], recording: ObservedRun, name: str, frame: str) -> Iterator[tuple[int, Any]]:
    """Stamp in ns and message of each sample."""
    imu, header, time = (
        types[each] for each in ("sensor_msgs/msg/Imu", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    stream, seen = recording.stream(name), recording.sensors[name]
    feels = stream.sensor.measures(ACCELERATION)
    felt = accelerations(stream, slice(None)) if feels else np.zeros_like(stream.readings_rad_s)
    unknown = np.array([-1.0, *[0.0] * 8])
    of_rate = _covariance([rest.noise_rad_s for rest in seen.rests])
    of_force = _covariance([dwell.reading.noise for dwell in seen.dwells]) if feels else unknown
    nobody = quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    for stamp, rate, force in zip(_stamps(recording, stream.time_s), stream.readings_rad_s, felt, strict=True):
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


def _stamps(recording: ObservedRun, time_s: Array) -> list[int]:
    """ns since 1970, of times on the controller's clock."""
    began_s = datetime.fromisoformat(recording.run.provenance.started_utc).timestamp()
    since_s = time_s - recording.motion.time_s[0]
    stamps: list[int] = (int(began_s) * NANO + np.rint(since_s * NANO).astype(np.int64)).tolist()
    return stamps
