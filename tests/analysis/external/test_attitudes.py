"""`rig solve SAMPLES.csv --attitudes ATTITUDES.csv`: the second paper's laboratory, and files that are wrong."""

import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.cli import main
from rig.estimation.arrays import Array
from rig.study.rate_table import (
    ACCELEROMETER_BIAS_M_S2,
    ACCELEROMETER_MATRIX,
    ACCELEROMETER_REFERENCE_M_S2,
    ACCELEROMETER_SECOND_ORDER,
    GYRO_BIAS_RAD_S,
    GYRO_MATRIX,
    GYRO_REFERENCE_RAD_S,
)
from support.external.rate_table_files import FIELD_BIAS_T, FIELD_MATRIX, FIELD_T, write_all
from support.paths import DOCS

EXAMPLES = DOCS / "examples"
PLACE = ["--up=-z", "--gravity-m-s2", str(np.linalg.norm(ACCELEROMETER_REFERENCE_M_S2))]
STILL, SWINGING = ("still_samples.csv", "still_attitudes.csv"), ("swinging_samples.csv", "swinging_attitudes.csv")

ACCELEROMETER = (
    ACCELEROMETER_MATRIX,
    ACCELEROMETER_REFERENCE_M_S2,
    ACCELEROMETER_BIAS_M_S2,
    ACCELEROMETER_SECOND_ORDER,
)

Table = list[dict[str, str]]


def solve(files: Sequence[Path], *options: str) -> list[str]:
    return ["solve", str(files[0]), "--attitudes", str(files[1]), *options]


def solved(capsys: pytest.CaptureFixture[str], files: Sequence[Path], *options: str) -> dict[str, dict[str, Array]]:
    """Values and standard deviations of every quantity."""
    assert main([*solve(files, *options), "--json"]) == 0, capsys.readouterr().err
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "rig.result/1"
    parts: dict[str, Any] = {}
    for rate in document["gyroscopes"].values():
        earth = rate["in_attitudes"]["earth_rate_rad_s"]
        told = [rate["vector_model"]["matrix"], earth, np.negative(rate["bias_rad_s"])]
        parts["rate"] = told, rate["in_attitudes"]
    for at_rest in document.get("accelerometers", {}).values():
        told = [at_rest["matrix"], at_rest["reference_m_s2"], at_rest["bias_m_s2"], at_rest["second_order_s2_m"] or ()]
        parts["acceleration"] = told, at_rest["placement"]
    for at_rest in document.get("magnetometers", {}).values():
        parts["field"] = [at_rest["matrix"], at_rest["field_base_t"], at_rest["bias_t"]], at_rest["placement"]
    found = {}
    for quantity, (told, known) in parts.items():
        theta = np.concatenate([np.ravel(each) for each in told])
        found[quantity] = {"theta": theta, "std": np.sqrt(np.diag(known["covariance"]))}
        assert len(known["covariance_order"]) == len(known["covariance"]) == len(theta)
    return found


def example(names: Sequence[str]) -> list[Path]:
    return [EXAMPLES / name for name in names]


def off(found: dict[str, Array], *truth: Array) -> float:
    """The largest error in standard deviations."""
    error = found["theta"] - np.concatenate([np.ravel(each) for each in truth])
    return float(np.max(np.abs(error) / np.maximum(found["std"], 1e-12)))


def test_the_examples_are_what_their_script_makes(tmp_path: Path) -> None:
    write_all(tmp_path)
    for path in sorted(tmp_path.iterdir()):
        assert path.read_text(encoding="utf-8") == (EXAMPLES / path.name).read_text(encoding="utf-8"), path.name


@pytest.mark.slow
def test_the_papers_accelerometer_and_a_magnetometer_are_found(capsys: pytest.CaptureFixture[str]) -> None:
    field = ["--field-t", str(np.linalg.norm(FIELD_T))]
    found = solved(capsys, example(STILL), *PLACE, *field, "--second-order")
    assert off(found["acceleration"], *ACCELEROMETER) < 4
    assert off(found["field"], FIELD_MATRIX, FIELD_T, FIELD_BIAS_T) < 4


@pytest.mark.slow
def test_the_papers_gyroscope_is_found_with_the_earths_rate(capsys: pytest.CaptureFixture[str]) -> None:
    found = solved(capsys, example(SWINGING), "--exact-rates")["rate"]
    assert off(found, GYRO_MATRIX, GYRO_REFERENCE_RAD_S, GYRO_BIAS_RAD_S) < 4
    assert found["std"][9:12].max() < 0.1 * np.linalg.norm(GYRO_REFERENCE_RAD_S)


