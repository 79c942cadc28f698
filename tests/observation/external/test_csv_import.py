"""Data recorded elsewhere, as CSV files: solved like the rig's own, refused by name where they cannot be right."""

import json
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rig.cli import main
from rig.errors import Fault, Refused
from rig.observation.external.csv_import import ExternalData, average
from rig.observation.external.csv_windows import scatter_of
from support.external.sweeps_as_files import average_files
from support.paths import DOCS

EXAMPLES = DOCS / "examples"
SCALE = np.array([1.1771, 1.1554, 1.1440])  # what the example was made with
BIAS_RAD_S = np.array([0.0077, -0.0100, -0.0051])


def edited(folder: Path, file: str, change: Callable[[list[str]], list[str]]) -> Path:
    """A copy of an example with its lines changed."""
    path = folder / file
    path.write_text("\n".join(change((EXAMPLES / file).read_text().splitlines())) + "\n")
    return path


def read_with(
    folder: Path,
    samples: Callable[[list[str]], list[str]] = list,
    sweeps: Callable[[list[str]], list[str]] = list,
) -> ExternalData:
    return average_files(edited(folder, "samples.csv", samples), edited(folder, "sweeps.csv", sweeps))


def scaled(factor: float, columns: slice) -> Callable[[list[str]], list[str]]:
    """Multiplies some columns of every row below the header."""

    def change(lines: list[str]) -> list[str]:
        changed = [lines[0]]
        for line in lines[1:]:
            cells = line.split(",")
            cells[columns] = [repr(float(cell) * factor) for cell in cells[columns]]
            changed.append(",".join(cells))
        return changed

    return change


def test_a_means_variance_holds_the_rounding_to_coarse_steps() -> None:
    rng, true = np.random.default_rng(1), np.linspace(0, 1, 41)
    rounded = np.rint(true[:, None, None] + 0.25 * rng.normal(size=(41, 400, 3)))
    errors = [
        (rows.mean(axis=0) - level) / np.sqrt(scatter_of(rows)[0]) for rows, level in zip(rounded, true, strict=True)
    ]
    assert 0.3 < np.sqrt(np.mean(np.square(errors))) < 1.3 and np.abs(errors).max() < 2.8


def test_a_row_that_the_recording_does_not_cover_is_left_out_and_counted(tmp_path: Path) -> None:
    data = read_with(tmp_path, sweeps=lambda lines: [*lines, "80,86,0,0,1,6.28"])
    (omitted,) = data.omitted
    assert str(omitted) == f"1 of {len(data.sweeps) + len(data.rests) + 1} rows, not covered by the recording; the " + (
        f"first row {omitted.total}, at 80 s"
    )


