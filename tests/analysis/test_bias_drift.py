"""The bias by repeat with F held and anew, of TRIAX's instrument on its table: errors beside their bounds."""

import numpy as np
import pytest

from rig.analysis.temperature.bias_drift import SLOPE, BiasDrift, DwellMean, fit_acceleration_drift, fit_rate_drift
from rig.data.recording.settings import Site
from rig.estimation.arrays import Array
from rig.estimation.reference.reference_model import BIAS, covariance_bound, whitening
from rig.study import rate_table as rt

SEEDS = 30
EARTH_RAD_S = rt.GYRO_REFERENCE_RAD_S * (rt.EARTH_RATE_RAD_S / np.linalg.norm(rt.GYRO_REFERENCE_RAD_S))
TURNED = rt.draw_attitudes(rt.ATTITUDES)


def stands(model: Array, biases: Array, variance: float, seed: int) -> list[list[DwellMean]]:
    """What is averaged in each attitude (N) of each repeat (R): the readings without a bias (N, 3), biases (R, 3)."""
    rng = np.random.default_rng(seed)
    return [
        [
            DwellMean(
                mean + bias + np.sqrt(variance) * rng.normal(size=3),
                np.full(3, variance),
                attitude.T,
                3600.0 * repeat + 360.0 * place,
                25.0,
            )
            for place, (mean, attitude) in enumerate(zip(model, TURNED, strict=True))
        ]
        for repeat, bias in enumerate(biases)
    ]


def bound(matrix: Array, reference: Array, variance: float) -> Array:
    """(3,) standard deviation of a bias found anew, by Cramér and Rao."""
    theta, still = np.concatenate([matrix.ravel(), reference, np.zeros(3)]), np.zeros((rt.ATTITUDES, 3))
    white = whitening(np.full(still.shape, variance))
    std: Array = np.sqrt(np.diag(covariance_bound(theta, TURNED, still, white, norm_known=True))[BIAS])
    return std


def errors(drifts: list[BiasDrift], truth: Array) -> tuple[Array, Array]:
    """(S, R, 3) of the biases with F held, and found anew."""
    held = np.array([drift.scale_fixed.bias for drift in drifts]) - truth
    anew = np.array([[anew.bias for anew in drift.scale_free.results.values()] for drift in drifts]) - truth
    return held, anew


@pytest.mark.thorough
@pytest.mark.slow
def test_an_accelerometer_s_bias_is_as_good_as_its_bound() -> None:
    """TRIAX, Fig. 6: ten attitudes of six minutes, a jump after the first repeat."""
    truth = rt.ACCELEROMETER_BIAS_M_S2 + np.repeat([[0.0, 0, 0], [0.3 * rt.MG, -0.1 * rt.MG, 0]], [1, 9], axis=0)
    variance = rt.ACCELEROMETER_RANDOM_WALK**2 / rt.AVERAGING_S
    model = rt.project(TURNED, rt.ACCELEROMETER_REFERENCE_M_S2) @ rt.ACCELEROMETER_MATRIX.T
    gravity = float(np.linalg.norm(rt.ACCELEROMETER_REFERENCE_M_S2))
    site = Site((0.0, 0.0, -1.0), gravity, None)
    drifts = [
        fit_acceleration_drift(stands(model, truth, variance, seed), site, second_order=False) for seed in range(SEEDS)
    ]
    held, anew = errors(drifts, truth)
    of_a_fit = bound(rt.ACCELEROMETER_MATRIX, rt.ACCELEROMETER_REFERENCE_M_S2, variance)
    assert np.sqrt(np.mean((anew / of_a_fit) ** 2)) < 1.2
    # What is held was found in the first repeat, as well as that one tells it.
    assert np.sqrt(np.mean((held / of_a_fit) ** 2)) < 1.2
    stated = np.array([np.hypot(drift.scale_fixed.std, drift.common_std) for drift in drifts])
    assert 0.8 < np.sqrt(np.mean((held / stated) ** 2)) < 1.2
    moved = [{move.repeat for move in drift.scale_fixed.moves} for drift in drifts]
    assert np.mean([each == {1} for each in moved]) >= 0.95
    change = held[:, 1:] - held[:, :1]
    assert np.sqrt(np.mean(change**2)) < 1.2 * np.sqrt(2 * variance / rt.ATTITUDES)


@pytest.mark.slow
def test_a_gyroscope_s_bias_is_as_good_as_its_bound() -> None:
    """TRIAX, Fig. 4. What F is wrong by in the Earth's rate is the same in every repeat, and no drift."""
    truth = np.cumsum(0.1 * rt.DEG_H * np.random.default_rng(4).normal(size=(rt.REPEATS, 3)), axis=0)
    variance = rt.GYRO_RANDOM_WALK**2 / rt.AVERAGING_S
    model = rt.project(TURNED, EARTH_RAD_S) @ rt.GYRO_MATRIX.T
    x, y, z = EARTH_RAD_S.tolist()
    site = Site((0.0, 0.0, -1.0), 9.8, (x, y, z))
    drifts = [fit_rate_drift(stands(model, truth, variance, seed), site) for seed in range(SEEDS)]
    held, anew = errors(drifts, truth)
    assert np.sqrt(np.mean((anew / bound(rt.GYRO_MATRIX, EARTH_RAD_S, variance)) ** 2)) < 1.2
    left = held - held.mean(axis=(0, 1))
    assert np.sqrt(np.mean(left**2)) < 1.2 * np.sqrt(variance / rt.ATTITUDES)
    assert np.abs(held.mean(axis=(0, 1))).max() < 0.006 * rt.EARTH_RATE_RAD_S


def test_without_the_earth_s_rate_a_gyroscope_is_not_found_anew() -> None:
    repeats = stands(np.zeros((rt.ATTITUDES, 3)), np.full((3, 3), 0.01), 1e-12, 1)
    drift = fit_rate_drift(repeats, Site((0.0, 0.0, 1.0), 9.8, None))
    assert not drift.scale_free.results
    assert {fault.name for fault in drift.scale_free.faults.values()} == {"earth_rate_unknown"}
    assert np.abs(drift.scale_fixed.bias - 0.01).max() < 2e-6
    assert drift.over_temperature is None


@pytest.mark.parametrize("repeats", [2, 3])
def test_few_repeats_tell_their_bias_and_nothing_of_temperature(repeats: int) -> None:
    drift = fit_rate_drift(
        stands(np.zeros((10, 3)), np.zeros((repeats, 3)), 1e-12, 2), Site((0.0, 0.0, 1.0), 9.8, None)
    )
    assert len(drift.scale_fixed.bias) == repeats and not drift.scale_fixed.moves
    assert drift.over_temperature is None and drift.faults[SLOPE].name == "too_few_observations"
