"""Logs as other people have them, through `rig solve` and `rig allan`: right values, or the right name."""

import gzip
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.cli import main
from rig.estimation.arrays import Array
from support.external.csv_tables import write_table
from support.external.loggers import (
    AXES,
    SCALE,
    Knock,
    Stamps,
    laid_down,
    swept,
    turn_slowly,
    write_forces,
    write_rates,
)
from support.laboratories.commands import rig_here
from support.paths import DOCS, RECORDINGS

MAPPED = """
samples:
  time_s: {{column: t, unit: {unit}}}
  x_rad_s: {{column: gx, unit: rad/s}}
  y_rad_s: {{column: gy, unit: rad/s}}
  z_rad_s: {{column: gz, unit: rad/s}}
"""


def solved(capsys: pytest.CaptureFixture[str], *arguments: object, status: int = 0) -> dict[str, Any]:
    assert main(["solve", *map(str, arguments), "--json"]) == status
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    assert main(["solve", *map(str, arguments)]) == 2
    return " ".join(capsys.readouterr().err.split())


def in_brief(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    main(["solve", *map(str, arguments)])
    return " ".join(capsys.readouterr().out.split())


def off_and_u(found: dict[str, Any], kind: str = "gyroscopes") -> tuple[Array, Array]:
    """How many U each scale factor is off (3,), and these."""
    entry = found[kind]["imu"]
    covariance = np.array(entry.get("covariance_combined") or entry["covariance"])
    expanded = 2 * np.sqrt(np.diag(covariance))[:3]
    return np.abs(np.array(entry["scale"]) - SCALE) / expanded, expanded


@pytest.mark.one_in(2)  # of each kind of stamps the one with the least to go by; the rates between them: `make proof`
@pytest.mark.slow
@pytest.mark.parametrize(
    ("rate_hz", "stamps"),
    [
        (119, Stamps(rounded_s=1e-3)),
        (238, Stamps(rounded_s=1e-3)),
        (50, Stamps(burst=2)),
        (100, Stamps(burst=5)),
        (100, Stamps(burst=20)),
    ],
)
def test_bad_stamps_lose_nothing(
    rate_hz: float, stamps: Stamps, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    samples, sweeps = write_rates(tmp_path, swept(rate_hz), stamps)
    found = solved(capsys, samples, "--sweeps", sweeps)
    off, expanded = off_and_u(found)
    assert (off < 1.6).all() and (expanded < 1e-4).all()
    assert ("on arrival" in str(found.get("notes"))) == (stamps.burst > 1), "and what was made of the stamps is said"


@pytest.mark.slow
@pytest.mark.parametrize("stamps", [Stamps(rounded_s=1e-3, lost=0.04), Stamps(burst=5, lost=0.04)])
def test_real_losses_are_refused(stamps: Stamps, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    samples, sweeps = write_rates(tmp_path, swept(104), stamps)
    assert "lost_samples: " in refused(capsys, samples, "--sweeps", sweeps)


@pytest.mark.slow
def test_a_few_losses_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    samples, sweeps = write_rates(tmp_path, swept(104), Stamps(rounded_s=1e-3, gaps=((450, 3),)))
    said = in_brief(capsys, samples, "--sweeps", sweeps)
    assert "left out: 3 of " in said and "readings, lost_samples: they are missing; the first after 4.317 s" in said
    assert said.endswith("verdict: PASS")


@pytest.fixture(scope="module")
def plain_scale(tmp_path_factory: pytest.TempPathFactory) -> list[float]:
    """The scale factors of a log at 200 Hz whose clock begins with it."""
    files = write_rates(tmp_path_factory.mktemp("plain"), swept(200))
    scale: list[float] = json.loads(rig_here("solve", *_interleave(files), "--json").stdout)["gyroscopes"]["imu"][
        "scale"
    ]
    return scale


@pytest.mark.slow
@pytest.mark.parametrize("unit", ["ms", "us", "ns", "s"])
def test_clocks_that_count_from_1970_lose_no_digit(
    unit: str, plain_scale: list[float], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, per_s = swept(200), {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[unit]
    epoch_s, step = 1_732_700_000, per_s // 200
    times = [f"{epoch_s * per_s + n * step}" if step else f"{epoch_s + n / 200:.3f}" for n in range(len(log.time_s))]
    rows = [f"{t},{','.join(f'{each:.9g}' for each in row)}" for t, row in zip(times, log.readings, strict=True)]
    (tmp_path / "mine.csv").write_text("\n".join(["t,gx,gy,gz", *rows]) + "\n")
    (tmp_path / "columns.yaml").write_text(MAPPED.format(unit=unit))
    columns = ["start_s", "end_s", "axis_x", "axis_y", "axis_z", "speed_rad_s"]
    lines = [",".join([f"{epoch_s + r[0]:.3f}", f"{epoch_s + r[1]:.3f}", *map(str, r[2:])]) for r in log.rows]
    (tmp_path / "sweeps.csv").write_text("\n".join([",".join(columns), *lines]) + "\n")
    mapped = ("--columns", tmp_path / "columns.yaml")
    found = solved(capsys, tmp_path / "mine.csv", "--sweeps", tmp_path / "sweeps.csv", *mapped)
    assert found["gyroscopes"]["imu"]["scale"] == pytest.approx(plain_scale, abs=1e-9)
    assert f"times count from {epoch_s} s" in str(found["notes"])


def _interleave(files: tuple[Path, Path], motion: str = "--sweeps") -> Sequence[str | Path]:
    return files[0], motion, files[1]


def others(folder: Path, heading: str, rows: Sequence[str], unit: str = "s") -> Sequence[object]:
    """A log with names of its own, beside the sweeps of `write_rates`."""
    (folder / "mine.csv").write_text("\n".join([heading, *rows]) + "\n")
    (folder / "columns.yaml").write_text(MAPPED.format(unit=unit))
    return folder / "mine.csv", "--sweeps", folder / "sweeps.csv", "--columns", folder / "columns.yaml"


def rows_of(folder: Path) -> list[str]:
    write_rates(folder, swept(100))
    return (folder / "samples.csv").read_text().splitlines()[1:]


@pytest.mark.slow
def test_rows_of_other_sensors_are_left_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows, mixed = rows_of(tmp_path), list[str]()
    for number, row in enumerate(rows):
        mixed.append(row)
        if number % 4 == 0:
            mixed.append(f"{float(row.split(',')[0]) + 0.004:.4f},,,,1013.2")
    found = solved(capsys, *others(tmp_path, "t,gx,gy,gz,p", mixed))
    assert (off_and_u(found)[0] < 1.6).all()
    assert found["notes"]["imu"] == [
        f"{len(mixed) - len(rows)} rows of the samples do not contain these readings and are left out"
    ]


def test_a_reading_that_is_blank_in_part_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = rows_of(tmp_path)
    t, x, _, z = rows[99].split(",")
    rows[99] = f"{t},{x},,{z}"
    said = refused(capsys, *others(tmp_path, "t,gx,gy,gz", rows))
    assert "not_a_number: " in said and "line 101: y_rad_s is blank" in said


@pytest.mark.slow
def test_sensors_read_at_different_times_are_solved_one_at_a_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = laid_down(dwell_s=5.0)
    samples, attitudes = write_forces(tmp_path, log)
    head, *rows = samples.read_text().splitlines()
    mixed = [head + ",x_rad_s,y_rad_s,z_rad_s"]
    for row in rows:
        mixed += [f"{row},,,", f"{float(row.split(',')[0]) + 0.001:.6f},,,,0.001,0.002,-0.003"]
    samples.write_text("\n".join(mixed) + "\n")
    said = refused(capsys, samples, "--attitudes", attitudes)
    assert "blank_cells: " in said and "--only accelerometer" in said
    found = solved(capsys, samples, "--attitudes", attitudes, "--only", "accelerometer")
    assert (off_and_u(found, "accelerometers")[0] < 1.6).all()


@pytest.mark.slow
@pytest.mark.parametrize("units", ["s,rad/s,rad/s,rad/s", "[s],[rad/sec],[rad/sec],[rad/sec]"])
def test_a_row_of_units_is_read_over(units: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = solved(capsys, *others(tmp_path, "t,gx,gy,gz", [units, *rows_of(tmp_path)]))
    assert (off_and_u(found)[0] < 1.6).all()


def test_units_that_contradict_what_is_said_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = refused(capsys, *others(tmp_path, "t,gx,gy,gz", ["s,deg/s,deg/s,deg/s", *rows_of(tmp_path)]))
    assert "wrong_unit: " in said and "line 2 states that x_rad_s is in 'deg/s'" in said.replace('"', "'")


@pytest.mark.slow
def test_a_heading_one_short_is_no_heading(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """R's write.table."""
    rows = [f"{number},{row}" for number, row in enumerate(rows_of(tmp_path), 1)]
    said = refused(capsys, *others(tmp_path, "t,gx,gy,gz", rows))
    assert "wrong_columns: " in said and "line 2 has 5 cells, but the heading names 4 columns" in said
    named = others(tmp_path, '"",t,gx,gy,gz', rows)
    assert (off_and_u(solved(capsys, *named))[0] < 1.6).all(), "an index with a name, if an empty one, is read over"


def test_files_by_two_clocks_say_from_when_to_when(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = swept(100)
    samples, sweeps = write_rates(tmp_path, log)
    late = log.rows + np.array([1000.0, 1000.0, 0, 0, 0, 0])
    write_table(sweeps, ["start_s", "end_s", *(f"axis_{a}" for a in AXES), "speed_rad_s"], late)
    said = refused(capsys, samples, "--sweeps", sweeps)
    assert "clocks_apart: the rows reach from 1000.2 to " in said and "the samples from 0 to " in said


@pytest.mark.slow
@pytest.mark.parametrize(("mean_rad_s", "bias_rad_s"), [(0.35, 0.023), (0.35, -0.35), (1.0, 0.2)])
def test_a_gentle_turn_that_cancels_the_bias_is_no_rest(
    mean_rad_s: float, bias_rad_s: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = write_rates(tmp_path, turn_slowly(mean_rad_s, np.array([bias_rad_s, 0.01, -0.005])), None, "angle_rad")
    found = solved(capsys, *_interleave(files))
    off, expanded = off_and_u(found)
    assert (
        found["gyroscopes"]["imu"]["estimator"] == "increments"
        and len(found["gyroscopes"]["imu"]["by_angles"]["rows"]) == 6
    )
    assert (off < 1.6).all() and (expanded < 2e-3).all()


@pytest.mark.slow
def test_turns_that_count_by_their_mean_speed_are_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = turn_slowly(0.35, np.array([0.02, 0.01, -0.005]))
    cut = log.rows.copy()
    cut[2, 0] += 6.0  # begins in mid-turn
    cut[2, 5] *= 0.7
    log = type(log)(log.time_s, log.readings, cut)
    said = in_brief(capsys, *_interleave(write_rates(tmp_path, log, None, "angle_rad")))
    assert (
        "1 of 6 turns, rows 3, count by their mean speed: the body moves before or after them; so angle_rad must"
        in said
    )


@pytest.mark.one_in(2)  # others of the same size elsewhere: `make proof`
@pytest.mark.slow
@pytest.mark.parametrize(
    ("knocks", "stamps", "counted"),
    [
        ((Knock(300, 0.2),), Stamps(), "left out: 1 of "),
        ((Knock(900, -5.0, 1),), Stamps(), "left out: 1 of "),
        ((Knock(80, 1.0, 2), Knock(1700, 30.0, 0)), Stamps(), "left out: 2 of "),
        ((Knock(300, 1.0, 0, 6),), Stamps(), "left out: "),
        ((), Stamps(gaps=((300, 2),)), "left out: 2 of "),
        ((), Stamps(gaps=((20, 2), (300, 2), (900, 2))), "left out: "),
        ((), Stamps(gaps=((1890, 40),)), "left out: "),  # where a dwell begins
    ],
)
def test_a_knock_or_a_gap_costs_its_readings_and_not_the_dwell(
    knocks: tuple[Knock, ...], stamps: Stamps, counted: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = write_forces(tmp_path, laid_down(dwell_s=10.0, knocks=knocks), stamps)
    found = solved(capsys, *_interleave(files, "--attitudes"))
    off, expanded = off_and_u(found, "accelerometers")
    assert (off < 1).all() and (expanded < 1e-3).all()
    assert len(found["accelerometers"]["imu"]["dwells"]) == 6
    said = in_brief(capsys, *_interleave(files, "--attitudes"))
    assert counted in said and " in row " in said and said.endswith("verdict: PASS")


def test_a_dwell_in_which_the_body_moves_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = laid_down(dwell_s=10.0)
    moved = log.readings.copy()
    moved[1000:1200] += 3 * np.sin(np.arange(200) / 7)[:, None]
    said = refused(capsys, *_interleave(write_forces(tmp_path, type(log)(log.time_s, moved, log.rows)), "--attitudes"))
    assert "rank_deficient" in said and "1 of 6 rows, not_at_rest" in said and "the first row 2, from 14.5 s" in said


@pytest.mark.slow
def test_six_faces_tell_nothing_of_a_gyroscope_whose_log_has_gaps(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What was asked for and has no solution fails the verdict; who wants the accelerometer alone says so."""
    log = laid_down(dwell_s=2.0)
    rates = np.round(
        np.array([0.03, 0.02, 0.01]) + 0.004 * np.random.default_rng(1).normal(size=(len(log.time_s), 3)), 2
    )
    beside = [(f"{axis}_rad_s", rates[:, i]) for i, axis in enumerate(AXES)]
    files = _interleave(write_forces(tmp_path, log, None, *beside), "--attitudes")
    found = solved(capsys, *files, status=1)
    assert found["verdict"] == "fail" and [c["name"] for c in found["checks"] if not c["passed"]] == ["imu.unsolved"]
    assert found["unsolved"]["imu"]["rate"]["error"].startswith("lost_samples: 0 of 5 increments")
    assert (off_and_u(found, "accelerometers")[0] < 1).all()
    assert "imu, gyroscope, not calibrated: lost_samples" in in_brief(capsys, *files)
    assert solved(capsys, *files, "--only", "accelerometer")["verdict"] == "pass"


@pytest.mark.slow
def test_attitudes_that_only_the_accelerometer_believes_do_not_pass(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Headings that nobody measured: gravity does not tell them, and a gyroscope does."""
    rng = np.random.default_rng(3)
    time_s = np.arange(6000) / 100
    place, since_s = np.divmod(time_s, 5.0)
    faces = Rotation.from_euler(
        "xyz", [(0, 0, 0), (90, 0, 0), (180, 0, 0), (-90, 0, 0), (0, 90, 0), (0, -90, 0)] * 2, degrees=True
    )
    true = Rotation.from_rotvec(rng.uniform(-3, 3, 12)[:, None] * [0, 0, 1]) * faces
    moves = (true[:-1].inv() * true[1:]).as_rotvec()
    part = (1 - np.cos(2 * np.pi * np.clip(since_s - 4, 0, 1)))[:, None]
    rates = np.append(moves, np.zeros((1, 3)), axis=0)[place.astype(int)] * part
    felt = true.inv().apply([0, 0, 9.80665])[place.astype(int)]
    readings = np.hstack([rates + 0.01, felt]) + [*(5e-4,) * 3, *(5e-3,) * 3] * rng.normal(size=(6000, 6))
    names = [*(f"{a}_rad_s" for a in AXES), *(f"{a}_m_s2" for a in AXES)]
    samples = write_table(tmp_path / "samples.csv", ["time_s", *names], time_s, readings)
    starts_s = 5.0 * np.arange(12, dtype=np.float64)
    rows = np.column_stack([starts_s + 0.3, starts_s + 3.7, faces.as_quat()[:, [3, 0, 1, 2]]])
    attitudes = write_table(tmp_path / "attitudes.csv", ["start_s", "end_s", "qw", "qx", "qy", "qz"], rows)
    found = solved(capsys, samples, "--attitudes", attitudes, status=1)
    assert found["verdict"] == "fail" and "accelerometers" in found
    assert found["unsolved"]["imu"]["rate"]["error"].startswith(("attitude_untrustworthy", "ill_conditioned"))
    assert in_brief(capsys, samples, "--attitudes", attitudes).endswith("verdict: FAIL")
    assert solved(capsys, samples, "--attitudes", attitudes, "--only", "accelerometer")["verdict"] == "pass"


def test_a_sensor_that_is_not_there_cannot_be_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    samples, attitudes = write_forces(tmp_path, laid_down(dwell_s=2.0))
    assert "wrong_columns: " in refused(capsys, samples, "--attitudes", attitudes, "--only", "magnetometer")
    assert "bad_option: " in refused(capsys, samples, "--attitudes", attitudes, "--only", "thermometer")


@pytest.mark.slow
@pytest.mark.parametrize("lead_s", [0.08, 0.4])
def test_poses_ahead_of_the_readings_end_by_name(
    lead_s: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Rests that end where a row begins; a clock that is farther off than is allowed for."""
    rng, time_s = np.random.default_rng(1), np.arange(3000) / 100

    def turned(at_s: Array) -> tuple[Rotation, Array]:
        """The attitude and the rates: twice to and fro about one axis after the other, with rests between."""
        turn, since_s = np.divmod(at_s, 4)
        pace, moving_s = 2 * np.pi / 1.25, np.maximum(since_s - 1.5, 0)
        axes = np.eye(3)[turn.astype(int) % 3]
        angle = 4 / pace * (1 - np.cos(pace * moving_s))
        return Rotation.from_rotvec(axes * angle[:, None]), axes * 4 * np.sin(pace * moving_s)[:, None]

    body, rates = turned(time_s)
    felt = body.inv().apply([0, 0, 9.80665])
    readings = np.hstack([rates, felt]) + [*(2e-3,) * 3, *(2e-2,) * 3] * rng.normal(size=(3000, 6))
    names = [*(f"{a}_rad_s" for a in AXES), *(f"{a}_m_s2" for a in AXES)]
    samples = write_table(tmp_path / "samples.csv", ["time_s", *names], time_s, readings)
    ahead = turned(time_s + lead_s)[0].as_quat()[:, [3, 0, 1, 2]]
    rows = np.column_stack([time_s - 5e-4, time_s + 5e-4, ahead])[1:-9]
    attitudes = write_table(tmp_path / "attitudes.csv", ["start_s", "end_s", "qw", "qx", "qy", "qz"], rows)
    if lead_s > 0.15:
        said = refused(capsys, samples, "--attitudes", attitudes)
        assert "clocks_apart: the estimated offset of the attitudes' clock is +400" in said and "acceleration: " in said
    else:
        found = solved(capsys, samples, "--attitudes", attitudes, status=1)
        assert found["gyroscopes"]["imu"]["scale"] == pytest.approx([1, 1, 1], abs=1e-3)
        assert found["unsolved"]["imu"]["acceleration"]["error"].startswith(("rank_deficient", "too_few"))


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.parametrize("packed", [True, False])
def test_the_allan_deviation_of_rounded_stamps_is_that_of_even_ones(
    packed: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng, rate_hz = np.random.default_rng(1), 952
    time_s = np.round(np.arange(45 * rate_hz) / rate_hz, 3)
    path = write_table(
        tmp_path / "log.csv",
        ["time_s", *(f"{a}_rad_s" for a in AXES)],
        time_s,
        0.01 * rng.normal(size=(len(time_s), 3)),
    )
    if packed:
        path = path.rename(tmp_path / "log.csv.gz")
        path.write_bytes(gzip.compress(path.read_bytes()))
    assert main(["allan", str(path), "--json"]) == 0
    (rate,) = (sensor["rate"] for sensor in json.loads(capsys.readouterr().out)["sensors"].values())
    for walk in rate["random_walk_rad_sqrt_s"]:
        assert walk["value"] == pytest.approx(0.01 / rate_hz**0.5, abs=4 * walk["std"])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("gaps", "omitted"),
    [
        (((520, 17),), "17 of 3495 readings, lost_samples: they are missing; the first after 4.99 s, in row 2"),
        (((50, 17), (520, 17), (560, 17), (1600, 17)), "68 of 3495 readings, lost_samples: they are missing"),
        (((450, 156),), "1 of 12 rows, lost_samples: the missing readings may contain a change of the rate"),
    ],
)
def test_a_gap_costs_what_it_hides_and_is_named(
    gaps: tuple[tuple[int, int], ...], omitted: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    samples, sweeps = write_rates(tmp_path, swept(104), Stamps(rounded_s=1e-3, gaps=gaps))
    found = solved(capsys, samples, "--sweeps", sweeps)
    off, expanded = off_and_u(found)
    assert (off < 1.6).all() and (expanded < 1e-4).all()
    assert omitted in in_brief(capsys, samples, "--sweeps", sweeps)


SLOW_TURNS = turn_slowly(0.35, np.array([0.02, -0.01, 0.022]))


@pytest.fixture(scope="module")
def u_without_gap(tmp_path_factory: pytest.TempPathFactory) -> Array:
    files = write_rates(tmp_path_factory.mktemp("whole"), SLOW_TURNS, None, "angle_rad")
    return off_and_u(json.loads(rig_here("solve", *_interleave(files), "--json").stdout))[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lasts", "wider", "omitted"),
    [(17, 0.999, "17 of "), (90, 1.01, "90 of "), (200, 1.2, "1 of 7 rows")],
)
def test_a_turn_with_a_gap_is_less_certain_or_left_out(
    lasts: int,
    wider: float,
    omitted: str,
    *,
    u_without_gap: Array,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    files = write_rates(tmp_path, SLOW_TURNS, Stamps(gaps=((1200, lasts),)), "angle_rad")
    off, expanded = off_and_u(solved(capsys, *_interleave(files)))
    assert (off < 1).all() and omitted in in_brief(capsys, *_interleave(files))
    assert wider < expanded[0] / u_without_gap[0] < 1.5


@pytest.mark.slow
def test_what_had_waited_in_a_buffer_is_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two seconds of readings from before the recording, which come at 400 Hz."""
    log = swept(104)
    stale = np.random.default_rng(2).normal(size=(800, 3))
    stamps = np.concatenate([log.time_s[0] - 0.0025 * np.arange(800, 0, -1), log.time_s])
    samples = write_table(
        tmp_path / "samples.csv", ["time_s", *(f"{a}_rad_s" for a in AXES)], stamps, np.vstack([stale, log.readings])
    )
    (tmp_path / "plain").mkdir()
    sweeps = write_rates(tmp_path / "plain", log)[1]
    found = solved(capsys, samples, "--sweeps", sweeps)
    assert (off_and_u(found)[0] < 1.6).all()
    assert " of 7414 samples, they had waited in a buffer: they come every 2.5 ms" in in_brief(
        capsys, samples, "--sweeps", sweeps
    )


@pytest.mark.parametrize("name", ["log.csv", "flight.ULG", "imu.txt"])
def test_a_log_alone_is_told_the_options_that_say_how_it_was_turned(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_text("time_s,x_rad_s,y_rad_s,z_rad_s\n0,0,0,0\n", encoding="utf-8")
    assert main(["solve", str(tmp_path / name)]) == 2
    said = capsys.readouterr().err
    assert all(option in said for option in ("bad_option", "--turns", "--sweeps", "--attitudes", "rig allan"))


@pytest.mark.parametrize("option", [["--gravity-m-s2", "9.8"], ["--any-mounting"], ["--columns", "c.yaml"]])
def test_an_option_for_logs_of_others_is_not_ignored_with_a_run(
    option: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert f"bad_option: {option[0]} is for samples" in refused(capsys, RECORDINGS / "verified", *option)


def test_readings_of_the_future_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [DOCS / "examples" / "samples.csv", "--sweeps", DOCS / "examples" / "sweeps.csv"]
    assert "bad_option: --recorded is 2999-01-01" in refused(capsys, *files, "--recorded", "2999-01-01")


@pytest.mark.slow
def test_a_rate_that_few_gyroscopes_read_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = swept(50)
    rows = log.rows * [1, 1, 1, 1, 1, np.degrees(1)]
    samples, sweeps = write_rates(tmp_path, replace(log, readings=np.degrees(log.readings), rows=rows))
    said = in_brief(capsys, samples, "--sweeps", sweeps)
    assert "the sweeps turn at up to 90 rad/s (5157 °/s), faster than most gyroscopes can read: if both files" in said


@pytest.mark.slow
def test_half_turns_given_as_whole_ones_are_suspected(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = swept(50)
    for angle, is_said in ((1.0, False), (2.0, True), (0.5, True)):
        stated = replace(log, rows=log.rows * [1, 1, 1, 1, 1, angle])
        said = in_brief(capsys, *_interleave(write_rates(tmp_path, stated)))
        assert ("half turns given as whole ones?" in said) == is_said, said
