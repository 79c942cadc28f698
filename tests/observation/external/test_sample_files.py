"""The same session by CSV, in a ROS 2 bag and in PX4's log solves to the same numbers."""

import os
import shutil
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.motion_file import TIME, Item, samples_header
from rig.data.recording.settings import Site, SolveOptions
from rig.errors import Refused
from rig.observation.external.attitude_import import read_attitudes
from rig.observation.external.csv_samples import read_sample_table, read_samples
from rig.observation.external.from_files import Files, build_recording
from rig.observation.formats.bag_samples import bag_readings
from rig.observation.formats.csv_table import read_columns
from rig.observation.formats.sample_files import entry_of
from rig.report.document import document_of
from support.external.loggers import stale_at_first
from support.external.ulog_writer import write_ulog
from support.paths import DOCS

EXAMPLES = DOCS / "examples"
STANDARD = Site(up=(0.0, 0.0, 1.0), gravity_m_s2=9.80665, earth_rate_rad_s=None)
BEGAN_NS = 1_764_000_000 * 10**9


def write_bag(path: Path, table: dict[str, Any], poses: dict[str, Any] | None = None, transform: bool = False) -> None:
    """A bag with one IMU, and poses if there are any: those of intervals, stamped in their middles."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    of = {name.rpartition("/")[2]: each for name, each in store.types.items()}
    vector, quaternion = of["Vector3"], of["Quaternion"]

    def header(time_s: float) -> Any:
        at = BEGAN_NS + round(time_s * 1e9)
        return of["Header"](of["Time"](sec=at // 10**9, nanosec=at % 10**9), "body"), at

    with Writer(path, version=9) as bag:
        imu = bag.add_connection("/imu/data", "sensor_msgs/msg/Imu", typestore=store)
        kept = np.zeros(9)
        unknown = np.array([-1.0, *[0.0] * 8])
        forces = np.column_stack([table.get(name, np.zeros(len(table[TIME]))) for name in ACCELERATION.columns])
        rates = np.column_stack([table[name] for name in RATE.columns])
        told = kept if ACCELERATION.columns[0] in table else unknown
        for time_s, rate, force in zip(table[TIME], rates, forces, strict=True):
            stamp, at = header(time_s)
            message = of["Imu"](
                stamp, quaternion(0.0, 0.0, 0.0, 1.0), unknown, vector(*rate), kept, vector(*force), told
            )
            bag.write(imu, at, store.serialize_cdr(message, "sensor_msgs/msg/Imu"))
        if poses is None:
            return
        kind = "geometry_msgs/msg/" + ("TransformStamped" if transform else "PoseStamped")
        connection = bag.add_connection("/mocap/body", kind, typestore=store)
        for start, end, w, x, y, z in zip(*(poses[name] for name in
                                            ("start_s", "end_s", "qw", "qx", "qy", "qz")), strict=True):  # fmt: skip
            stamp, at = header((start + end) / 2)
            turned = quaternion(x, y, z, w)
            message = (
                of["TransformStamped"](stamp, "body", of["Transform"](vector(0.0, 0.0, 0.0), turned))
                if transform
                else of["PoseStamped"](stamp, of["Pose"](of["Point"](0.0, 0.0, 0.0), turned))
            )
            bag.write(connection, at, store.serialize_cdr(message, kind))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stated", "other", "is_read"),
    [
        ("float64[9] angular", "float32[9] angular", False),
        ("float64 w", f"float64 w\n{'=' * 80}\nMSG: own/msg/Extra\nfloat64 x", True),
    ],
)
def test_a_bag_whose_messages_have_another_layout_than_ros_is_refused_and_further_types_do_not_matter(
    tmp_path: Path, stated: str, other: str, is_read: bool
) -> None:
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    kind = "sensor_msgs/msg/Imu"
    definition, digest = get_typestore(Stores.ROS2_JAZZY).generate_msgdef(kind, ros_version=2)
    assert stated in definition
    with Writer(tmp_path / "bag", version=9) as bag:
        imu = bag.add_connection("/imu", kind, msgdef=definition.replace(stated, other), rihs01=digest)
        # stamp, the length of an empty name with its end, the numbers
        bag.write(imu, BEGAN_NS, struct.pack(">4xiII4x37d", 1, 0, 1, *np.zeros(37)))
    if is_read:
        assert list(bag_readings(tmp_path / "bag", None))
    else:
        with pytest.raises(ValueError, match="sensor_msgs/msg/Imu differs from that of ROS"):
            list(bag_readings(tmp_path / "bag", None))


def solved(samples: Path, sweeps: Path) -> np.ndarray:
    """Scale, bias and their covariance, as a gyroscope's readings and their sweeps give them."""
    item = Item("imu", "any", "1")
    found = calibrate([build_recording(Files(samples, sweeps, "sweeps", item), STANDARD, SolveOptions())])
    (entry,) = document_of(found).gyroscopes.values()
    return np.concatenate([entry.scale, entry.bias_rad_s, np.ravel(entry.covariance)])


