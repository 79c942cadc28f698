"""A gyroscope solved by how far it turned between attitudes that a reference tells: real cameras, simulated ones."""

import gzip
import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.analysis.external.increment_calibration import IncrementCalibration, solve_turning
from rig.cli import main
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.external.increment_solution import IncrementSolution
from rig.estimation.reference.reference_budget import scale_and_bias_covariance
from rig.observation.external.reference_rows import Turning
from support.external.followed_body import EARTH_RAD_S, Followed, World, follow, turning, write
from support.external.real import recording

BY_INTEGRAL, KNOWN_TO = np.array([1.0008, 1.0038, 1.0009]), np.array([0.0003, 0.0015, 0.0013])  # its README

pytestmark = pytest.mark.slow

HAND = World()
WORLDS = {
    "as cameras are": HAND,
    "slow": World(duration_s=80, swing_rad=0.5, fastest_s=6),
    "fast, quiet reference": World(duration_s=30, rate_hz=200, fastest_s=1, attitude_rad=5e-4),
    "short": World(duration_s=14),
    "errors that last half a second": World(colour_s=0.5),
    "noisy gyroscope, few looks": World(random_walk_rad_sqrt_s=3e-3, looks_hz=4),
    "wandering bias": World(bias_walk_rad_s_sqrt_s=1e-4),
}


def solved(followed: Followed, window_s: float | None = None) -> IncrementCalibration:
    return solve_turning(turning(followed), window_s, any_mounting=False)


def in_unit(found: IncrementSolution) -> tuple[Array, Array]:
    """Scale factors (3,), and the standard deviations of scale and bias (6,)."""
    matrix = found.matrix
    scale = 1 / np.linalg.norm(matrix, axis=1)
    return scale, np.sqrt(np.diag(scale_and_bias_covariance(matrix, scale, found.covariance)))


def off(found: IncrementCalibration, followed: Followed) -> Array:
    """(6,) errors of scale and bias in standard uncertainties."""
    scale, std = in_unit(found.solution)
    truth = 1 / np.linalg.norm(followed.matrix, axis=1)
    return np.concatenate([scale - truth, found.solution.bias - followed.bias]) / std


@cache
def before_cameras() -> Turning:
    tables = []
    for name in ("samples", "attitudes"):
        with gzip.open(recording("broad") / f"{name}.csv.gz", "rt") as file:
            tables.append(np.loadtxt(file, delimiter=",", skiprows=1))
    samples, rows = tables
    attitudes = Rotation.from_quat(rows[:, [3, 4, 5, 2]]).as_matrix()
    return Turning(samples[:, 0], samples[:, 1:4], rows[:, :2], attitudes)


@pytest.mark.one_in(4)  # the window that is chosen, and one that is given; the others take the same way
@pytest.mark.parametrize("window_s", [None, 1.0, 2.0, 3.0, 4.0])
def test_real_cameras_tell_the_same_scale_whatever_the_window(window_s: float | None) -> None:
    found = solve_turning(before_cameras(), window_s, any_mounting=False)
    scale, std = in_unit(found.solution)
    assert (np.abs(scale - BY_INTEGRAL) < 2 * 2 * std[:3]).all(), (scale, 2 * std)
    assert (2 * std[:3] < (3e-3 if window_s == 3.0 else 2e-3)).all(), "and it says something; 3 s leave 40 increments"
    assert found.solution.clock_s == pytest.approx(4.1e-3, abs=3e-4)  # as --estimate-clock-offset finds it
    assert isinstance(found.solution.earth, Fault), "nobody sees the Earth's rate by a hand-held phone's gyroscope"


