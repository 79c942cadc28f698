"""Logs with names and units of their own: read by a map of their columns, to the same result, or refused by name."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.config.column_map import MAP_REMEDY, ColumnMap
from rig.config.load import load_as
from rig.observation.external.table_log import read_table_log
from support.laboratories.commands import rig_here
from support.paths import DOCS

EXAMPLES = DOCS / "examples"
SAMPLES = """
samples:
  time_s: {column: t, unit: ms}
  x_rad_s: {column: gx, unit: dps}
  y_rad_s: {column: gy, unit: dps}
  z_rad_s: {column: gz, unit: dps}
"""
TABLE = """
motion_skip_lines: 2
table:
  time: {column: "Time [ms]", unit: ms}
  axes:
    - {along: +z, angle: {column: Yaw, unit: deg}}
    - {along: +y, angle: {column: Pitch, unit: deg}}
    - {along: +x, angle: {column: Roll, unit: turn}}
"""


def columns(path: Path) -> dict[str, np.ndarray]:
    table = np.genfromtxt(path, delimiter=",", names=True)
    return {name: table[name] for name in table.dtype.names or ()}


def written(path: Path, heading: str, rows: list[list[str]], divided: str = ",", before: str = "") -> Path:
    path.write_text(before + "\n".join([heading, *(divided.join(row) for row in rows)]) + "\n", encoding="utf-8")
    return path


def samples_of_another(folder: Path) -> Path:
    """The example's readings in milliseconds and °/s, with a column of words."""
    read = columns(EXAMPLES / "swinging_samples.csv")
    rates = np.degrees([read[f"{axis}_rad_s"] for axis in "xyz"])
    rows = [
        [f"{1e3 * t:.9g}", "OK", *(f"{each:.12g}" for each in row)]
        for t, row in zip(read["time_s"], rates.T, strict=True)
    ]
    return written(folder / "mine.csv", "t,state,gx,gy,gz", rows)


def log_of_a_table(folder: Path) -> Path:
    """The example's attitudes as a table's log: semicolons, decimal commas, angles of three axes."""
    read = columns(EXAMPLES / "swinging_attitudes.csv")
    turned = Rotation.from_quat(np.column_stack([read[name] for name in ("qx", "qy", "qz", "qw")]))
    yaw, pitch, roll = turned.as_euler("ZYX", degrees=True).T
    time_ms = 500 * (read["start_s"] + read["end_s"])
    rows = [
        [f"{each:.12g}".replace(".", ",") for each in row] + ["moving"]
        for row in np.column_stack([time_ms, yaw, pitch, roll / 360]).tolist()
    ]
    return written(folder / "table.log", "Time [ms];Yaw;Pitch;Roll;State", rows, ";", "Table 7\nprofile 3\n")


def solved(*arguments: str | Path) -> dict[str, list[float]]:
    done = rig_here("solve", *arguments, "--json")
    assert done.returncode == 0, done.stderr
    (sensor,) = json.loads(done.stdout)["gyroscopes"].values()
    return {name: sensor[name] for name in ("scale", "bias_rad_s")}


@pytest.mark.slow
def test_a_log_in_its_own_words_gives_what_the_files_of_the_rig_give(tmp_path: Path) -> None:
    told = tmp_path / "columns.yaml"
    told.write_text(SAMPLES + TABLE, encoding="utf-8")
    mine, log = samples_of_another(tmp_path), log_of_a_table(tmp_path)
    found = solved(mine, "--attitudes", log, "--columns", told)
    plain = solved(EXAMPLES / "swinging_samples.csv", "--attitudes", EXAMPLES / "swinging_attitudes.csv")
    for name, values in plain.items():
        assert found[name] == pytest.approx(values, abs=1e-6)


def test_a_map_that_is_not_there_is_written_by_rig_look(tmp_path: Path) -> None:
    done = rig_here("solve", DOCS / "examples" / "samples.csv", "--turns", "--columns", tmp_path / "columns.yaml")
    assert done.returncode == 2
    assert "rig look LOG --write FILE writes one" in done.stderr


def test_a_table_that_counts_the_other_way_turns_the_other_way(tmp_path: Path) -> None:
    log = written(
        tmp_path / "log",
        "t\ta\tv\tnote",
        [[str(second), str(90 * second), "90", "-"] for second in range(5)],
        "\t",
    )
    told = tmp_path / "columns.yaml"
    told.write_text(
        "table: {time: {column: t, unit: s}, attitude_std_deg: 0.1, axes: [{along: -z, "
        "angle: {column: a, unit: deg}, rate: {column: v, unit: deg/s}}]}",
        encoding="utf-8",
    )
    table = load_as(ColumnMap, told, MAP_REMEDY).table
    assert table is not None
    found = read_table_log(log, table)
    turned = Rotation.from_quat(np.column_stack([found[name] for name in ("qx", "qy", "qz", "qw")]))
    assert turned.apply([1.0, 0.0, 0.0]) == pytest.approx(
        np.array([[1, 0, 0], [0, -1, 0], [-1, 0, 0], [0, 1, 0], [1, 0, 0]]), abs=1e-12
    )
    assert found["rate_z_rad_s"] == pytest.approx([-np.pi / 2] * 5)
    assert found["start_s"].tolist() == [-0.5, 0.5, 1.5, 2.5, 3.5] and found["end_s"].tolist()[-1] == 4.5
    assert found["attitude_std_rad"] == pytest.approx([np.radians(0.1)] * 5)


def test_units_are_spelt_as_in_the_section_of_a_device_that_prints_lines() -> None:
    of = {"x_t": "mgauss", "x_rad_s": "mdeg/s", "temperature_c": "degC"}
    told = ColumnMap.model_validate({"samples": {name: {"column": name, "unit": unit} for name, unit in of.items()}})
    factors = [sample.to_si for sample in told.samples.values()]
    assert factors == pytest.approx([1e-7, np.radians(1e-3), 1.0], rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("told", "words"),
    [
        (SAMPLES.replace("unit: dps", "unit: deg", 1), "x_rad_s is a rate, but deg is the unit of an angle"),
        (SAMPLES.replace("unit: dps", "unit: knots", 1), "this unit is not known"),
        (SAMPLES.replace("unit: dps", "unit: K", 1), "this unit is not known"),  # begins elsewhere than at zero
        (SAMPLES.replace("column: gx", "column: gyro x", 1), "has the column 'gyro x' nowhere, which is to be x_rad_s"),
        (SAMPLES + "motions: {}", "unknown key, did you mean motion?"),
        (TABLE + "motion: {qw: {column: q, unit: '1'}}", "give motion or table"),
    ],
)
def test_a_map_that_cannot_be_is_refused(told: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "columns.yaml"
    path.write_text(told, encoding="utf-8")
    done = rig_here(
        "solve", samples_of_another(tmp_path), "--attitudes", EXAMPLES / "swinging_attitudes.csv", "--columns", path
    )
    assert done.returncode == 2 and words in " ".join(done.stderr.split()), done.stderr


def test_a_log_of_angles_is_not_for_sweeps_and_a_map_not_for_a_recording(tmp_path: Path) -> None:
    told = tmp_path / "columns.yaml"
    told.write_text(SAMPLES + TABLE, encoding="utf-8")
    mine, log = samples_of_another(tmp_path), log_of_a_table(tmp_path)
    done = rig_here("solve", mine, "--sweeps", log, "--columns", told)
    assert done.returncode == 2 and "bad_option" in done.stderr
    done = rig_here("solve", tmp_path, "--columns", told)
    assert done.returncode == 2 and "bad_option" in done.stderr
