"""Sweeps that are no whole turns: what is found from them, how well, and what the encoders do to it."""

from typing import Any

import numpy as np
import pytest

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import ENCODERS, Budget
from rig.observation.observe import Observation
from support.recordings.checked_runs import check_run, list_failed, solve_inputs
from support.recordings.drawn_recording import KINDS, Drawn, drawn
from support.recordings.synthetic_run import Setup, synthetic_run, truth

pytestmark = pytest.mark.slow

STD_DEG = 0.05


def arcs(arc_deg: float, *, std_deg: float = STD_DEG, **more: Any) -> Setup:
    return Setup(procedure=(("arc_deg", f"{arc_deg:g}"),), angle_std_deg=std_deg, **more)


def errors(seen: Drawn) -> tuple[Array, Budget, tuple[Observation, ...]]:
    """(6,) scale and bias less the truth, and what is known of them."""
    found = solve_inputs(seen.run)[1]["gyro"]
    averages = [*(observation.average for observation in found.observations), *found.rests]
    inside = np.zeros(len(seen.time_s), dtype=np.bool_)
    for average in averages:
        inside |= (seen.time_s >= average.start_s) & (seen.time_s <= average.end_s)
    true = np.concatenate([seen.scale, -seen.bias_rad_s[inside].mean(axis=0)])
    assert found.uncertainty is not None
    return np.concatenate([found.scale, found.bias_rad_s]) - true, found.uncertainty, found.observations


@pytest.mark.thorough
@pytest.mark.one_in(2)
@pytest.mark.proof
@pytest.mark.parametrize("arc_deg", [90, 180, 270])
def test_errors_are_as_large_as_is_stated(arc_deg: float, thorough: bool) -> None:
    """RMS of error over u; of encoders that err as stated, independently at an arc's ends."""
    kind, seeds = KINDS["quiet LSM9DS1"], range(1, 61 if thorough else 5)
    found = [errors(drawn(seed, kind, arcs(arc_deg))) for seed in seeds]
    rms = [
        float(np.sqrt(np.mean([(error[place] / budget.std[place]) ** 2 for error, budget, _ in found])))
        for place in (slice(0, 3), slice(3, 6))
    ]
    print(f"{arc_deg:g}°, {len(seeds)} recordings: scale {rms[0]:.3f}, bias {rms[1]:.3f}")
    low, high = (0.85, 1.15) if thorough else (0.5, 1.7)
    assert low < min(rms) and max(rms) < high


@pytest.mark.parametrize("arc_deg", [90, 180])
def test_gravity_s_share_is_that_of_the_arc_s_attitudes(arc_deg: float) -> None:
    """Over an arc it does not average out: as of a whole turn, scale and bias would be off by a part in a hundred."""
    sensitive = tuple(tuple(row) for row in (0.01 * np.array([[1, 2, -1], [-2, 1, 1], [1, -1, 2]])).tolist())
    setup = arcs(arc_deg, noise_rad_s=1e-4, g_sensitivity_rad_s_per_g=sensitive, vibration=0.0)
    found = solve_inputs(synthetic_run(setup))[1]["gyro"]
    off = np.concatenate([found.scale, found.bias_rad_s]) - truth(setup)
    assert np.abs(off[:3]).max() < 1e-4
    assert np.abs(off[3:]).max() < 1e-4


def test_a_ripple_is_motion_and_no_noise() -> None:
    """What the readings add up to between the ends is held against what the encoders say of the same ends."""
    still, shaken = (
        solve_inputs(synthetic_run(arcs(180, noise_rad_s=1e-3, vibration=each)))[1]["gyro"] for each in (0, 0.05)
    )
    for found in (still, shaken):
        assert np.abs(found.scale - truth(Setup())[:3]).max() < 4e-4
    ratio = np.array([observation.average.variance_rad2_s2 for observation in shaken.observations]).mean() / (
        np.array([observation.average.variance_rad2_s2 for observation in still.observations]).mean()
    )
    assert ratio < 1.3  # 0.05 of the speed is fifty times the noise


def test_the_encoders_are_in_the_budget_as_they_are_stated() -> None:
    """√2 of a standard deviation over the arc, the same one way and back, so nothing of the bias."""
    for arc_deg in (90.0, 180.0):
        found = solve_inputs(synthetic_run(arcs(arc_deg, noise_rad_s=1e-3, mounting_error_rad=(0.0, 0.0, 0.0))))[1][
            "gyro"
        ]
        assert found.uncertainty is not None
        (line,) = (contributor for contributor in found.uncertainty.contributors if contributor.name == ENCODERS)
        assert line.std[:3] / found.scale == pytest.approx([np.sqrt(2) * STD_DEG / arc_deg] * 3, rel=0.02)
        assert np.abs(line.std[3:]).max() < 1e-6
        assert line.source == "uncertainty.angle_std_deg"
        assert line.half_width == pytest.approx(2 * STD_DEG)


def test_of_whole_turns_the_encoders_err_by_nothing() -> None:
    """What is stated of them changes no number."""
    stated, unstated = (
        solve_inputs(synthetic_run(Setup(noise_rad_s=1e-3, angle_std_deg=each)))[1]["gyro"] for each in (STD_DEG, None)
    )
    assert stated.uncertainty is not None and unstated.uncertainty is not None
    assert ENCODERS not in [contributor.name for contributor in stated.uncertainty.contributors]
    assert np.array_equal(stated.uncertainty.covariance, unstated.uncertainty.covariance)
    assert np.array_equal(stated.solution.scale, unstated.solution.scale)
    assert all(
        observation.angle_rad == 2 * np.pi and observation.arc_rad is None for observation in stated.observations
    )


@pytest.mark.proof
def test_encoder_errors_as_stated_fail_nothing_and_ten_times_as_large_ones_are_detected(thorough: bool) -> None:
    """Where cw and ccw pass the same angle, the parts of both sweeps err alike; a bias that drifts does not."""
    kind = KINDS["quiet LSM9DS1"]
    for seed in range(700, 720 if thorough else 702):
        assert list_failed(check_run(drawn(seed, kind, arcs(180)).run)) == set()
        assert "residuals" in list_failed(check_run(drawn(seed, kind, arcs(180, encoders_err=10.0)).run))
