"""Readings and attitudes from a bag of ROS 2 or ROS 1, without ROS: `sensor_msgs/Imu` and `MagneticField`, and poses.

Times are those in the messages' headers. A pose (`geometry_msgs/PoseStamped` or `TransformStamped`) states the body's
attitude in the room. The reader runs in a process of its own (`rig.observation.formats.sample_files`) and holds one
block of the bag at a time.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

from rig.data.processes.reading_parts import Part
from rig.data.quantity import ACCELERATION, FIELD, RATE
from rig.data.recording.motion_file import QUATERNION, TIME
from rig.errors import Refused
from rig.errors.extras import missing_extra
from rig.errors.quoting import list_first, quote, shorten
from rig.observation.formats.table_parts import LEFT_OUT, NOTE, read_blocks

IMU, MAGNETIC = "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField"
POSES = (
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
)
NOT_PROVIDED = -1.0  # sensor_msgs/Imu: first element of the covariance of a quantity that a message does not contain
SUFFIXES = (".mcap", ".db3")
ROS_1 = ".bag"
METADATA = "metadata.yaml"
METADATA_BYTES = 4_000_000  # metadata of two thousand topics with all their quality-of-service settings
METADATA_VALUES = 50_000  # metadata of a thousand topics; rosbags takes 50 µs for each
DEFINITION_CHARACTERS = 100_000  # ten times what ROS 2 writes about a message, including all comments
NANO = 10**9


def is_bag(path: Path) -> bool:
    """Return whether a path is a bag: a folder with its metadata, or one of its files."""
    return (path / METADATA).exists() if path.is_dir() else path.suffix.lower() in (*SUFFIXES, ROS_1)


def bag_of(path: Path) -> Path:
    """Return the folder of the bag to which the file `path` belongs, or `path` if no metadata is next to it."""
    is_alone = path.is_dir() or _is_ros_1(path) or not (path.parent / METADATA).exists()
    return path if is_alone else path.parent


def _is_ros_1(path: Path) -> bool:
    return path.suffix.lower() == ROS_1 and not path.is_dir()


def bag_readings(path: Path, inside: str | None) -> Iterator[Part]:
    """Yield, in blocks, the readings of one topic of a bag.

    `inside` is the topic's name. If it is None, the bag must have a single topic of type Imu, which is read. The
    columns are as in a CSV file, times are measured from the beginning of the bag, and rows have the order of the bag.
    Messages without a rate are left out and counted. If any of the remaining messages lacks an acceleration, no
    accelerations are read. Raise Refused `missing_extra` or `bag_topic`, and any error of the parser for a damaged bag.
    """
    with _open_bag(path) as reader:
        chosen = _select_topic(reader, (IMU,) if inside is None else (IMU, MAGNETIC), inside, "readings")
        if chosen[0].msgtype == MAGNETIC:
            fields = ((time_s, *_xyz(message.magnetic_field)) for time_s, message in _read_messages(reader, chosen))
            yield from read_blocks(fields, [TIME, *FIELD.columns])
            return
        columns: list[str | None] = [TIME, *RATE.columns, *ACCELERATION.columns]
        counts: dict[str, Any] = {LEFT_OUT: 0}
        yield from read_blocks(_inertial(_read_messages(reader, chosen), columns, counts), columns, counts)


def bag_attitudes(path: Path, inside: str | None) -> Iterator[Part]:
    """Yield, in blocks, the poses in a bag: a time and a quaternion each. Raise as `bag_readings` does."""
    with _open_bag(path) as reader:
        poses = _read_messages(reader, _select_topic(reader, POSES, inside, "attitudes"))
        orientations = ((time_s, _orientation(message)) for time_s, message in poses)
        yield from read_blocks(((time_s, q.w, q.x, q.y, q.z) for time_s, q in orientations), [TIME, *QUATERNION])


def _inertial(
    messages: Iterator[tuple[float, Any]], columns: list[str | None], counts: dict[str, Any]
) -> Iterator[tuple[float, ...]]:
    """Yield the time, rate and acceleration of `sensor_msgs/Imu`; replace absent columns in `columns` by None.

    Messages without a rate are left out and counted in `counts`. Raise Refused `bag_topic` if no message holds a rate
    or an acceleration.
    """
    forces: list[tuple[float, ...]] = []
    has_rates, all_forces = False, True
    for time_s, message in messages:
        row = (time_s, *_xyz(message.angular_velocity), *_xyz(message.linear_acceleration))
        has_force = float(message.linear_acceleration_covariance[0]) != NOT_PROVIDED
        if float(message.angular_velocity_covariance[0]) != NOT_PROVIDED:
            has_rates, all_forces = True, all_forces and has_force
            counts[LEFT_OUT] += len(forces)
            forces.clear()
            yield row
        elif has_force and not has_rates:
            forces.append(row)
        else:
            counts[LEFT_OUT] += 1
    if not has_rates and not forces:
        raise Refused(
            "bag_topic",
            "the messages hold neither rates nor accelerations: the first element of their covariances is -1 in all",
            "After the bag, name the topic of a sensor that measures: BAG::/topic",
        )
    if not has_rates:
        columns[1:4] = [None] * 3
        counts[NOTE] = "the messages say by their covariance (-1) that no angular velocity was measured"
    elif not all_forces:
        columns[4:] = [None] * 3
    yield from forces


@contextmanager
def _open_bag(path: Path) -> Iterator[Any]:
    """Open the bag's reader. Raise Refused `missing_extra`, ValueError for messages that are not ROS's."""
    try:
        from rosbags import rosbag1, rosbag2
    except ImportError as error:
        raise missing_extra(error, "ros2") from error
    if path.is_dir():
        _check_metadata(path / METADATA)
    reader = (rosbag1 if _is_ros_1(path) else rosbag2).Reader(str(path))
    try:
        reader.open()
    except KeyError as error:  # of the encodings that ROS 2 has
        raise ValueError(f"a topic has a schema of another kind than ROS's: {error}") from error
    with closing(reader):
        yield reader


def _check_metadata(path: Path) -> None:
    """Raise ValueError if the metadata file is implausibly large: more than `METADATA_BYTES` or `METADATA_VALUES`."""
    import yaml

    if (size := path.stat().st_size) > METADATA_BYTES:
        raise ValueError(f"its {METADATA} is {size} bytes long, {METADATA_BYTES} at most")
    with path.open("rb") as file:
        values = (event for event in yaml.parse(file, yaml.CSafeLoader) if isinstance(event, yaml.ScalarEvent))
        if next(islice(values, METADATA_VALUES, None), None) is not None:
            raise ValueError(f"its {METADATA} holds more than {METADATA_VALUES} values")


def _select_topic(reader: Any, types: Sequence[str], topic: str | None, what: str) -> Any:
    """Return the connections of the topic called `topic` or, if that is None, of the only topic of these types."""
    connections = [connection for connection in reader.connections if connection.msgtype in types]
    if topic is not None:
        connections = [connection for connection in connections if connection.topic == topic]
    names = {connection.topic for connection in connections}
    if len(names) != 1:
        topics = list_first(f"{shorten(topic)} ({shorten(kind)})" for topic, kind in _list_topics(reader, types))
        name = "" if topic is None else f" called {quote(topic)}"
        raise Refused(
            "bag_topic",
            f"the bag has {len(names)} topics{name} with {what} ({', '.join(types)}); its topics are {topics}",
            "Name one after the bag: BAG::/topic",
        )
    return connections


def _list_topics(reader: Any, types: Sequence[str]) -> list[tuple[str, str]]:
    """Return the topics and their types, first the topics of the requested types."""
    topics = {(connection.topic, connection.msgtype) for connection in reader.connections}
    return sorted(topics, key=lambda topic: (topic[1] not in types, topic))


def _read_messages(reader: Any, connections: Any) -> Iterator[tuple[float, Any]]:
    """Yield each message with the time in its header, in seconds from the beginning of the bag.

    All topics have the same beginning. Times count from it because a float of seconds since 1970 would lose
    microseconds. Raise Refused `bag_topic` if there is no message, if no header has a time, or if the messages are of
    several frames.
    """
    from rosbags.typesys import Stores, get_typestore

    is_ros_1 = _is_ros_1(reader.path)
    store = get_typestore(Stores.ROS1_NOETIC if is_ros_1 else Stores.ROS2_JAZZY)
    _check_layout(store, connections)
    deserialize = store.deserialize_ros1 if is_ros_1 else store.deserialize_cdr
    began_ns, topic = int(reader.start_time), quote(connections[0].topic)
    count, has_times, frames = 0, False, set[tuple[str, ...]]()
    for connection, _, data in reader.messages(connections=connections):
        message: Any = deserialize(data, connection.msgtype)
        frames.add(_frames(message))
        if len(frames) > 1:
            raise _several_frames(topic, frames)
        stamp = message.header.stamp
        has_times = has_times or bool(stamp.sec or stamp.nanosec)
        yield (int(stamp.sec) * NANO + int(stamp.nanosec) - began_ns) / NANO, message
        count += 1
    if not count:
        raise Refused("bag_topic", f"{topic} has no message in the bag", "Name another topic: BAG::/topic")
    if not has_times:
        what = f"the messages of {topic} have no time: the stamps in their headers are zero"
        raise Refused("bag_topic", what, "Let the sensor's driver fill in the header's stamp, and record again")


def _frames(message: Any) -> tuple[str, ...]:
    """Return the frame names in a message: the one in its header and, for a transform, the body's (child) frame."""
    return (message.header.frame_id, *([message.child_frame_id] if hasattr(message, "child_frame_id") else []))


