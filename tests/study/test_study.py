"""The studies: each runs small with a fixed seed, and what it was made to show holds."""

import csv
import sys
import warnings
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from firmware_host.installation import install_command
from rig.cli import main
from rig.study import simulation as sim
from rig.study.files import write
from rig.study.study_catalogue import STUDIES, find
from rig.study.study_report import Settings, StudyReport

pytestmark = pytest.mark.slow

RUNS = {"normal": 15, "extreme": 15, "estimators": 50, "kvh-gyro": 3, "kvh-accelerometer": 25}


@cache
def report(name: str) -> StudyReport:
    """The study run small, once for all tests."""
    return find(name).run(Settings(seed=3, runs=RUNS.get(name, 50)))


def found(name: str, quantity: str) -> float:
    return next(finding.value for finding in report(name).findings if finding.quantity == quantity)


@pytest.mark.thorough
@pytest.mark.one_in(2)
@pytest.mark.parametrize("name", ["normal", "extreme"])
def test_the_published_bands_are_those_of_whole_turns_at_3_rad_s(name: str) -> None:
    ratios = {
        finding.quantity: finding.ratio for finding in report(name).findings if finding.published and finding.ratio
    }
    fitting = [ratio for quantity, ratio in ratios.items() if "3 rad/s" in quantity and "whole_turns" in quantity]
    assert len(fitting) == 4
    assert all(0.75 < ratio < 1.25 for ratio in fitting)


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["normal", "extreme"])
def test_the_speed_and_vibration_that_six_states_do_not_give_its_bands(name: str) -> None:
    for kind in ("60°/s, noise 0.035 rad/s, whole_turns", "3 rad/s, noise 0.035 rad/s, white"):
        ratios = [finding.ratio or 1.0 for finding in report(name).findings if kind in finding.quantity]
        assert any(not 0.75 < ratio < 1.25 for ratio in ratios)


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["normal", "extreme"])
def test_levenberg_marquardt_and_algorithm_1_agree(name: str) -> None:
    assert found(name, "largest difference of std, Algorithm 1 and Levenberg–Marquardt") < 1e-5


@pytest.mark.thorough
def test_the_bias_error_is_level_in_speed_only_with_a_fixed_number_of_samples() -> None:
    assert found("speed", "power of speed in the bias MSE, fixed_samples") == pytest.approx(0, abs=0.05)
    assert found("speed", "power of speed in the scale MSE, fixed_samples") == pytest.approx(-2, abs=0.05)
    assert found("speed", "power of speed in the bias MSE, whole_turn") == pytest.approx(1, abs=0.05)
    assert found("speed", "power of speed in the scale MSE, whole_turn") == pytest.approx(-1, abs=0.05)


def test_algorithm_1_converges_up_to_half_the_squared_speed_and_the_closed_form_beyond() -> None:
    assert 0.48 <= found("convergence", "largest β0/ω² at which Algorithm 1 converges") < 0.5
    assert found("convergence", "largest error of the closed form, β0/ω² up to 32") < 1e-12


def test_table_1_counts_passes_to_four_decimals_near_3_rad_s() -> None:
    counts = [finding for finding in report("convergence").findings if "to four decimals" in finding.quantity]
    assert [finding.ratio for finding in counts] == [1.0, 1.0, 1.0]
    speeds = [finding.value for finding in report("convergence").findings if "first pass implies" in finding.quantity]
    assert all(2.5 < speed < 3.7 for speed in speeds)


def test_squaring_before_averaging_shrinks_the_scale_factor() -> None:
    name = "mean error of the scale factor, {}, noise {} rad/s"
    assert found("averaging", name.format("square_then_mean", 0.2)) == pytest.approx(-5.2, abs=0.3)
    assert found("averaging", name.format("square_then_mean", 0.035)) == pytest.approx(-0.3, abs=0.05)
    assert found("averaging", name.format("mean_then_square", 0.2)) == pytest.approx(0, abs=0.05)


def test_drawn_moments_are_those_of_real_samples() -> None:
    rng = np.random.default_rng(5)
    sweep = sim.SimulatedSweep(2.0, 0.3, 12)
    F, bias, runs = np.diag([1.1, 0.9, 1.0]), np.array([0.1, -0.2, 0.05]), 20000
    mean, square = sim.draw_means_and_squares(rng, np.broadcast_to(F, (runs, 3, 3)), bias, sweep)
    vibration = sim.VIBRATION_FRACTION * sweep.speed_rad_s * rng.normal(size=(runs, sweep.samples))
    speed = sweep.speed_rad_s + vibration - vibration.mean(axis=1, keepdims=True)
    samples = speed[..., None] * F[0] - bias + sweep.noise_rad_s * rng.normal(size=(runs, sweep.samples, 3))
    drawn, real = (mean[:, 0], square[:, 0] - mean[:, 0] ** 2), (samples.mean(axis=1), samples.var(axis=1))
    for ours, theirs in zip(drawn, real, strict=True):
        assert ours.mean(axis=0) == pytest.approx(theirs.mean(axis=0), abs=3e-3)
        assert np.cov(ours.T) == pytest.approx(np.cov(theirs.T), abs=3e-4)


def test_calibration_takes_the_error_out_of_the_swing() -> None:
    for axis in "xyz":
        before = abs(found("sine", f"mean error of {axis} before calibration"))
        assert abs(found("sine", f"mean error of {axis} after calibration")) < 0.1 * before


@pytest.mark.thorough
def test_every_estimator_reaches_its_bound() -> None:
    ratios = [finding.value for finding in report("estimators").findings if finding.quantity.startswith("MSE/bound")]
    assert len(ratios) >= 10
    assert all(0.9 < ratio < 1.05 for ratio in ratios)