@pytest.mark.slow
def test_the_example_is_solved_within_its_uncertainty(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["solve", str(EXAMPLES / "samples.csv"), "--sweeps", str(EXAMPLES / "sweeps.csv"), "--json"]
    assert main(arguments) == 0
    result = json.loads(capsys.readouterr().out)["gyroscopes"]["imu"]
    assert result["model"] == "g = K (m + b)"
    assert (result["estimator"], result["six_observation"]["estimator"]) == ("vector", "newton")
    for estimate in (result, result["six_observation"]):
        std = np.sqrt(np.diag(estimate["covariance"]))
        errors = np.array(estimate["scale"] + estimate["bias_rad_s"]) - np.concatenate([SCALE, BIAS_RAD_S])
        assert np.all(np.abs(errors) < 3.5 * std)
        assert np.all(std < 1.5e-3)


@pytest.mark.parametrize("with_rest", [True, False])
def test_a_slow_and_a_fast_sweep_the_same_way_round_contradict_each_other_neither_with_a_rest_nor_without(
    with_rest: bool,
) -> None:
    axes = np.array([[0, 0, 1.0], [0, 0, 1.0], [1.0, 0, 0], *([[0, 0, 1.0]] if with_rest else [[0, -1.0, 0]])])
    speeds = np.array([1.0, 4.0, 1.0, 0.0 if with_rest else 4.0])
    time_s = np.arange(2000) / 100
    rates = (speeds[:, None] * axes)[(time_s // 5).astype(int)] + 1e-3 * np.random.default_rng(0).normal(size=(2000, 3))
    begins_s = 5 * np.arange(4, dtype=np.float64)
    data = average(np.column_stack([time_s, rates]), np.column_stack([begins_s + 0.3, begins_s + 4.3, speeds]), axes)
    assert (len(data.sweeps), len(data.rests)) == ((3, 1) if with_rest else (4, 0))


def test_the_example_holds_six_turns_and_six_rests() -> None:
    data = average_files(EXAMPLES / "samples.csv", EXAMPLES / "sweeps.csv")
    assert [(turn.axis, turn.sign) for turn in data.sweeps] == [
        ("z", -1),
        ("z", 1),
        ("x", 1),
        ("x", -1),
        ("y", 1),
        ("y", -1),
    ]
    assert {(turn.joint_name, turn.direction) for turn in data.sweeps} == {(None, None)}
    assert len(data.rests) == 6
    assert all(turn.speed_rad_s == pytest.approx(np.pi / 3) for turn in data.sweeps)


@pytest.mark.slow
def test_speeds_may_stand_in_place_of_angles(tmp_path: Path) -> None:
    def with_speeds(lines: list[str]) -> list[str]:
        rows = [line.split(",") for line in lines[1:]]
        rows = [[*row[:5], repr(float(row[5]) / (float(row[1]) - float(row[0])))] for row in rows]
        return [lines[0].replace("angle_rad", "speed_rad_s"), *(",".join(row) for row in rows)]

    by_speed, by_angle = read_with(tmp_path, sweeps=with_speeds), read_with(tmp_path)
    assert [s.speed_rad_s for s in by_speed.sweeps] == pytest.approx([s.speed_rad_s for s in by_angle.sweeps])


@pytest.mark.parametrize(
    ("name", "samples", "sweeps"),
    [
        ("wrong_unit", lambda lines: [lines[0].replace("x_rad_s", "x_deg_s"), *lines[1:]], list),
        ("wrong_unit", lambda lines: [lines[0].replace("time_s", "time_ms"), *lines[1:]], list),
        ("wrong_unit", list, lambda lines: [lines[0].replace("angle_rad", "angle_deg"), *lines[1:]]),
        ("wrong_unit", scaled(180 / np.pi, slice(1, 4)), list),
        ("wrong_unit", list, scaled(180 / np.pi, slice(5, 6))),
        ("wrong_columns", lambda lines: [lines[0].replace("x_rad_s", "y_rad_s"), *lines[1:]], list),
        ("wrong_columns", lambda lines: ["a,b", "1,2"], list),
        ("wrong_columns", list, lambda lines: [line.rsplit(",", 1)[0] for line in lines]),
        ("not_a_number", lambda lines: [*lines[:100], "1.98,nan,0,0", *lines[101:]], list),
        ("not_a_number", lambda lines: [*lines[:100], "1.98,0,0", *lines[101:]], list),
        ("time_not_increasing", lambda lines: [*lines[:100], *(f"{line}1" for line in lines[50:])], list),
        ("bad_sweep", list, lambda lines: [lines[0], "7,1,0,0,-1,6.28", *lines[2:]]),
        ("bad_sweep", list, lambda lines: [lines[0], "1,7,0,0,-2,6.28", *lines[2:]]),
        ("overlapping_sweeps", list, lambda lines: [*lines, lines[1]]),
        # What NumPy would warn of on its way to a refusal, and what it could not have computed at all.
        ("bad_sweep", list, lambda lines: [lines[0], "1,1.000000000001,0,0,-1,6.28"]),
        ("not_a_number", list, lambda lines: [lines[0], "1,7,0,0,-1,1e300"]),
        ("not_a_number", lambda lines: [*lines[:100], "1.98,1e200,0,0", *lines[101:]], list),
        ("too_few_observations", list, lambda lines: lines[:1]),
        ("lost_samples", list, lambda lines: [lines[0], lines[1], "80,86,0,0,1,6.28", "90,96,0,0,-1,6.28"]),
        ("wrong_columns", list, lambda lines: []),
        ("wrong_columns", lambda lines: [], list),
        ("no_file", list, lambda lines: [*lines[:2], "1" * 200_000]),
        ("no_file", lambda lines: [lines[0], "1" * 200_000], list),
    ],
)
def test_files_that_cannot_be_right_are_refused_by_name(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    name: str,
    samples: Callable[[list[str]], list[str]],
    sweeps: Callable[[list[str]], list[str]],
) -> None:
    files = edited(tmp_path, "samples.csv", samples), edited(tmp_path, "sweeps.csv", sweeps)
    assert main(["solve", str(files[0]), "--sweeps", str(files[1])]) == 2, "nothing ran, whatever is wrong"
    said = capsys.readouterr().err
    assert said.startswith(f"rig: {name}: ") and len(said) < 500


def test_only_regular_files_of_a_sensible_size_are_opened(tmp_path: Path) -> None:
    """A pipe nobody writes to and a device without an end would be read for ever."""
    pipe, endless, huge = tmp_path / "pipe.csv", Path("/dev/zero"), tmp_path / "huge.csv"
    os.mkfifo(pipe)
    with huge.open("wb") as file:
        file.truncate(300_000_000)
    sweeps = EXAMPLES / "sweeps.csv"
    for path, why in (
        (pipe, "not a regular file"),
        (endless, "not a regular file"),
        (huge, "longer than 256000000 bytes"),
    ):
        with pytest.raises(Refused, match=f"no_file: .*{why}"):
            average_files(path, sweeps)
    with pytest.raises(Refused, match=r"no_file: .*not a regular file"):
        average_files(EXAMPLES / "samples.csv", pipe)


def test_what_a_message_quotes_is_short_and_harmless(tmp_path: Path) -> None:
    with pytest.raises(Refused) as refusal:
        read_with(tmp_path, lambda lines: [*lines[:100], "1.98,\x1b[2J" + "9" * 10_000, *lines[101:]])
    assert "\x1b" not in str(refusal.value) and len(str(refusal.value)) < 500


def test_the_refusal_names_the_column_to_convert(tmp_path: Path) -> None:
    with pytest.raises(Refused, match="column x_deg_s instead of x_rad_s"):
        read_with(tmp_path, lambda lines: [lines[0].replace("x_rad_s", "x_deg_s"), *lines[1:]])


@pytest.mark.slow
def test_a_gap_in_the_samples_is_named(tmp_path: Path) -> None:
    (short,) = read_with(tmp_path, lambda lines: [*lines[:100], *lines[120:]]).omitted
    assert short.count == 20 and short.first.endswith("in row 1")
    (long,) = read_with(tmp_path, lambda lines: [*lines[:100], *lines[180:]]).omitted
    assert (long.what, long.count) == ("rows", 1) and long.first.startswith("row 1, at ")


def test_samples_that_are_missing_all_over_the_sweeps_are_refused(tmp_path: Path) -> None:
    kept = np.random.default_rng(1).random(10_000) > 0.04
    with pytest.raises(Fault, match="lost_samples: sweep 1 has"):
        read_with(tmp_path, lambda lines: [lines[0], *(line for row, line in enumerate(lines[1:]) if kept[row])])


@pytest.mark.slow
def test_a_missing_direction_leaves_the_vector_model_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With the rests, five sweeps about known axes are enough for it; the six-observation solvers refuse."""
    sweeps = edited(tmp_path, "sweeps.csv", lambda lines: [line for line in lines if ",0,-1,0," not in line])
    arguments = ["solve", str(EXAMPLES / "samples.csv"), "--sweeps", str(sweeps)]
    assert main([*arguments, "--json"]) == 0
    assert (
        "too_few_observations" in json.loads(capsys.readouterr().out)["gyroscopes"]["imu"]["six_observation"]["error"]
    )
    assert main([*arguments, "--estimator", "newton"]) == 2
    assert "too_few_observations" in capsys.readouterr().err


def test_unknown_estimators_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    files = [str(EXAMPLES / "samples.csv"), "--sweeps", str(EXAMPLES / "sweeps.csv")]
    assert main(["solve", *files, "--estimator", "nosuch"]) == 2
    assert "unknown_estimator" in capsys.readouterr().err


def test_axes_with_a_wrong_sign_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def mirrored(lines: list[str]) -> list[str]:
        rows = [line.split(",") for line in lines[1:]]
        return [lines[0], *(",".join([*row[:2], str(-int(row[2])), *row[3:]]) for row in rows)]

    sweeps = edited(tmp_path, "sweeps.csv", mirrored)
    assert main(["solve", str(EXAMPLES / "samples.csv"), "--sweeps", str(sweeps)]) == 2
    assert "mirrored_axis" in capsys.readouterr().err


@pytest.mark.slow
def test_readings_of_other_sensors_in_the_samples_change_nothing(tmp_path: Path) -> None:
    def beside(lines: list[str]) -> list[str]:
        rows = (f"{line},0,0,9.81,2e-5,0,4e-5,25" for line in lines[1:])
        return [f"{lines[0]},x_m_s2,y_m_s2,z_m_s2,x_t,y_t,z_t,temperature_c", *rows]

    alone, together = read_with(tmp_path), read_with(tmp_path, beside)
    assert np.array_equal(
        [turn.average.mean_rad_s for turn in alone.sweeps], [turn.average.mean_rad_s for turn in together.sweeps]
    )
    with pytest.raises(Refused, match=r"wrong_columns: .*unknown humidity"):
        read_with(tmp_path, lambda lines: [f"{lines[0]},humidity", *(f"{line},0" for line in lines[1:])])


@pytest.mark.slow
def test_people_see_uncertainties_with_one_coverage_factor_and_the_angles_between_the_axes(
    capsys: pytest.CaptureFixture[str],
) -> None:
    files = [str(EXAMPLES / "samples.csv"), "--sweeps", str(EXAMPLES / "sweeps.csv")]
    assert main(["solve", *files, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["gyroscopes"]["imu"]
    assert main(["solve", *files, "--all"]) == 0
    printed = capsys.readouterr().out
    scale_x = next(line for line in printed.splitlines() if "scale" not in line and " x " in line)
    factor = found["budget"]["coverage_factor"]
    assert f"{found['budget']['expanded'][0]:.5f}" in scale_x
    assert factor > 2 and "± U" in printed and "1σ" not in printed
    skew, known = (1e3 * found["vector_model"][f"non_orthogonality_{each}"][0] for each in ("rad", "std_rad"))
    assert f"non-orthogonality yz zx xy: {skew:+.3f} ± {factor * known:.2g}" in printed


@pytest.mark.slow
def test_files_of_a_spreadsheet_whose_decimals_have_a_comma_are_read_alike(tmp_path: Path) -> None:
    def as_there(lines: list[str]) -> list[str]:
        return [line.replace(",", ";").replace(".", ",") for line in lines]

    usual, there = read_with(tmp_path), read_with(tmp_path, samples=as_there, sweeps=as_there)
    assert repr(there) == repr(usual)