def on_another_clock(folder: Path, late_s: float, fast: float, *, rates: bool = True) -> list[Path]:
    """The swinging example when the sensor's clock is so late and runs so much faster."""
    samples, attitudes = folder / "samples.csv", folder / "attitudes.csv"
    columns, *rows = (EXAMPLES / SWINGING[0]).read_text(encoding="utf-8").splitlines()
    cells = [row.split(",", 1) for row in rows]
    shifted = [f"{float(time_s) * (1 + fast) + late_s!r},{readings}" for time_s, readings in cells]
    samples.write_text("\n".join([columns, *shifted]) + "\n", encoding="utf-8")
    lines = (EXAMPLES / SWINGING[1]).read_text(encoding="utf-8").splitlines()
    kept = lines if rates else [",".join(line.split(",")[:6]) for line in lines]
    attitudes.write_text("\n".join(kept) + "\n", encoding="utf-8")
    return [samples, attitudes]


@pytest.mark.slow
def test_the_clock_of_a_table_is_found_by_the_turning_both_saw(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = on_another_clock(tmp_path, late_s=-731.25, fast=4e-4)
    assert main([*solve(files, "--estimate-clock-offset"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    rate = found["gyroscopes"]["imu"]
    (clock,) = rate["time_bases"]
    read_s = clock["reference_board_s"]
    off_s = read_s + clock["offset_s"] - (read_s + 731.25) / (1 + 4e-4)
    assert abs(off_s) < 4 * clock["offset_std_s"] < 1e-3
    assert abs(clock["drift"] + 4e-4) < 4 * clock["drift_std"] + 4e-7
    assert np.allclose(rate["vector_model"]["matrix"], GYRO_MATRIX, atol=1e-4)
    assert main(solve(files, "--estimate-clock-offset", "--all")) == 0
    assert "the samples' clock on the table's: +731." in capsys.readouterr().out


@pytest.mark.slow
def test_the_papers_gyroscope_is_found_without_its_rates(capsys: pytest.CaptureFixture[str]) -> None:
    found = solved(capsys, example(SWINGING))["rate"]
    assert off(found, GYRO_MATRIX, GYRO_REFERENCE_RAD_S, GYRO_BIAS_RAD_S) < 4


@pytest.mark.slow
def test_quaternions_alone_tell_the_clock_and_the_sensor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = on_another_clock(tmp_path, late_s=12.5, fast=0.0, rates=False)
    assert main([*solve(files, "--estimate-clock-offset"), "--json"]) == 0
    rate = json.loads(capsys.readouterr().out)["gyroscopes"]["imu"]["vector_model"]
    std = np.sqrt(np.diag(rate["matrix_covariance"]))
    assert (np.abs(np.ravel(rate["matrix"]) - np.ravel(GYRO_MATRIX)) < 4 * std[:9]).all()


def test_a_file_of_stops_alone_tells_no_clock(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(solve([EXAMPLES / SWINGING[0], EXAMPLES / STILL[1]], "--estimate-clock-offset")) == 2
    assert "time_base_not_found: of 16 rows, only 0 follow the row before" in capsys.readouterr().err
    assert main(solve(example(STILL), "--estimate-clock-offset")) == 2
    assert "wrong_columns: the samples contain no turn rate" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("estimator", ["as_published", "maximum_likelihood", "attitude_weighted"])
def test_any_estimator_can_be_asked_for(estimator: str, capsys: pytest.CaptureFixture[str]) -> None:
    found = solved(capsys, example(STILL), *PLACE, "--estimator", estimator, "--second-order")
    assert off(found["acceleration"], *ACCELEROMETER) < 4


@pytest.mark.slow
def test_people_read_what_was_found_and_what_was_not(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(solve(example(STILL), *PLACE, "--all")) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "estimated attitude error:" in said and "as_published, attitudes alone: k" in said
    assert "imu, magnetometer, not calibrated: field_strength_unknown:" in said


def read(path: Path) -> Table:
    names, *rows = (line.split(",") for line in path.read_text(encoding="utf-8").splitlines())
    return [dict(zip(names, row, strict=True)) for row in rows]


def written(path: Path, table: Table) -> Path:
    path.write_text(
        "\n".join([",".join(table[0]), *(",".join(row.values()) for row in table)]) + "\n", encoding="utf-8"
    )
    return path


Change = Callable[[Table], Table]


def each(change: Callable[[dict[str, str]], dict[str, str]]) -> Change:
    return lambda table: [change(row) for row in table]


def times(factor: float, *names: str) -> Change:
    return each(lambda row: {**row, **{name: repr(factor * float(row[name])) for name in names}})


def renamed(old: str, new: str) -> Change:
    return each(lambda row: {new if name == old else name: value for name, value in row.items()})


def swapped(first: str, second: str) -> Change:
    return each(lambda row: {**row, first: row[second], second: row[first]})


def quaternion(row: dict[str, str], rotation: Rotation) -> dict[str, str]:
    x, y, z, w = rotation.as_quat().tolist()
    return {**row, "qw": repr(w), "qx": repr(x), "qy": repr(y), "qz": repr(z)}


def attitude(row: dict[str, str]) -> Rotation:
    return Rotation.from_quat([float(row[name]) for name in ("qx", "qy", "qz", "qw")])


def turned_by_two_degrees(table: Table) -> Table:
    """The seventh."""
    turned = attitude(table[6]) * Rotation.from_rotvec([2, 0, 0], degrees=True)
    return [*table[:6], quaternion(table[6], turned), *table[7:]]


def of_other_rows(table: Table) -> Table:
    return [quaternion(row, attitude(other)) for row, other in zip(table, reversed(table), strict=True)]


def interpolated_through_zero(table: Table) -> Table:
    """The seventh, halfway from q to the −q of a later row."""
    shorter = times(0.3, "qw", "qx", "qy", "qz")
    return [*table[:6], *shorter(table[6:7]), *times(-1, "qw", "qx", "qy", "qz")(table[7:])]


ACCELERATION = ("x_m_s2", "y_m_s2", "z_m_s2")
WRONG: dict[str, tuple[str, Change | None, Change | None]] = {
    "g for m/s²": ("wrong_unit: .* given as m/s²", times(1 / 9.80665, *ACCELERATION), None),
    "a column in g": ("wrong_unit: .* x_g instead of .*x_m_s2", renamed("x_m_s2", "x_g"), None),
    "mirrored axis": ("mirrored_axis", times(-1, "z_m_s2"), None),
    "two axes swapped": ("mirrored_axis", swapped("x_m_s2", "y_m_s2"), None),
    "quaternions of length 1.01": ("bad_quaternion: .* length 1.01", None, times(1.01, "qw", "qx", "qy", "qz")),
    "a quaternion between q and −q": ("bad_quaternion: .* attitude 7 has", None, interpolated_through_zero),
    "table to body": ("inverted_attitudes", None, times(-1, "qx", "qy", "qz")),
    "quaternions of a mirrored table": ("mirrored_axis", None, times(-1, "qx", "qy")),
    "scalar last": ("inverted_attitudes: .* in the order x y z w", None, each(
        lambda row: {**row, "qw": row["qx"], "qx": row["qy"], "qy": row["qz"], "qz": row["qw"]})),
    "another file of attitudes": ("attitude_untrustworthy", None, of_other_rows),
    "one attitude moved by 2°": ("attitude_untrustworthy: attitude 7 ", None, turned_by_two_degrees),
    "too few": ("too_few_observations", None, lambda table: table[:4]),
    "upside down": ("mirrored_axis", times(-1, *ACCELERATION), None),
    "not a number": ("not_a_number", lambda table: [{**table[0], "x_m_s2": "nan"}, *table[1:]], None),
    "shared samples": ("overlapping_attitudes", None, lambda table: [{**table[0], "end_s": "6"}, *table[1:]]),
    "end before start": ("bad_attitude_row", None, lambda table: [{**table[0], "end_s": "-1"}, *table[1:]]),
    "samples missing": (
        "lost_samples: attitude 1 ", lambda table: [row for row in table if float(row["time_s"]) % 5 > 2.5], None
    ),
    "no readings": ("wrong_columns: .* holds no readings", each(lambda row: {"time_s": row["time_s"]}), None),
    "negative uncertainty": ("bad_attitude_row", None, each(lambda row: {**row, "attitude_std_rad": "-0.001"})),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("what", WRONG)
def test_what_is_wrong_is_refused_by_name(what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name, samples, attitudes = WRONG[what]
    still = each(lambda row: {name: row[name] for name in ("time_s", *ACCELERATION)})
    tables = [still(read(EXAMPLES / STILL[0])), read(EXAMPLES / STILL[1])]
    files = [
        written(tmp_path / file, change(table) if change else table)
        for file, table, change in zip(STILL, tables, (samples, attitudes), strict=True)
    ]
    assert main(solve(files, *PLACE)) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert re.search(name, said), said


@pytest.mark.slow
def test_what_the_sensor_does_not_need_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """A linear sensor has no second order; nobody's rates are exact unless it is said."""
    assert main(solve(example(STILL), "--estimator", "vector")) == 2
    assert "unknown_estimator" in capsys.readouterr().err
    still = written(
        tmp_path / "still.csv",
        each(lambda row: {name: row[name] for name in ("start_s", "end_s", "qw", "qx", "qy", "qz")})(
            read(EXAMPLES / SWINGING[1])
        ),
    )
    assert main(solve([EXAMPLES / SWINGING[0], still], "--exact-rates")) == 2
    assert "no_rates" in capsys.readouterr().err
    assert main(solve(example(SWINGING), "--estimator", "maximum_likelihood")) == 2
    assert "no_rates" in capsys.readouterr().err


def felt_in(turned: Sequence[Rotation], folder: Path) -> list[Path]:
    """A linear sensor's readings, 4 s at 25 Hz in each attitude."""
    rng = np.random.default_rng(3)
    samples = []
    rows = []
    for place, attitude in enumerate(turned):
        rows.append(quaternion({"start_s": repr(4.0 * place), "end_s": repr(4.0 * place + 4)}, attitude))
        for tick in range(100):
            reading = attitude.inv().apply(ACCELEROMETER_REFERENCE_M_S2) + rng.normal(size=3) * 0.01
            cells = [4.0 * place + tick / 25, *reading.tolist()]
            samples.append(dict(zip(("time_s", *ACCELERATION), map(repr, cells), strict=True)))
    return [written(folder / "samples.csv", samples), written(folder / "attitudes.csv", rows)]


@pytest.mark.slow
def test_a_linear_sensor_has_no_second_order(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    files = felt_in([attitude(row) for row in read(EXAMPLES / STILL[1])], tmp_path)
    assert main(solve(files, *PLACE, "--second-order")) == 2
    assert "second_order_not_seen" in capsys.readouterr().err


@pytest.mark.parametrize("about", ["x", "z"])
def test_attitudes_about_one_axis_do_not_tell_a_sensor(
    about: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    files = felt_in([Rotation.from_euler(about, angle) for angle in np.linspace(0, 5, 12)], tmp_path)
    assert main(solve(files, *PLACE)) == 2
    assert "rank_deficient" in capsys.readouterr().err


@pytest.mark.slow
def test_a_sensor_that_lies_otherwise_is_refused_unless_it_may(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Quaternions of a mirrored frame look like that, too."""
    over = Rotation.from_euler("z", 180, degrees=True)
    rows = [quaternion(row, attitude(row) * over) for row in read(EXAMPLES / STILL[1])]
    files = [EXAMPLES / STILL[0], written(tmp_path / "over.csv", rows)]
    assert main(solve(files, *PLACE)) == 2
    assert "mirrored_axis: the sensor reads x, y with the wrong sign" in capsys.readouterr().err
    found = solved(capsys, files, *PLACE, "--any-mounting", "--second-order")["acceleration"]
    mounted = ACCELEROMETER_MATRIX @ over.as_matrix()
    sides = ACCELEROMETER_SECOND_ORDER * [-1, -1, 1]  # what a square has lost
    assert off(found, mounted, ACCELEROMETER_REFERENCE_M_S2, ACCELEROMETER_BIAS_M_S2, sides) < 4


@pytest.mark.parametrize("options", [["--gravity-m-s2", "-9.8"], ["--field-t", "nan"], ["--set", "observation.x=1"]])
def test_options_that_make_no_sense_are_refused(options: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(solve(example(STILL), *options)) == 2
    assert capsys.readouterr().err.startswith(("rig: bad_option", "rig: unknown_setting"))


def test_every_reason_is_said_where_several_sensors_have_no_solution(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One attitude tells no accelerometer, and a magnetometer's field is not given."""
    lines = (EXAMPLES / STILL[1]).read_text().splitlines()
    (tmp_path / "one.csv").write_text("\n".join(lines[:2]) + "\n")
    assert main(solve([EXAMPLES / STILL[0], tmp_path / "one.csv"])) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "nothing_solved: no sensor has a solution: acceleration: too_few_observations" in said
    assert "; field: field_strength_unknown" in said