def _several_frames(topic: str, frames: Iterable[tuple[str, ...]]) -> Refused:
    """Return the refusal of a topic whose messages are of several sensors or bodies."""
    names = " and ".join(sorted(" to ".join(map(quote, frame)) for frame in frames))
    return Refused(
        "bag_topic",
        f"the messages of {topic} are of several sensors or bodies, by their frames: {names}",
        "Give a bag in which a topic of its own holds the messages of the frame that is meant",
    )


def _check_layout(store: Any, connections: Any) -> None:
    """Raise ValueError if the messages' own definition differs from ROS's.

    The definition is only compared and not used, because rosbags would generate code from it and execute this code.
    """
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.typesys import get_types_from_idl, get_types_from_msg

    for kind, definition in {(connection.msgtype, connection.msgdef) for connection in connections}:
        if len(definition.data) > DEFINITION_CHARACTERS:
            raise ValueError(f"its definition of {kind} is {len(definition.data)} characters long")
        if definition.format == MessageDefinitionFormat.MSG:
            fields = get_types_from_msg(definition.data, kind)
        elif definition.format == MessageDefinitionFormat.IDL:
            fields = dict[str, Any]()
            for text in definition.data.split("=" * 80 + "\n"):
                fields |= get_types_from_idl(text.partition("\n")[2] if text.startswith("IDL: ") else text)
        else:
            continue
        if other := sorted(
            name for name in fields if name in store.fielddefs and fields[name] != store.fielddefs[name]
        ):
            raise ValueError(f"its {list_first(map(shorten, other))} differs from that of ROS")


def _orientation(message: Any) -> Any:
    if hasattr(message, "transform"):
        return message.transform.rotation
    pose = message.pose
    return pose.orientation if hasattr(pose, "orientation") else pose.pose.orientation


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z
