"""Files of others whose rows contradict each other, or of sensors that feel nothing: refused by name, or a wider U."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.analysis.external.attitudes import solve_placed
from rig.analysis.external.external_recordings import budget_of, solve_swept
from rig.analysis.external.increment_calibration import IncrementCalibration
from rig.data.quantity import ACCELERATION, RATE, Quantity
from rig.data.recording.settings import Site, SolveOptions
from rig.errors import Fault, Refused
from rig.observation.external.attitude_import import average_placements, read_attitudes
from rig.observation.external.csv_import import ExternalData, average, average_sweeps, read_sweeps
from rig.observation.external.csv_samples import Samples, read_samples
from support.external.loggers import MATRIX
from support.external.loggers import SCALE as OF_MATRIX
from support.paths import DOCS

EXAMPLES = DOCS / "examples"
SCALE = np.array([1.1771, 1.1554, 1.1440])  # what the example was made with
SITE = Site(up=(0, 0, -1.0), gravity_m_s2=9.80061, earth_rate_rad_s=None)
ASKED = SolveOptions(any_mounting=False, find_clock=False, exact_rates=False)


def swept(row: int, factor: float) -> ExternalData:
    """The example's sweeps, one of whose rows states another angle."""
    sweeps = read_sweeps(EXAMPLES / "sweeps.csv")
    sweeps["angle_rad"][row - 1] *= factor
    return average_sweeps(read_samples(EXAMPLES / "samples.csv", [RATE]), sweeps)


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.5, 2.0])
@pytest.mark.parametrize("row", [1, 3])
def test_of_two_sweeps_about_an_axis_both_are_named_for_either_may_be_wrong(row: int, factor: float) -> None:
    both = "bad_sweep: of sweeps 1 and 3, the only ones about their axis, one contradicts the other by "
    with pytest.raises(Refused, match=both + r"\d+ % of its rate"):
        solve_swept(swept(row, factor), None)
    with pytest.raises(Refused, match=both):
        solve_swept(swept(row, factor), "newton")


def test_a_sweep_whose_axis_has_the_wrong_sign_is_no_stuck_sensor() -> None:
    sweeps = read_sweeps(EXAMPLES / "sweeps.csv")
    for axis in "xyz":
        sweeps[f"axis_{axis}"][2] *= -1
    with pytest.raises(Refused, match="bad_sweep: sweeps 1 and 3 have the opposite sign to what their axes state"):
        average_sweeps(read_samples(EXAMPLES / "samples.csv", [RATE]), sweeps)


def test_two_rows_that_are_exchanged_are_no_mirrored_axis() -> None:
    sweeps = read_sweeps(EXAMPLES / "sweeps.csv")
    for axis in "xyz":
        sweeps[f"axis_{axis}"][[2, 6]] = sweeps[f"axis_{axis}"][[6, 2]]
    with pytest.raises(Refused, match=r"bad_sweep: "):
        solve_swept(average_sweeps(read_samples(EXAMPLES / "samples.csv", [RATE]), sweeps), None)


def test_a_row_too_coarse_to_show_noise_is_named() -> None:
    samples = read_samples(EXAMPLES / "samples.csv", [RATE])
    coarse = replace(samples, readings={RATE: 0.2 * np.rint(samples.readings[RATE] / 0.2)})
    with pytest.raises(Fault, match=r"stuck_sensor: in row \d+, from .* too coarse to show its noise"):
        average_sweeps(coarse, read_sweeps(EXAMPLES / "sweeps.csv"))


def test_half_a_turn_given_as_a_whole_one_is_refused_by_its_row_if_others_contradict_it() -> None:
    whole = read_sweeps(EXAMPLES / "sweeps.csv")
    sweeps = {name: np.concatenate([column[:1], column]) for name, column in whole.items()}
    sweeps["end_s"][0] = sweeps["start_s"][1] = 4.0  # row 1 in two halves
    sweeps["angle_rad"][:2] = [2 * np.pi, np.pi]
    with pytest.raises(Refused, match="bad_sweep: sweep 1 contradicts the others by "):
        solve_swept(average_sweeps(read_samples(EXAMPLES / "samples.csv", [RATE]), sweeps), None)