@pytest.mark.thorough
@pytest.mark.proof
@pytest.mark.parametrize(
    "world",
    [pytest.param(world, marks=() if world is HAND else pytest.mark.thorough) for world in WORLDS.values()],
    ids=WORLDS,
)
def test_uncertainties_are_those_of_many_recordings(world: World, thorough: bool) -> None:
    """The errors of these references do not repeat with the attitude, which U allows for: so u exceeds their RMS."""
    draws = 200 if thorough else 12
    errors = np.array([off(solved(each), each) for each in (follow(world, seed) for seed in range(draws))])
    for each in (errors[:, :3], errors[:, 3:]):
        rms, within = float(np.sqrt(np.mean(each**2))), float(np.mean(np.abs(each) < 2))
        print(f"RMS of error / u {rms:.2f}, {100 * within:.1f} % within U")
        assert 0.4 < rms < (1.1 if thorough else 1.3)
        assert within > (0.93 if thorough else 0.85)


def test_the_noise_of_a_references_rates_does_no_harm(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Taken for exact, they make the scale too large by more than their own noise says; by default none is used."""
    followed = follow(HAND, 1)
    noisy = followed.rates_rad_s + np.random.default_rng(1).normal(size=followed.rates_rad_s.shape) * 0.15
    files = write(tmp_path, followed, noisy)
    truth = 1 / np.linalg.norm(followed.matrix, axis=1)

    def away(*options: str) -> Array:
        rate = document(capsys, files, *options)
        std = np.sqrt(np.diag(rate["covariance"]))[:3]
        return np.asarray(np.abs(np.array(rate["scale"]) - truth) / std)

    assert (away() < 3).all()
    assert (away("--exact-rates") > 3).any(), "which is why it has to be said"


def test_the_earths_rate_is_told_only_where_it_is_seen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    followed = follow(World(duration_s=20), 2)
    noisy = followed.rates_rad_s + np.random.default_rng(2).normal(size=followed.rates_rad_s.shape) * 0.05
    files = write(tmp_path, followed, noisy)
    rate = document(capsys, files)
    assert rate["in_attitudes"]["earth_rate_rad_s"] is None
    assert rate["in_attitudes"]["earth_rate_error"].startswith("earth_rate_not_observable")
    assert main(command(files, "--exact-rates", "--all")) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Earth's rate: earth_rate_not_observable" in said and "Earth's rate in table" not in said


def test_a_gyroscope_that_sees_the_earth_tells_it() -> None:
    quiet = World(random_walk_rad_sqrt_s=3e-6, attitude_rad=1e-5, duration_s=60)
    earth = solved(follow(quiet, 3)).solution.earth
    assert not isinstance(earth, Fault)
    std = np.sqrt(np.diag(earth.covariance_rad2_s2))
    assert (np.abs(earth.rate_rad_s - EARTH_RAD_S) < 4 * std).all() and std.max() < 7e-6


def test_a_reference_that_is_milliseconds_late_changes_nothing() -> None:
    punctual, late = (solved(follow(replace(HAND, late_s=late_s), 4)) for late_s in (0.0, 0.006))
    assert late.solution.clock_s == pytest.approx(punctual.solution.clock_s + 0.006, abs=1e-4)
    _, std = in_unit(punctual.solution)
    assert (np.abs(late.solution.matrix - punctual.solution.matrix) < std[:3].min()).all()


def damaged(followed: Followed, change: str) -> Followed:
    """The recording with half a second of it spoilt at 20 s."""
    spoilt = (followed.time_s > 20) & (followed.time_s < 20.5)
    readings = followed.readings.copy()
    if change == "lost_samples":
        return replace(followed, time_s=followed.time_s[~spoilt], readings=readings[~spoilt])
    if change == "saturation":
        readings[:, 0] = np.clip(readings[:, 0], None, np.sort(readings[:, 0])[-12])
    else:
        readings[spoilt] += 100.0
    return replace(followed, readings=readings)


@pytest.mark.parametrize("name", ["lost_samples", "saturation", "turned_too_fast"])
def test_a_gyroscope_is_not_followed_where_it_cannot_be(name: str) -> None:
    followed = follow(HAND, 5)
    found = solved(damaged(followed, name))
    assert [each.name for each in found.left_out] == [name]
    assert 1 <= found.left_out[0].count <= 8
    assert (np.abs(off(found, followed)) < 4).all()


def test_a_gap_in_the_samples_costs_its_windows_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    followed = follow(World(duration_s=20), 12)
    spoilt = (followed.time_s > 10) & (followed.time_s < 10.5)
    files = write(tmp_path, replace(followed, time_s=followed.time_s[~spoilt], readings=followed.readings[~spoilt]))
    rate = document(capsys, files)
    (left_out,) = rate["in_attitudes"]["by_increments"]["omitted"]
    assert left_out["error"] == "lost_samples" and left_out["count"] <= 3
    assert main(command(files, "--all")) == 0
    assert "increments, lost_samples, for up to 0.5" in " ".join(capsys.readouterr().out.split())


def test_rows_that_last_while_the_body_turns_are_no_rests() -> None:
    """Rows of 0.6 s, one after the other, from a reference that looks in their middle."""
    followed = follow(World(duration_s=60, looks_hz=1 / 0.6, fastest_s=6), 13)
    found = solved(followed)
    assert len(found.solution.residuals_rad) < 100, "a row at rest would be two fixes"
    assert (np.abs(off(found, followed)) < 4).all()


def test_a_marker_taken_for_another_is_set_aside() -> None:
    followed = follow(HAND, 6)
    attitudes = followed.attitudes.copy()
    elsewhere = (followed.looks_s > 20) & (followed.looks_s < 22)
    attitudes[elsewhere] = Rotation.from_rotvec([0, 0.2, 0]).as_matrix() @ attitudes[elsewhere]
    attitudes[400] = np.eye(3)  # one look alone is outvoted by those beside it
    found = solved(replace(followed, attitudes=attitudes))
    assert 1 <= found.solution.set_aside <= 4
    assert (np.abs(off(found, followed)) < 4).all()


def test_a_body_laid_down_ten_times_is_solved_by_the_moves_between() -> None:
    """Each lying has an error of its own, which its beginning and its end share."""
    still = [laid_down(seed) for seed in range(2)]
    found = [solve_turning(each, None, any_mounting=False) for _, each in still]
    errors = np.array([off(each, followed) for each, (followed, _) in zip(found, still, strict=True)])
    assert np.sqrt(np.mean(errors[:, :3] ** 2)) < 1.6
    assert len(found[0].solution.residuals_rad) == 2 * 13 - 1 and found[0].solution.fix_std_rad < 6e-3


def laid_down(seed: int) -> tuple[Followed, Turning]:
    """Thirteen rests of 2 s with moves of 1.5 s between them, laid down within 2 mrad."""
    rng = np.random.default_rng(seed)
    faces = Rotation.random(13, random_state=seed)
    time_s = np.arange(round(13 * 3.5 * 200)) / 200
    attitudes = np.zeros((len(time_s), 3, 3))
    rates = np.zeros((len(time_s), 3))
    for place, (face, following) in enumerate(zip(faces, [*faces[1:], faces[12]], strict=True)):
        move = (face.inv() * following).as_rotvec()
        own = (time_s >= 3.5 * place) & (time_s < 3.5 * (place + 1))
        share = np.clip((time_s[own] - 3.5 * place - 2) / 1.5, 0, 1)
        way = share - np.sin(2 * np.pi * share) / (2 * np.pi)
        attitudes[own] = (face * Rotation.from_rotvec(way[:, None] * move)).as_matrix()
        rates[own] = (1 - np.cos(2 * np.pi * share))[:, None] / 1.5 * move
    matrix, bias = np.eye(3) + 0.02 * rng.normal(size=(3, 3)), 0.01 * rng.normal(size=3)
    felt = (rates + EARTH_RAD_S @ attitudes) @ matrix.T + bias + rng.normal(size=rates.shape) * 3e-4 * np.sqrt(200)
    start_s = 3.5 * np.arange(13, dtype=np.float64) + 0.1
    told = np.asarray((Rotation.from_rotvec(rng.normal(size=(13, 3)) * 2e-3) * faces).as_matrix())
    followed = Followed(time_s, felt, start_s, told, np.zeros((13, 3)), matrix, bias)
    return followed, Turning(time_s, felt, np.column_stack([start_s, start_s + 1.8]), told)


def test_a_stated_attitude_error_says_which_rows_are_worth_more(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    followed = follow(HAND, 7)
    bad = followed.looks_s > 20
    worse = Rotation.from_rotvec(np.random.default_rng(7).normal(size=(int(bad.sum()), 3)) * 0.03).as_matrix()
    attitudes = followed.attitudes.copy()
    attitudes[bad] = worse @ attitudes[bad]
    spoilt = replace(followed, attitudes=attitudes)
    blind = in_unit(solved(spoilt).solution)[1]
    told = turning(spoilt)
    told = replace(told, std_rad=np.where(bad, 0.03, 0.003))
    found = solve_turning(told, None, any_mounting=False)
    assert (in_unit(found.solution)[1][:3] < 0.8 * blind[:3]).all()
    assert (np.abs(off(found, followed)) < 4).all()


def test_what_cannot_be_solved_is_refused_by_name() -> None:
    followed = follow(HAND, 8)
    refused: dict[str, Followed] = {
        "inverted_attitudes": replace(followed, attitudes=np.swapaxes(followed.attitudes, 1, 2)),
        "attitude_untrustworthy": replace(followed, attitudes=follow(HAND, 9).attitudes),
        "wrong_unit": replace(followed, readings=followed.readings * 180 / np.pi),
        "mirrored_axis": replace(followed, readings=followed.readings * [1, 1, -1]),
        "swapped_axes": replace(followed, readings=followed.readings[:, [1, 2, 0]]),
        "too_few_observations": replace(followed, looks_s=followed.looks_s[:100], attitudes=followed.attitudes[:100]),
    }
    for name, each in refused.items():
        with pytest.raises(Fault, match=name):
            solved(each)


def test_a_body_that_turns_about_one_axis_does_not_tell_a_sensor() -> None:
    followed = follow(World(random_walk_rad_sqrt_s=0, attitude_rad=0), 10)
    angle = 2 * np.sin(followed.looks_s)
    rates = np.column_stack(
        [np.zeros_like(followed.time_s), np.zeros_like(followed.time_s), 2 * np.cos(followed.time_s)]
    )
    about_z = Rotation.from_euler("z", angle[:, None]).as_matrix()
    with pytest.raises(Fault, match=r"rank_deficient|ill_conditioned"):
        solved(replace(followed, readings=rates, attitudes=about_z))


def test_a_sensor_may_be_mounted_otherwise_than_the_body_if_this_is_stated() -> None:
    followed = follow(HAND, 11)
    over = Rotation.from_euler("xyz", [20, -50, 130], degrees=True).as_matrix()
    turned = replace(followed, readings=followed.readings @ over.T, matrix=over @ followed.matrix)
    with pytest.raises(Fault, match=r"swapped_axes|mirrored_axis|wrong_mounting"):
        solved(turned)
    found = solve_turning(turning(turned), None, any_mounting=True).solution
    assert found.matrix == pytest.approx(turned.matrix, abs=3e-3)


def command(files: list[Path], *options: str) -> list[str]:
    return ["solve", str(files[0]), "--attitudes", str(files[1]), *options]


def document(capsys: pytest.CaptureFixture[str], files: list[Path], *options: str) -> dict[str, Any]:
    """What is said of the gyroscope for machines."""
    assert main([*command(files, *options), "--json"]) == 0
    rate: dict[str, Any] = json.loads(capsys.readouterr().out)["gyroscopes"]["imu"]
    return rate