@pytest.mark.slow
def test_readings_of_sensors_that_sweeps_do_not_need_may_be_blank(tmp_path: Path) -> None:
    names, *rows = (EXAMPLES / "samples.csv").read_text().splitlines()
    fields = ("2e-5,0,4e-5" if row % 4 == 0 else ",," for row in range(len(rows)))
    samples = tmp_path / "samples.csv"
    samples.write_text("\n".join([f"{names},x_t,y_t,z_t", *map(",".join, zip(rows, fields, strict=True))]))
    read = build_recording(
        Files(samples, EXAMPLES / "sweeps.csv", "sweeps", Item("imu", "any", "1")), STANDARD, SolveOptions()
    )
    assert read.external is not None and len(read.external.readings[TIME]) == len(rows)


def as_csv(path: Path, table: dict[str, Any]) -> None:
    columns = np.column_stack(list(table.values()))
    np.savetxt(path, columns, "%.9g", delimiter=",", header=",".join(table), comments="")


@pytest.mark.slow
def test_what_the_user_should_know_of_the_sweeps_of_a_file_is_among_the_notes() -> None:
    files = Files(EXAMPLES / "samples.csv", EXAMPLES / "sweeps.csv", "sweeps", Item("imu", "any", "1"))
    notes = calibrate([build_recording(files, STANDARD, SolveOptions())]).external["imu"].notes
    (note,) = notes
    assert note.startswith(
        "all 6 turns count by their mean speed: the body moves before or after them; so angle_rad must"
    )


@pytest.mark.slow
@pytest.mark.parametrize("axis", [0, 2])
def test_the_least_certain_scale_factor_is_the_one_that_is_checked(axis: int, tmp_path: Path) -> None:
    table = dict(read_columns(EXAMPLES / "samples.csv", samples_header([RATE]), 256))
    noise = 0.2 * np.random.default_rng(axis).normal(size=len(table[TIME]))
    as_csv(tmp_path / "samples.csv", table | {RATE.columns[axis]: table[RATE.columns[axis]] + noise})
    files = Files(tmp_path / "samples.csv", EXAMPLES / "sweeps.csv", "sweeps", Item("imu", "any", "1"))
    found = calibrate([build_recording(files, STANDARD, SolveOptions())])
    budget = found.results["imu"].uncertainty
    assert budget is not None and np.argmax(budget.std[:3]) == axis
    assert [check.value for check in found.checks if check.name == "imu.scale_std"] == [budget.std[axis]]


