"""`rig look` says what a file holds, and the map that it writes solves the file as its plain form does."""

import json
import re
import shlex
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from rig.analysis.external.convention import find_convention
from rig.analysis.log_contents import look_at
from rig.commands.offline import look
from rig.config.column_map import ColumnMap
from rig.errors import Refused
from rig.report.terminal.look_lines import describe_file
from support.external.csv_tables import write_table
from support.external.robot_log import MATRIX, make_log, write_log
from support.external.turned_body import Hand, turn
from support.external.ulog_writer import write_ulog
from support.laboratories.commands import rig_here
from support.paths import DOCS

pytestmark = pytest.mark.slow

SWEEPS = DOCS / "examples" / "sweeps.csv"
PLAIN = DOCS / "examples" / "samples.csv"
TABLE = np.genfromtxt(PLAIN, delimiter=",", names=True)
TIME_S = TABLE["time_s"]
RATES_DEG_S = np.degrees(np.column_stack([TABLE[f"{axis}_rad_s"] for axis in "xyz"]))


def write(path: Path, heading: str, columns: list[np.ndarray], divided: str = ",") -> Path:
    rows = [divided.join(f"{cell:.12g}" for cell in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([*([heading] if heading else []), *rows]) + "\n", encoding="utf-8")
    return path


def spaces(folder: Path) -> Path:
    return write(folder / "log.txt", "", [TIME_S, *RATES_DEG_S.T], "   ")


def two_imus(folder: Path) -> Path:
    other = np.full_like(RATES_DEG_S, 0.5)
    return write(folder / "log.csv", "logger 3\n\nt,gx,gy,gz,gx,gy,gz", [TIME_S, *RATES_DEG_S.T, *other.T])


def counter(folder: Path) -> Path:
    ticks = (np.rint(1e6 * TIME_S) + 2**32) % 2**32
    return write(folder / "log.csv", "micros;gyroX [°/s];gyroY [°/s];gyroZ [°/s]", [ticks, *RATES_DEG_S.T], ";")


def matlab(folder: Path) -> Path:
    savemat(folder / "log.mat", {"imu": {"t": TIME_S, "gyro": RATES_DEG_S}, "fs": 50.0})
    return folder / "log.mat"


def workspace(folder: Path) -> Path:
    """A log among other variables of a workspace, with a row of NaN."""
    rates = np.vstack([RATES_DEG_S, np.full((1, 3), np.nan)])
    time_s = np.append(TIME_S, TIME_S[-1] + 0.02)
    others = {"raw": np.ones((2, len(TIME_S) + 300)), "axes": np.eye(3), "k": np.eye(3), "home": np.eye(4)}
    savemat(folder / "log.mat", {**others, "t": time_s, "gyro": rates})
    return folder / "log.mat"


def units_below(folder: Path) -> Path:
    return write(folder / "log.csv", "t;Gx;Gy;Gz\ns;°/s;°/s;°/s", [TIME_S, *RATES_DEG_S.T], ";")


def telephone(folder: Path) -> Path:
    """A second clock behind the first one, and the axes from last to first, as an app for telephones writes them."""
    heading = "time,seconds_elapsed,z [°/s],y [°/s],x [°/s]"
    return write(folder / "log.csv", heading, [TIME_S, TIME_S - TIME_S[0], *RATES_DEG_S.T[::-1]])


@pytest.fixture(scope="module")
def plain_scale() -> list[float]:
    """The scale factors of the same readings in a file of the rig's own."""
    plain = rig_here("solve", PLAIN, "--sweeps", SWEEPS, "--json")
    scale: list[float] = json.loads(plain.stdout)["gyroscopes"]["imu"]["scale"]
    return scale


@pytest.mark.parametrize("make", [two_imus, counter, matlab, workspace, units_below, telephone])
def test_the_map_that_it_writes_solves_the_file(
    make: Callable[[Path], Path], plain_scale: list[float], tmp_path: Path
) -> None:
    log, columns = make(tmp_path), tmp_path / "columns.yaml"
    looked = rig_here("look", log, "--write", columns)
    assert looked.returncode == 0, looked.stderr
    assert "50 Hz over 65.0 s" in looked.stdout and f"written: {columns}" in looked.stdout
    solved = rig_here("solve", log, "--sweeps", SWEEPS, "--columns", columns, "--json")
    assert solved.returncode == 0, solved.stderr
    scale = json.loads(solved.stdout)["gyroscopes"]["imu"]["scale"]
    assert scale == pytest.approx(plain_scale, rel=1e-6)


def test_columns_without_a_name_are_no_gyroscope_before_the_user_says_so(tmp_path: Path) -> None:
    log, columns = spaces(tmp_path), tmp_path / "columns.yaml"
    looked = rig_here("look", log, "--write", columns)
    assert "UNKNOWN       what 2 3 4 are" in looked.stdout and "what it allows" not in looked.stdout
    assert f'replace each "?" in the map, then: rig look {log} --columns {columns}' in looked.stdout
    columns.write_text(columns.read_text(encoding="utf-8").replace("'?'", "deg/s"), encoding="utf-8")
    looked = rig_here("look", log, "--columns", columns)
    assert f"rig solve {log} --sweeps SWEEPS.csv --columns {columns}" in looked.stdout, looked.stderr


def test_a_telephone_s_magnetometer_is_called_what_it_may_be(tmp_path: Path) -> None:
    field_ut = 40 * np.column_stack([np.cos(TIME_S), np.sin(TIME_S), 0.5 + 0.01 * np.sin(3 * TIME_S)])
    looked = look_at(write(tmp_path / "log.csv", "time,x,y,z", [TIME_S, *field_ut.T]))
    assert looked.guess is not None and looked.samples is None
    (gap,) = looked.guess.gaps
    assert "size is about 44.7" in gap and "x_t y_t z_t for a magnetometer" in gap
    assert not any(line.strip().startswith("gyroscope") for line in describe_file(looked))


def test_counts_whose_size_is_that_of_the_field_are_no_magnetometer_unless_a_name_says_so(tmp_path: Path) -> None:
    counts = 32_600 + np.rint(100 * np.column_stack([np.sin(TIME_S), np.cos(TIME_S), np.sin(2 * TIME_S)]))
    for name, is_field in (("omega", False), ("mag_raw", True)):
        savemat(tmp_path / "log.mat", {"t": TIME_S, name: counts})
        guess = look_at(tmp_path / "log.mat").guess
        assert guess is not None and ("x_t" in guess.samples) == is_field


LAYOUT = [*(0.1 * RATES_DEG_S.T), *np.tile([[0.1], [0.2], [9.8]], (1, len(TIME_S)))]
CLOCKS = {  # heading, numbers, unit
    "a unit in words": ("Time since start in ms", 1e3 * TIME_S, "ms"),
    "a counter of milliseconds as large as seconds since 1970": ("t", 1_754_197_727 + np.rint(1e3 * TIME_S), "ms"),
    "microseconds, of which one lost a digit": ("t", np.where(TIME_S[200] == TIME_S, 98e6, 987e6 + 1e6 * TIME_S), "us"),
    "nanoseconds since 1970 of another kind": ("stamp", 951_412_773_297_707 + 1e9 * TIME_S, "ns"),
    "rows that come a little late": ("time[s]", TIME_S + 0.03 * (np.arange(len(TIME_S)) % 40 == 7), "s"),
}


@pytest.mark.parametrize("name", CLOCKS)
def test_the_unit_of_a_clock_is_found(name: str, tmp_path: Path) -> None:
    heading, times, unit = CLOCKS[name]
    path = write(tmp_path / "log.csv", f"{heading},gx,gy,gz,ax,ay,az", [times, *LAYOUT])
    guess = look_at(path).guess
    assert guess is not None and guess.samples["time_s"] == {"column": heading, "unit": unit}


def test_the_number_of_a_packet_is_no_time(tmp_path: Path) -> None:
    numbers = 8 * np.arange(len(TIME_S)) + np.arange(len(TIME_S)) % 2
    path = write(tmp_path / "log.csv", "Packet number,gx,gy,gz,ax,ay,az", [numbers, *LAYOUT])
    guess = look_at(path).guess
    assert guess is not None and "time_s" not in guess.samples and "gyro" not in guess.others
    assert any("no column of time" in gap for gap in guess.gaps)


def test_a_blank_cell_at_the_end_of_each_row_is_no_column(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", "t,gx,gy,gz,ax,ay,az", [TIME_S, *LAYOUT])
    ended = [f"{line}," if index else line for index, line in enumerate(path.read_text("utf-8").splitlines())]
    path.write_text("\n".join(ended) + "\n", encoding="utf-8")
    guess = look_at(path).guess
    assert guess is not None and guess.samples["x_rad_s"]["column"] == "gx"


def test_a_sensor_that_a_slow_logger_reads_while_it_turns_was_not_at_rest(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    path = write(
        tmp_path / "log.csv", "time_s,x_rad_s,y_rad_s,z_rad_s", [np.arange(400) / 10, *rng.normal(0, 0.4, (3, 400))]
    )
    assert "at rest       no: the rate scatters by 0.4" in rig_here("look", path).stdout
    assert "not_at_rest" in rig_here("allan", path).stderr


def test_decimal_commas_between_commas_are_suspected(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(
        "t,gx,gy,gz\n" + "0,02,0,48,-0,29,0,23\n0,04,0,51,-0,27,0,18\n" * 20, encoding="utf-8"
    )
    guess = look_at(tmp_path / "log.csv").guess
    assert guess is not None and "decimal comma" in guess.gaps[-1]


def test_attitudes_in_the_rig_s_own_words_need_no_part_in_the_log_s_map() -> None:
    samples = {f"{axis}_rad_s": {"column": f"g{axis}", "unit": "deg/s"} for axis in "xyz"}
    looked = look_at(DOCS / "examples" / "still_attitudes.csv", ColumnMap.model_validate({"samples": samples}))
    assert looked.attitudes is not None and not looked.refusals


def test_a_run_is_no_log_and_its_own_commands_are_named(tmp_path: Path) -> None:
    run = tmp_path / "my run"
    run.mkdir()
    (run / "run.h5").write_bytes(b"")
    for path in (run, run / "run.h5"):
        with pytest.raises(Refused, match=r"is a run of this program.*rig show '.*/my run' --all.*rig export"):
            look.run(Namespace(files=[path], columns=None, write=None))


def test_a_file_in_the_rig_s_own_words_needs_no_map(tmp_path: Path) -> None:
    done = rig_here("look", PLAIN, "--write", tmp_path / "columns.yaml")
    assert "no map is needed" in done.stdout and "UNKNOWN" not in done.stdout
    assert not (tmp_path / "columns.yaml").exists()


def test_steps_of_a_converter_are_left_to_the_user(tmp_path: Path) -> None:
    log = write(tmp_path / "log.csv", "t,gx,gy,gz", [TIME_S, *np.rint(131 * RATES_DEG_S).T])
    columns = tmp_path / "columns.yaml"
    looked = rig_here("look", log, "--write", columns)
    assert "UNKNOWN       the unit of the gyroscope: steps of a converter" in looked.stdout
    solved = rig_here("solve", log, "--sweeps", SWEEPS, "--columns", columns)
    assert solved.returncode == 2 and "lsb_per_unit" in solved.stderr, "what is open is refused"
    columns.write_text(columns.read_text(encoding="utf-8").replace("'?'", "131"), encoding="utf-8")
    assert rig_here("solve", log, "--sweeps", SWEEPS, "--columns", columns).returncode == 0


def test_an_accelerometer_shows_the_units_of_both(tmp_path: Path) -> None:
    log = make_log()
    rates, forces = np.rint(65.5 * log.rates_deg_s), np.rint(8192 * log.forces_g)
    path = write(tmp_path / "log.csv", "", [1e-3 * log.time_ms, *rates.T, *forces.T])
    guess = look_at(path).guess
    assert guess is not None
    assert guess.samples["x_rad_s"] == {"column": 2, "unit": "deg/s", "lsb_per_unit": 65.5}
    assert guess.samples["x_m_s2"] == {"column": 5, "unit": "g", "lsb_per_unit": 8192}


def test_a_unit_that_gravity_contradicts_is_reported(tmp_path: Path) -> None:
    log = make_log()
    columns = [1e-3 * log.time_ms, *log.rates_deg_s.T, *(9.80665 * log.forces_g).T]
    path = write(tmp_path / "log.csv", "t,gx [dps],gy [dps],gz [dps],ax [g],ay [g],az [g]", columns)
    guess = look_at(path).guess
    assert guess is not None and guess.samples["x_m_s2"]["unit"] == "m/s2"
    assert any("the heading says g, but at rest it reads 9.8" in gap for gap in guess.gaps)


@pytest.mark.one_in(3)  # neither, and both at once
@pytest.mark.parametrize("inverse", [False, True])
@pytest.mark.parametrize("scalar_last", [False, True])
def test_the_convention_of_quaternions_is_found(inverse: bool, scalar_last: bool, tmp_path: Path) -> None:
    log = make_log()
    poses = log.poses if inverse else log.poses * [1, -1, -1, -1]
    poses = np.roll(poses, -1, axis=1) if scalar_last else poses
    write_log(log, tmp_path)
    samples = look_at(tmp_path / "robot_log.txt").samples
    attitudes = look_at(write(tmp_path / "poses.csv", "time,a,b,c,d", [log.pose_s, *poses.T])).attitudes
    assert samples is not None and attitudes is not None
    convention = find_convention(samples, attitudes, is_order_named=False)
    assert convention is not None
    assert (convention.inverse, convention.scalar_last, convention.up) == (inverse, scalar_last, "+z")
    assert convention.lag_s == pytest.approx(0.084, abs=0.005)


@pytest.mark.parametrize("inverse", [False, True])
def test_the_direction_of_many_noisy_poses_is_found(inverse: bool, tmp_path: Path) -> None:
    log = make_log()
    write_log(log, tmp_path)
    noise = Rotation.from_rotvec(np.random.default_rng(3).normal(0, 0.01, (len(log.time_s), 3)))
    true = log.attitudes * noise  # rates from row to row are mostly noise
    poses = (true.inv() if inverse else true).as_quat(scalar_first=True)
    samples = look_at(tmp_path / "robot_log.txt").samples
    attitudes = look_at(write(tmp_path / "poses.csv", "time,qw,qx,qy,qz", [log.time_s, *poses.T])).attitudes
    assert samples is not None and attitudes is not None
    convention = find_convention(samples, attitudes, is_order_named=True)
    assert convention is not None and convention.inverse == inverse


def test_row_numbers_and_positions_of_a_pose_file_are_no_gyroscope(tmp_path: Path) -> None:
    log = make_log()
    write_log(log, tmp_path)
    numbers, still = np.arange(len(log.pose_s)), np.full(len(log.pose_s), 0.4)
    columns = [numbers, log.pose_s, still, still + 1e-3 * np.sin(log.pose_s), still, *(log.poses * [1, -1, -1, -1]).T]
    poses = write(tmp_path / "poses.csv", ",time,x,y,z,qw,qx,qy,qz", columns)
    looked = rig_here("look", tmp_path / "robot_log.txt", poses).stdout.partition(f"{poses}:")[2]
    assert "gyroscope" not in looked.partition("what it allows:")[0] and "not read      column 1 x y z" in looked
    assert "direction     body to room: " in looked  # the headings say which number is which


def test_a_file_of_attitudes_counts_before_those_in_the_log(tmp_path: Path) -> None:
    log, columns = make_log(), tmp_path / "columns.yaml"
    write_log(log, tmp_path)
    interpolated = np.tile([0.5, 0.0, 0.0, 0.0], (len(log.time_ms), 1))  # through zero, between q and -q
    readings = {"t": log.time_ms / 1e3, "gyro": log.rates_deg_s, "acc": log.forces_g}
    savemat(tmp_path / "log.mat", {**readings, "quat": interpolated})
    looked = rig_here("look", tmp_path / "log.mat", tmp_path / "robot_poses.csv", "--write", columns)
    assert "attitudes     rig solve " in looked.stdout, looked.stdout
    assert "direction     room to body (motion_inverse)" in looked.stdout and "quat" not in columns.read_text("utf-8")


def test_a_workspace_with_interpolated_poses_is_solved_by_the_printed_command(tmp_path: Path) -> None:
    log, path, columns = make_log(), tmp_path / "log.mat", tmp_path / "columns.yaml"
    poses = log.poses * np.where(np.arange(len(log.pose_s)) < 400, 1, -1)[:, None]  # the same attitudes
    by_row = np.column_stack([np.interp(log.time_ms / 1e3, log.pose_s, column) for column in poses.T])
    assert np.linalg.norm(by_row, axis=1).min() < 0.9  # between q and -q
    table = {"SENSgyro": log.rates_deg_s.T, "SENSacc": log.forces_g.T, "MATLABtime": log.time_ms / 1e3}
    raw = np.random.default_rng(1).normal(size=(12, len(log.time_ms) + 300))  # more columns, without a sensor's name
    savemat(path, {**table, "ABBquaternion": by_row.T, "s_read": raw, "cycle_time": np.arange(raw.shape[1]) / 40})
    looked = rig_here("look", path, "--write", columns).stdout
    assert re.search(r"left out +\d+ of \d+ rows, they are interpolated between the attitudes", looked), looked
    assert "direction     room to body (motion_inverse)" in looked
    (command,) = re.findall(r"^ +attitudes +rig (solve .*)$", looked, re.MULTILINE)
    solved = rig_here(*shlex.split(command), "--json")
    assert solved.returncode == 0, solved.stderr
    result = json.loads(solved.stdout)
    gyroscope = result["gyroscopes"]["imu"]
    error = np.array(gyroscope["scale"]) - 1 / np.linalg.norm(MATRIX, axis=1)
    assert (np.abs(error) < np.array(gyroscope["budget"]["expanded"][:3])).all(), (error, gyroscope["budget"])
    assert any("interpolated" in omitted["reason"] for omitted in result["omitted"]["imu"])


def test_gravity_shows_the_direction_if_the_body_turns_about_one_axis_at_a_time(tmp_path: Path) -> None:
    time_s = np.arange(0, 24, 0.01)
    angles = np.zeros((len(time_s), 3))
    for number in range(6):  # a quarter turn about x, back, about y, back, about z, back: each the other's inverse
        part = np.clip((time_s - 1 - 4 * number) / 2, 0, 1)
        angles[:, number // 2] += (-1) ** number * np.pi / 2 * part**3 * (10 - 15 * part + 6 * part**2)
    attitudes = Rotation.from_rotvec(angles)
    forces = attitudes.inv().apply([0, 0, 9.8])
    savemat(tmp_path / "log.mat", {"t": time_s, "gyro": np.gradient(angles, time_s, axis=0), "acc": forces})
    samples = look_at(tmp_path / "log.mat").samples
    assert samples is not None
    for inverse in (False, True):
        poses = (attitudes.inv() if inverse else attitudes)[::7].as_quat(scalar_first=True)
        rows = look_at(write(tmp_path / "poses.csv", "time,qw,qx,qy,qz", [time_s[::7], *poses.T])).attitudes
        assert rows is not None
        convention = find_convention(samples, rows, is_order_named=True)
        assert convention is not None and convention.inverse == inverse


def test_attitudes_show_the_unit_of_a_gyroscope_that_turns_slowly_below_two_lines_of_headings(tmp_path: Path) -> None:
    log, path, columns = make_log(), tmp_path / "log.csv", tmp_path / "columns.yaml"
    time_s = log.time_s[log.time_s < log.pose_s[-1]]
    poses = log.attitudes.as_quat(scalar_first=True)[: len(time_s)]
    poses[:50] = 0.0  # the cameras had not found the body yet
    poses[1000] *= 0.99
    table = np.column_stack([time_s, poses, np.radians(log.rates_deg_s)[: len(time_s)]])
    heading = "Time (s);Vicon Orientation;;;;IMU Gyroscope;;;\n;W;X;Y;Z;X;Y;Z;"
    rows = [";".join(f"{cell:.8g}" for cell in row) for row in table]
    path.write_text("\n".join([heading, *rows]) + "\n", encoding="utf-8")
    looked = rig_here("look", path, "--write", columns).stdout
    assert "the heading has two lines: columns are named by number" in looked, looked
    assert "gyroscope     6 7 8                    rad/s" in looked and "by size" not in looked
    assert "their quaternions are zero or no numbers: the reference had no attitude; the first row 1" in looked
    assert "left out      1 of 2360 rows, their quaternions are not of unit length; the first row 1001" in looked
    (command,) = re.findall(r"^ +attitudes +rig (solve .*)$", looked, re.MULTILINE)
    result = json.loads(rig_here(*shlex.split(command), "--json").stdout)
    gyroscope = result["gyroscopes"]["imu"]
    error = np.array(gyroscope["scale"]) - 1 / np.linalg.norm(MATRIX, axis=1)
    assert (np.abs(error) < np.array(gyroscope["budget"]["expanded"][:3])).all(), (error, gyroscope["budget"])


def test_turns_have_their_times_as_the_file_of_sweeps_needs_them(tmp_path: Path) -> None:
    session = turn(Hand(np.vstack([np.eye(3), -np.eye(3)])), seed=1)
    time_s = 1_800_000_000 + session.time_s
    log = write(tmp_path / "log.csv", "time_s,x_rad_s,y_rad_s,z_rad_s", [time_s, *session.readings.T])
    looked = rig_here("look", log).stdout
    found = re.findall(r"^ +(\d+\.\d\d) +(\d+\.\d\d) +([+-])([xyz]) +(\d+\.\d)°$", looked, re.MULTILINE)
    assert [sign + axis for *_, sign, axis, _ in found] == ["+x", "+y", "+z", "-x", "-y", "-z"]
    rows = [
        [float(start), float(end), *(float(f"{sign}1") * np.eye(3)["xyz".index(axis)]), 2 * np.pi]
        for start, end, sign, axis, _ in found
    ]
    assert all(float(angle) == pytest.approx(360, abs=40) for *_, angle in found)
    columns = ("start_s", "end_s", "axis_x", "axis_y", "axis_z", "angle_rad")
    sweeps = write_table(tmp_path / "sweeps.csv", columns, np.array(rows))
    solved = rig_here("solve", log, "--sweeps", sweeps, "--json")
    scale = json.loads(solved.stdout)["gyroscopes"]["imu"]["scale"]
    assert scale == pytest.approx(1 / np.linalg.norm(session.matrix, axis=1), rel=5e-3)


def test_gaps_are_told_with_row_and_time(tmp_path: Path) -> None:
    kept = np.r_[0:1000, 1009 : len(TIME_S)]
    log = write(
        tmp_path / "log.csv", "time_s,x_rad_s,y_rad_s,z_rad_s", [TIME_S[kept], *np.radians(RATES_DEG_S[kept]).T]
    )
    looked = rig_here("look", log).stdout
    assert "9 samples are missing in 1 gaps, the longest 0.2 s, after sample 1000, at 19.98 s" in looked


def test_a_unit_by_size_is_marked(tmp_path: Path) -> None:
    for unit, rates in (("rad/s", np.radians(RATES_DEG_S)), ("deg/s", RATES_DEG_S)):
        guess = look_at(write(tmp_path / "log.csv", "t,gx,gy,gz", [TIME_S, *rates.T])).guess
        assert guess is not None and guess.samples["x_rad_s"]["unit"] == unit
        assert any(f"{unit} by size alone" in gap for gap in guess.gaps)


def test_a_file_without_numbers_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("Dear diary,\ntoday it rained.\n" * 20, encoding="utf-8")
    done = rig_here("look", tmp_path / "notes.txt")
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1 and "wrong_columns" in done.stderr


def test_an_accelerometer_that_reads_zero_has_no_gravity(tmp_path: Path) -> None:
    rates = np.random.default_rng(1).normal(0, 1e-3, (400, 3))
    write_ulog(tmp_path / "log.ulg", np.arange(400) * 10_000, rates, np.zeros((400, 3)))
    assert "gravity in 0 directions" in rig_here("look", tmp_path / "log.ulg").stdout


def test_a_file_of_sweeps_is_no_log() -> None:
    done = rig_here("look", SWEEPS)
    assert done.returncode == 2 and f"rig solve LOG --sweeps {SWEEPS}" in done.stderr


def test_angles_of_an_attitude_are_no_gyroscope(tmp_path: Path) -> None:
    log = write(tmp_path / "poses.csv", "time,yaw,pitch,roll", [TIME_S, *RATES_DEG_S.T])
    looked = look_at(log)
    assert looked.guess is not None and not looked.guess.samples
    assert any("quaternions" in gap for gap in looked.guess.gaps)


def test_a_log_with_the_rigs_names_and_counts_of_a_thermometer_is_mapped_without_these(tmp_path: Path) -> None:
    counts = np.rint(-3920 + TIME_S)
    log = write(
        tmp_path / "log.csv", "time_s,x_rad_s,y_rad_s,z_rad_s,temp", [TIME_S, *np.radians(RATES_DEG_S).T, counts]
    )
    looked = look_at(log)
    assert not looked.refusals and looked.samples is not None and looked.samples.temperature_c is None