@pytest.mark.thorough
def test_the_vector_model_with_rests_halves_the_bias_error_and_more() -> None:
    name = "{} MSE, Algorithm 1 over vector model with rests, {}"
    assert found("estimators", name.format("bias", "60°/s")) > 4
    assert found("estimators", name.format("bias", "3 rad/s")) > 6.5
    assert found("estimators", name.format("scale", "60°/s")) == pytest.approx(1, abs=0.1)


def test_mounting_does_not_matter_but_right_angles_do() -> None:
    name = "RMS scale error without noise, six_observation, {}"
    assert found("misalignment", name.format("mounting 20°")) < 1e-9
    straight = found("misalignment", name.format("non-orthogonality, mounted straight 1°"))
    askew = found("misalignment", name.format("non-orthogonality, mounted 5.7° askew 1°"))
    assert straight == pytest.approx(0.025, rel=0.2)
    assert askew > 4 * straight
    vector = "RMS scale error without noise, vector_model, non-orthogonality, mounted 5.7° askew 2°"
    assert found("misalignment", vector) < 1e-9


@pytest.mark.thorough
def test_the_rate_table_gives_the_earths_rate_and_the_residual_it_was_given() -> None:
    assert found("kvh-gyro", "norm of the Earth's rate, random_walk, mean") == pytest.approx(15.4035, abs=0.05)
    assert found("kvh-gyro", "largest residual std, residual") == pytest.approx(0.0475, rel=0.03)
    assert found("kvh-gyro", "largest residual std, random_walk") < 0.03 * 0.0475
    assert found("kvh-gyro", "printed Earth rate against 7.2921159e-5 rad/s") == pytest.approx(2.41, abs=0.01)
    assert found("kvh-gyro", "RMS error of the drifting bias, all parameters estimated") < 0.05


def test_second_order_terms_take_the_accelerometers_residual_down() -> None:
    second, first = (
        found("kvh-accelerometer", f"largest mean residual of an attitude, {order}")
        for order in ("with second-order terms", "first order only")
    )
    assert second < 0.05
    assert first > 0.5
    assert found("kvh-accelerometer", "largest residual std, with second-order terms") == pytest.approx(
        0.3901, rel=0.02
    )
    assert found("kvh-accelerometer", "RMS error of the drifting bias, all parameters estimated") < 0.01
    columns = report("kvh-accelerometer").columns
    ratios = np.array(columns["std_over_runs"]) / np.array(columns["std_by_covariance"])
    assert ratios.mean() == pytest.approx(1, abs=0.1)


@pytest.mark.thorough
@pytest.mark.proof
def test_every_study_writes_its_table_findings_and_plots(tmp_path: Path, thorough: bool) -> None:
    for name in STUDIES if thorough else sorted(STUDIES)[:3]:
        written = write(report(name), tmp_path, name, "csv")
        assert [path.suffix for path in written] == [".csv", ".csv", ".svg", ".png"]
        assert all(path.stat().st_size > 100 for path in written)
        with written[0].open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        assert len(rows) == len(next(iter(report(name).columns.values())))


@pytest.mark.thorough
def test_a_table_as_parquet_reads_back(tmp_path: Path) -> None:
    from pyarrow import parquet

    path = write(report("speed"), tmp_path, "speed", "parquet")[0]
    assert parquet.read_table(path)["scale_mse"].to_pylist() == report("speed").columns["scale_mse"]


@pytest.mark.thorough
def test_results_do_not_depend_on_the_number_of_processes() -> None:
    alone, shared = (find("averaging").run(Settings(seed=3, runs=20, jobs=jobs)) for jobs in (1, 2))
    assert alone.columns == shared.columns


@pytest.mark.thorough
def test_results_do_not_depend_on_a_dask_cluster(tmp_path: Path) -> None:
    from distributed import LocalCluster

    arguments = ["study", "averaging", "--runs", "20"]
    local = {"n_workers": 1, "threads_per_worker": 2, "processes": False, "dashboard_address": None}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # distributed's own, about the loop it closes
        with LocalCluster(**local) as cluster:
            address = cluster.scheduler_address
            assert main([*arguments, "--dask", address, "--out", str(tmp_path / "cluster")]) == 0
    assert main([*arguments, "--out", str(tmp_path / "here")]) == 0
    there, here = ((tmp_path / folder / "averaging.csv").read_text() for folder in ("cluster", "here"))
    assert there == here


def test_the_command_lists_studies_and_refuses_unknown_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study"]) == 0
    listed = " ".join(capsys.readouterr().out.split())
    assert (
        all(name in listed for name in STUDIES)
        and listed.count("about ") >= sum(study.core_s is not None for study in STUDIES.values()) > 0
    )
    assert main(["study", "nosuch"]) == 2
    assert "Choose one of normal" in capsys.readouterr().err


@pytest.mark.thorough
def test_the_command_prints_findings_and_shows_no_bar_off_a_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["study", "speed", "--runs", "10", "--seed", "7", "--out", str(tmp_path)]
    assert main(arguments) == 0
    captured = capsys.readouterr()
    assert "study speed" in captured.out
    assert captured.err.splitlines() == [f"written: {path}" for path in _files(tmp_path)]
    first = (tmp_path / "speed.csv").read_text()
    assert main(arguments) == 0
    assert (tmp_path / "speed.csv").read_text() == first


def _files(folder: Path) -> list[Path]:
    return [folder / name for name in ("speed.csv", "speed-findings.csv", "speed.svg", "speed.png")]


def test_a_missing_library_is_named_with_its_extra(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["study", "speed"]) == 2
    assert install_command("study") in capsys.readouterr().err