@pytest.mark.slow
def test_a_session_solves_to_the_same_numbers_from_all_three(tmp_path: Path) -> None:
    """The log holds floats of 32 bits, and whole microseconds; so do the other two then."""
    table = dict(read_columns(EXAMPLES / "samples.csv", samples_header([RATE]), 256))
    table[TIME] = np.round((table[TIME] - table[TIME][0]) * 1e6) / 1e6
    table = {name: each if name == TIME else each.astype(np.float32).astype(float) for name, each in table.items()}
    began_s = float(read_columns(EXAMPLES / "samples.csv", samples_header([RATE]), 256)[TIME][0])
    rates = np.column_stack([table[name] for name in RATE.columns])
    forces = np.tile([0.0, 0.0, 9.8], (len(rates), 1))
    assert ACCELERATION.columns[0] not in table, "the example is a gyroscope's"
    sweeps = np.genfromtxt(EXAMPLES / "sweeps.csv", delimiter=",", names=True)
    moved = {name: sweeps[name] - (began_s if name in ("start_s", "end_s") else 0) for name in sweeps.dtype.names or ()}
    as_csv(tmp_path / "sweeps.csv", moved)
    as_csv(tmp_path / "samples.csv", table)
    write_bag(tmp_path / "bag", table)
    write_ulog(tmp_path / "log.ulg", np.round(table[TIME] * 1e6).astype(int) + 5_000_000, rates, forces)
    csv, bag, log = (solved(tmp_path / name, tmp_path / "sweeps.csv") for name in ("samples.csv", "bag", "log.ulg"))
    assert bag == pytest.approx(csv, rel=1e-6, abs=1e-15)
    assert log == pytest.approx(csv, rel=1e-6, abs=1e-15)


@pytest.mark.slow
def test_stamps_are_put_in_order_alike_in_all_three(tmp_path: Path) -> None:
    """Stale readings first, a gap, and a row twice."""
    rng, time_s = np.random.default_rng(1), np.arange(1000) / 100
    stamps_s = stale_at_first(time_s, 300)
    rows = np.sort(np.append(np.delete(np.arange(1000), np.s_[600:617]), 700))
    rates = rng.normal(size=(1000, 3)).astype(np.float32).astype(float)[rows]
    at_us = np.round((stamps_s - stamps_s[0])[rows] * 1e6).astype(int)
    table = {TIME: at_us * 1e-6, **dict(zip(RATE.columns, rates.T, strict=True))}
    as_csv(tmp_path / "samples.csv", table)
    write_bag(tmp_path / "bag", table)
    write_ulog(tmp_path / "log.ulg", at_us + 5_000_000, rates, np.tile([0.0, 0.0, 9.8], (len(rates), 1)))
    csv, bag, log = (read_samples(tmp_path / name) for name in ("samples.csv", "bag", "log.ulg"))
    for samples in (csv, bag, log):
        assert [part.count for part in samples.omitted] == [1, 300]
        assert samples.sampling is not None and samples.sampling.missing.sum() == 17
        assert samples.time_s - samples.time_s[0] == pytest.approx(csv.time_s - csv.time_s[0], abs=1e-6)
        assert samples.notes[0].startswith(
            "17 samples are missing in 1 gaps, the longest 0.18 s, after sample 600, at "
        )


@pytest.mark.slow
@pytest.mark.parametrize("transform", [False, True])
def test_attitudes_come_from_poses_in_the_same_bag(transform: bool, tmp_path: Path) -> None:
    table = dict(read_columns(EXAMPLES / "swinging_samples.csv", samples_header(), 256))
    poses = read_attitudes(EXAMPLES / "swinging_attitudes.csv")
    poses = {name: pose[:400] for name, pose in poses.items()}
    table = {name: each[:400] for name, each in table.items()}
    write_bag(tmp_path / "bag", table, poses, transform)
    found = read_attitudes(Path(f"{tmp_path / 'bag'}::/mocap/body"))
    shift = float(np.mean(found["start_s"][1:] + found["end_s"][1:] - poses["start_s"][1:] - poses["end_s"][1:])) / 2
    for name in ("qw", "qx", "qy", "qz"):
        assert found[name] == pytest.approx(poses[name], abs=1e-12)
    middles = (found["start_s"] + found["end_s"] - poses["start_s"] - poses["end_s"])[1:-1] / 2
    assert middles == pytest.approx(np.full(len(middles), shift), abs=2e-3)
    samples = read_samples(tmp_path / "bag")
    assert np.diff(samples.time_s) == pytest.approx(np.diff(table[TIME]), abs=2e-9)
    read = np.column_stack([table[name] for name in RATE.columns])
    assert samples.readings[RATE] == pytest.approx(read, abs=1e-12)


