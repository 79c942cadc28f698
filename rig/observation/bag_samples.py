"""Readings and attitudes from a ROS 2 bag, without ROS: `sensor_msgs/Imu` and `MagneticField`, and poses.

A reading has the time of its message's header, so readings and poses stand on the clock of whoever stamped them. A pose
(`geometry_msgs/PoseStamped` or `TransformStamped`) is the body's in the room: it holds from half-way to the one before
until half-way to the next.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from rig.data.motion_file import TIME
from rig.data.quantity import ACCELERATION, FIELD, RATE
from rig.errors import Refused, RigError
from rig.errors.extras import missing_extra
from rig.errors.quoting import quote
from rig.estimation.arrays import Array

IMU, MAGNETIC = "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField"
POSES = (
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
)
NOT_MEASURED = -1.0  # first element of a covariance of what the message does not hold
SUFFIXES = (".mcap", ".db3")
NANO = 10**9
_QUATERNION = ("qw", "qx", "qy", "qz")


def is_bag(path: Path) -> bool:
    """Whether a path is a bag, a folder with its metadata or one of its files."""
    return (path / "metadata.yaml").is_file() if path.is_dir() else path.suffix in SUFFIXES


def bag_readings(path: Path, topic: str | None) -> dict[str, Array]:
    """The columns (n,) of readings in a bag, as those of a CSV file: of the topic, or of the only one with an Imu.

    Times are from the beginning of the bag on. Raises Refused `no_file`, `missing_extra`, `bag_topic`.
    """
    with _opened(path) as reader:
        chosen = _chosen(reader, (IMU,) if topic is None else (IMU, MAGNETIC), topic, "readings")
        if chosen[0].msgtype == MAGNETIC:
            fields = [(_stamp_ns(each), *_xyz(each.magnetic_field)) for each in _messages(reader, chosen)]
            return _table(fields, [TIME, *FIELD.columns], path, _began_ns(reader))
        rows, force_told = [], True
        for message in _messages(reader, chosen):
            force_told = force_told and float(message.linear_acceleration_covariance[0]) != NOT_MEASURED
            read = (*_xyz(message.angular_velocity), *_xyz(message.linear_acceleration))
            rows.append((_stamp_ns(message), *read))
        table = _table(rows, [TIME, *RATE.columns, *ACCELERATION.columns], path, _began_ns(reader))
    return table if force_told else {name: table[name] for name in (TIME, *RATE.columns)}


def bag_attitudes(path: Path, topic: str | None) -> dict[str, Array]:
    """The columns (N,) of attitudes in a bag, as those of a CSV file. Raises Refused as `bag_readings`."""
    with _opened(path) as reader:
        rows = []
        for message in _messages(reader, _chosen(reader, POSES, topic, "attitudes")):
            turned = _orientation(message)
            rows.append((_stamp_ns(message), turned.w, turned.x, turned.y, turned.z))
        table = _table(rows, [TIME, *_QUATERNION], path, _began_ns(reader))
    time_s = table.pop(TIME)
    if len(time_s) < 2:
        raise Refused("bag_topic", f"{path} holds {len(time_s)} poses", "Record the poses while the sensor is turned")
    between = (time_s[1:] + time_s[:-1]) / 2
    first, last = time_s[0] - (between[0] - time_s[0]), time_s[-1] + (time_s[-1] - between[-1])
    return {"start_s": np.append(first, between), "end_s": np.append(between, last), **table}


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The bag's reader. Raises Refused `no_file`, `missing_extra`."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise missing_extra(error, "ros2") from error
    folder = path if path.is_dir() else path.parent
    try:
        with AnyReader([folder], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
            yield reader
    except RigError:
        raise
    except Exception as error:  # of a damaged bag it raises whatever its parser ends in
        why = " ".join(str(error).split()) or type(error).__name__
        raise Refused(
            "no_file",
            f"{path} is no bag that can be read: {why}",
            "Name the folder of the bag, with its metadata.yaml; `ros2 bag reindex FOLDER` writes one",
        ) from error


def _chosen(reader: Any, types: Sequence[str], topic: str | None, what: str) -> Any:
    """The connection of a topic; without a name, of the only one there is."""
    there = [each for each in reader.connections if each.msgtype in types]
    if topic is not None:
        there = [each for each in there if each.topic == topic]
    names = sorted({each.topic for each in there})
    if len(names) != 1:
        known = ", ".join(sorted(f"{each.topic} ({each.msgtype})" for each in reader.connections)) or "none"
        asked = "" if topic is None else f" called {quote(topic)}"
        raise Refused(
            "bag_topic",
            f"the bag has {len(names)} topics{asked} with {what} ({', '.join(types)}); its topics are {known}",
            "Name one behind the bag: BAG::/topic",
        )
    return there


def _messages(reader: Any, connections: Any) -> Iterator[Any]:
    for connection, _, data in reader.messages(connections=connections):
        yield reader.deserialize(data, connection.msgtype)


def _orientation(message: Any) -> Any:
    if hasattr(message, "transform"):
        return message.transform.rotation
    pose = message.pose
    return pose.orientation if hasattr(pose, "orientation") else pose.pose.orientation


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def _stamp_ns(message: Any) -> int:
    return int(message.header.stamp.sec) * NANO + int(message.header.stamp.nanosec)


def _began_ns(reader: Any) -> int:
    """One moment for every topic: seconds since 1970 leave a float no microseconds to spare."""
    return int(reader.start_time)


def _table(rows: list[tuple[Any, ...]], columns: Sequence[str], path: Path, began_ns: int) -> dict[str, Array]:
    if not rows:
        raise Refused("bag_topic", f"{path} holds no message of the topic", "Name another topic")
    order = sorted(rows, key=lambda row: row[0])
    since_ns = np.array([row[0] - began_ns for row in order], dtype=np.int64)
    values = np.array([row[1:] for row in order], dtype=np.float64)
    return {columns[0]: since_ns / NANO, **dict(zip(columns[1:], values.T, strict=True))}