@pytest.mark.slow
def test_what_sweeps_contradict_each_other_by_is_in_the_uncertainty() -> None:
    sound, contradicting = (solve_swept(swept(1, factor), None) for factor in (1.0, 1.03))
    std = np.sqrt(np.diag(contradicting.covariance))[:3]
    assert (std > 3 * np.sqrt(np.diag(sound.covariance))[:3]).all()
    assert (np.abs(contradicting.scale - SCALE) < 3 * std).all()
    budget = budget_of(contradicting, swept(1, 1.03))
    assert [line.name for line in budget.contributors] == ["noise", "sweeps"]
    assert sum(line.covariance for line in budget.contributors) == pytest.approx(contradicting.covariance)
    of_sound = budget_of(sound, swept(1, 1.0))
    assert [line.name for line in of_sound.contributors] == ["noise", "sweeps"]
    assert (of_sound.expanded < 4 * of_sound.std_of("noise")).all()


@pytest.mark.one_in(3)  # the table without an error and with the largest
@pytest.mark.proof
@pytest.mark.slow
@pytest.mark.parametrize("table_error", [0.0, 1.5e-5, 1e-4, 3e-3])
def test_where_few_rows_are_left_uncertainty_covers_whatever_the_table_errs_by(
    table_error: float, thorough: bool
) -> None:
    """Six sweeps and a rest, the noise of each of which is 1.6e-5 of the rate."""
    rests, seeds = 1, 200 if thorough else 10
    speed_rad_s, row_s, noise_rad_s = np.pi / 2, 5.0, 5e-4
    axes = np.array([*np.eye(3), *-np.eye(3), *np.tile([0.0, 0.0, 1.0], (rests, 1))])
    speeds, starts_s = np.array([speed_rad_s] * 6 + [0.0] * rests), row_s * np.arange(6 + rests, dtype=np.float64)
    time_s = np.arange(round((6 + rests) * row_s * 100)) / 100
    rates = (speeds[:, None] * axes)[(time_s // row_s).astype(int)] @ MATRIX.T
    within = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        samples = np.column_stack([time_s, rates + noise_rad_s * rng.normal(size=rates.shape)])
        stated = speeds * (1 + table_error * rng.normal(size=len(speeds)))
        data = average(samples, np.column_stack([starts_s + 0.3, starts_s + 4.3, stated]), axes)
        solution = solve_swept(data, None)
        within.append(np.abs(solution.scale - OF_MATRIX) < budget_of(solution, data).expanded[:3])
    assert np.mean(within) > 0.9


def test_three_sweeps_and_a_rest_tell_nothing_of_the_table_and_so_does_their_uncertainty() -> None:
    rng = np.random.default_rng(0)
    time_s = np.arange(2000) / 100
    axes = np.vstack([np.eye(3), [0.0, 0.0, 1.0]])
    speeds = np.array([1.0, 1.0, 1.0, 0.0])
    rates = (speeds[:, None] * axes)[(time_s // 5).astype(int)] @ MATRIX.T + 1e-3 * rng.normal(size=(2000, 3))
    begins_s = 5 * np.arange(4, dtype=np.float64)
    rows = np.column_stack([begins_s + 0.3, begins_s + 4.3, speeds])
    data = average(np.column_stack([time_s, rates]), rows, axes)
    expanded = budget_of(solve_swept(data, None), data).expanded
    assert (expanded[:3] > 1e-3).all() and (expanded[:3] < 0.1).all()


def test_rows_outside_the_recording_are_not_covered_and_lack_no_samples() -> None:
    samples, rows = read_samples(EXAMPLES / "swinging_samples.csv"), read_attitudes(EXAMPLES / "swinging_attitudes.csv")
    ends_s = float(rows["end_s"][479])
    kept = samples.time_s <= ends_s
    cut = replace(
        samples, time_s=samples.time_s[kept], readings={each: of[kept] for each, of in samples.readings.items()}
    )
    placed = average_placements(cut, rows)
    assert [str(each) for each in placed.omitted] == [
        f"120 of 600 rows, not covered by the recording; the first row 481, from {ends_s:.10g} s"
    ]
    assert placed.incomplete == ()


@pytest.mark.slow
def test_poses_in_any_order_and_repeated_ones_are_placed_by_their_times(tmp_path: Path) -> None:
    samples = read_samples(EXAMPLES / "swinging_samples.csv")
    rows = read_attitudes(EXAMPLES / "swinging_attitudes.csv")
    names = ("qw", "qx", "qy", "qz")
    poses = np.column_stack([(rows["start_s"] + rows["end_s"]) / 2, *(rows[name] for name in names)])
    shuffled = np.random.default_rng(1).permutation(len(poses))
    path = tmp_path / "poses.csv"
    matrices = []
    for table in (poses, np.vstack([poses[shuffled], poses[100:110]])):
        np.savetxt(path, table, delimiter=",", header=",".join(["time_s", *names]), comments="", fmt="%.17g")
        placed = average_placements(samples, read_attitudes(path))
        result = solve_placed("imu", placed, SITE, ASKED, None, second_order=False).results[RATE]
        assert isinstance(result, IncrementCalibration)
        matrices.append(result.solution.matrix)
    assert matrices[1] == pytest.approx(matrices[0], rel=1e-9)
    assert [str(entry) for entry in placed.omitted] == [
        "10 of 610 rows, they repeat the time of another attitude; the first row 601"
    ]


@pytest.mark.slow
def test_a_clock_that_runs_fast_is_refused_unless_its_offset_is_estimated() -> None:
    samples = read_samples(EXAMPLES / "swinging_samples.csv")
    rows = read_attitudes(EXAMPLES / "swinging_attitudes.csv")
    fast = replace(samples, time_s=1.004 * samples.time_s)
    with pytest.raises(Fault, match=r"clocks_apart: the clock of the attitudes gains -0.4 % on that of the samples"):
        average_placements(fast, rows)
    clock = average_placements(fast, rows, find_clock=True).clock
    assert clock is not None and clock.drift == pytest.approx(-0.004, rel=0.01)


def constant(samples: Samples, quantity: Quantity, value: float) -> Samples:
    """The z axis of a sensor has one value throughout."""
    readings = {each: column.copy() for each, column in samples.readings.items()}
    readings[quantity][:, 2] = value
    return replace(samples, readings=readings)


def by_sweeps(samples: Samples) -> object:
    return average_sweeps(samples, read_sweeps(EXAMPLES / "sweeps.csv"))


def by_attitudes(samples: Samples) -> object:
    placed = average_placements(samples, read_attitudes(EXAMPLES / "swinging_attitudes.csv"))
    raise solve_placed("imu", placed, SITE, ASKED, None, second_order=False).faults[RATE]


@pytest.mark.parametrize("value", [0.0, 0.01])
@pytest.mark.parametrize(("file", "solve"), [("samples.csv", by_sweeps), ("swinging_samples.csv", by_attitudes)])
def test_an_axis_that_reads_the_same_throughout_is_named(
    file: str, solve: Callable[[Samples], object], value: float
) -> None:
    stuck = constant(read_samples(EXAMPLES / file, [RATE]), RATE, value)
    with pytest.raises(Fault, match=f"stuck_sensor: the gyroscope reads {value:g} rad/s on z in every sample"):
        solve(stuck)


def test_a_rest_whose_readings_are_all_the_same_is_named() -> None:
    samples = constant(read_samples(EXAMPLES / "still_samples.csv"), ACCELERATION, 9.3)
    placed = average_placements(samples, read_attitudes(EXAMPLES / "still_attitudes.csv"))
    found = solve_placed("imu", placed, SITE, ASKED, None, second_order=False).faults[ACCELERATION]
    assert found.name == "stuck_sensor"
    assert "the accelerometer always reads 9.3 m/s² on z" in str(found) and "at the end of its range" in str(found)