@pytest.mark.slow
def test_what_is_not_in_a_file_is_said_with_what_is(tmp_path: Path) -> None:
    table = {TIME: np.arange(5) * 0.01, **{name: np.zeros(5) for name in RATE.columns}}
    write_bag(tmp_path / "bag", table)
    with pytest.raises(Refused, match=r"bag_topic: .*its topics are /imu/data"):
        read_samples(Path(f"{tmp_path / 'bag'}::/other"))
    with pytest.raises(Refused, match="bag_topic"):
        read_attitudes(tmp_path / "bag")
    write_ulog(tmp_path / "log.ulg", np.arange(5) * 1000, np.zeros((5, 3)), np.zeros((5, 3)))
    with pytest.raises(Refused, match=r"ulog_topic: .*sensor_gyro 0"):
        read_samples(Path(f"{tmp_path / 'log.ulg'}::1"))
    with pytest.raises(Refused, match="no_attitudes"):
        read_attitudes(tmp_path / "log.ulg")
    (tmp_path / "broken.ulg").write_bytes(b"no log at all")
    with pytest.raises(Refused, match="no_file"):
        read_samples(tmp_path / "broken.ulg")
    shutil.rmtree(tmp_path / "bag")
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "metadata.yaml").write_text("none", encoding="utf-8")
    with pytest.raises(Refused, match="no_file"):
        read_samples(tmp_path / "bag")


def mcap(
    path: Path,
    *,
    not_measured: float = 0.0,
    without_rate: int = 0,
    seconds: Sequence[int] = range(100),
    frames: Sequence[str] = ("imu",),
) -> Path:
    """A bag in one MCAP file with a hundred readings, one of which has that value; so many first hold no rate.

    The readings are stamped with these `seconds`, and come from these `frames` in turn.
    """
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    types, kind = store.types, "sensor_msgs/msg/Imu"
    none, no_rate, level = (
        np.zeros(9),
        np.array([-1.0, *[0.0] * 8]),
        types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
    )
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        imu = bag.add_connection("/imu", kind, typestore=store)
        for number in range(100):
            stamp = types["builtin_interfaces/msg/Time"](sec=seconds[number], nanosec=0)
            header = types["std_msgs/msg/Header"](stamp=stamp, frame_id=frames[number % len(frames)])
            z = not_measured if number == 40 else 0.1
            read = types["geometry_msgs/msg/Vector3"](x=0.1 * number, y=0.0, z=z)
            message = types[kind](header, level, none, read, no_rate if number < without_rate else none, read, none)
            bag.write(imu, number * 10**9, store.serialize_cdr(message, kind))
    return path


@pytest.mark.thorough
@pytest.mark.slow
def test_a_damaged_bag_is_refused_by_name_whatever_its_parser_ends_in(tmp_path: Path) -> None:
    bag, damage = mcap(tmp_path / "bag"), np.random.default_rng(1)
    (file,) = bag.glob("*.mcap")
    whole = np.frombuffer(file.read_bytes(), dtype=np.uint8)
    refused = 0
    for _ in range(12):
        content = whole.copy()
        content[damage.integers(len(content), size=60)] = damage.integers(256, size=60)
        file.write_bytes(content.tobytes())
        try:
            read_samples(bag)
        except Refused:
            refused += 1
    assert refused > 6


@pytest.mark.slow
def test_a_reading_that_was_not_measured_is_named_in_a_bag_too(tmp_path: Path) -> None:
    with pytest.raises(Refused, match=r"not_a_number: .*bag has 1 samples whose z_rad_s .*the first is sample 41"):
        read_samples(mcap(tmp_path / "bag", not_measured=float("nan")))


@pytest.mark.slow
def test_messages_of_a_bag_that_hold_no_rate_by_their_covariance_are_no_samples(tmp_path: Path) -> None:
    samples = read_samples(mcap(tmp_path / "some", without_rate=30))
    assert samples.readings[RATE][:, 0] == pytest.approx(0.1 * np.arange(30, 100)), "its driver was not ready before"
    assert read_sample_table(tmp_path / "some").others == 30, "they are counted"
    without = mcap(tmp_path / "all", without_rate=100)
    assert [*read_samples(without).readings] == [ACCELERATION]
    with pytest.raises(Refused, match=r"wrong_columns: .* holds no x_rad_s y_rad_s z_rad_s"):
        read_samples(without, [RATE])


def test_a_name_that_is_no_utf_8_is_recorded_as_it_is_shown(tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"imu\xff\x1b[31m.csv")
    path.write_text("time_s\n", encoding="utf-8")
    assert entry_of(path).name == "imu\\udcff\\x1b[31m.csv"


@pytest.mark.slow
def test_a_bag_of_ros_1_is_read(tmp_path: Path) -> None:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types = {name.rpartition("/")[2]: kind for name, kind in store.types.items()}
    zeros, vector = np.zeros(9), types["Vector3"]
    time_ns = BEGAN_NS + np.arange(100) * 10**7
    with Writer(tmp_path / "LOG.BAG") as bag:
        imu = bag.add_connection("/imu/data_raw", "sensor_msgs/msg/Imu", typestore=store)
        for number, at_ns in enumerate(time_ns.tolist()):
            header = types["Header"](
                number, store.types["builtin_interfaces/msg/Time"](at_ns // 10**9, at_ns % 10**9), "imu"
            )
            still = types["Quaternion"](0.0, 0.0, 0.0, 1.0)
            message = types["Imu"](header, still, zeros, vector(number, 2.0, 3.0), zeros, vector(0.0, 0.0, 9.8), zeros)
            bag.write(imu, at_ns, store.serialize_ros1(message, "sensor_msgs/msg/Imu"))
    samples = read_samples(tmp_path / "LOG.BAG")
    assert samples.readings[RATE][:, 0].tolist() == [*range(100)]
    assert np.diff(samples.time_s) == pytest.approx(np.full(99, 0.01))


@pytest.mark.slow
def test_sensor_combined_is_read_where_px4_logged_the_gyroscope_rarely(tmp_path: Path) -> None:
    """PX4's default profile: the raw topics once a second."""
    time_us = np.arange(400) * 5000 + 10**6
    rates, forces = np.tile([0.1, 0.2, 0.3], (400, 1)), np.tile([0.0, 0.0, -9.8], (400, 1))
    write_ulog(tmp_path / "FLIGHT.ULG", time_us, rates, forces, raw_every=200)
    table = read_sample_table(tmp_path / "FLIGHT.ULG")
    assert len(table.columns[TIME]) == 400 and "corrected by the autopilot" in table.note
    assert table.columns["z_rad_s"] == pytest.approx(np.full(400, 0.3))
    raw = read_sample_table(Path(f"{tmp_path / 'FLIGHT.ULG'}::0"))
    assert len(raw.columns[TIME]) == 2 and raw.note == ""
    with pytest.raises(Refused, match=r"ulog_topic: .*sensor_combined 0 at 200 Hz.*sensor_gyro 0 at 1 Hz"):
        read_sample_table(Path(f"{tmp_path / 'FLIGHT.ULG'}::3"))


@pytest.mark.slow
def test_a_topic_of_several_sensors_or_bodies_or_without_times_is_refused(tmp_path: Path) -> None:
    with pytest.raises(Refused, match=r"bag_topic: the messages of '/imu' are of several .* 'left' and 'right'"):
        read_samples(mcap(tmp_path / "two", frames=("left", "right")))
    with pytest.raises(Refused, match=r"bag_topic: the messages of '/imu' have no time"):
        read_samples(mcap(tmp_path / "unset", seconds=[0] * 100))


@pytest.mark.slow
def test_a_clock_that_was_set_back_is_refused_in_bags_and_logs_as_in_tables(tmp_path: Path) -> None:
    """The two parts of the recording would be mixed."""
    seconds = [*range(100, 150), *range(120, 170)]
    with pytest.raises(Refused, match=r"time_not_increasing: .* in sample 51: the clock was set back by about 30 s"):
        read_samples(mcap(tmp_path / "bag", seconds=seconds))
    write_ulog(tmp_path / "log.ulg", 10**6 * np.array(seconds), np.arange(300.0).reshape(100, 3), np.ones((100, 3)))
    with pytest.raises(Refused, match=r"time_not_increasing: .* in sample 51: the clock was set back by about 30 s"):
        read_samples(tmp_path / "log.ulg")


@pytest.mark.slow
def test_accelerations_of_a_log_are_not_continued_over_their_gaps(tmp_path: Path) -> None:
    time_us, rates, forces = np.arange(400) * 5000, np.ones((400, 3)), np.arange(1200.0).reshape(400, 3)
    write_ulog(tmp_path / "gap.ulg", time_us, rates, forces, forces_at=np.r_[0:100, 200:400])
    table = read_sample_table(tmp_path / "gap.ulg")
    assert table.columns["x_m_s2"] == pytest.approx(forces[np.r_[0:100, 200:400], 0]) and table.others == 100
    write_ulog(tmp_path / "half.ulg", time_us, rates, forces, forces_at=np.r_[0:150])
    table = read_sample_table(tmp_path / "half.ulg")
    assert len(table.columns["x_rad_s"]) == 400 and "x_m_s2" not in table.columns
    assert table.note == "sensor_accel 0 has readings at 38% of the times of sensor_gyro 0: it is not read"


@pytest.mark.slow
def test_a_log_of_an_accelerometer_alone_is_read(tmp_path: Path) -> None:
    forces = np.arange(300.0).reshape(100, 3)
    write_ulog(tmp_path / "log.ulg", np.arange(100) * 5000, np.ones((100, 3)), forces, rates_at=np.r_[0:0])
    samples = read_samples(tmp_path / "log.ulg")
    assert [*samples.readings] == [ACCELERATION] and samples.readings[ACCELERATION] == pytest.approx(forces)


@pytest.mark.slow
def test_readings_of_two_sensors_under_one_number_of_a_log_are_refused(tmp_path: Path) -> None:
    readings = np.ones((100, 3))
    write_ulog(tmp_path / "log.ulg", np.arange(100) * 5000, readings, readings, devices=np.repeat([1234, 77], 50))
    with pytest.raises(Refused, match=r"ulog_topic: sensor_gyro 0 holds readings of 2 sensors: device_id 77, 1234"):
        read_samples(tmp_path / "log.ulg")


@pytest.mark.slow
def test_a_log_whose_sensors_state_no_time_of_their_samples_has_the_times_of_its_messages(tmp_path: Path) -> None:
    readings = np.ones((100, 3))
    write_ulog(tmp_path / "log.ulg", np.arange(100) * 5000, readings, readings, sampled_us=0)
    assert np.diff(read_samples(tmp_path / "log.ulg").time_s) == pytest.approx(np.full(99, 0.005))


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["jsonschema", "protobuf"])
def test_a_bag_whose_messages_are_not_those_of_ros_is_named_so(encoding: str, tmp_path: Path) -> None:
    path = mcap(tmp_path / "bag")
    (file,) = path.glob("*.mcap")
    file.write_bytes(file.read_bytes().replace(b"\x07\0\0\0ros2msg", struct.pack("<I", 7) + encoding[:7].encode()))
    with pytest.raises(Refused, match=f"no_file: .* a topic has a schema of another kind than ROS's: '{encoding[:7]}'"):
        read_samples(path)
