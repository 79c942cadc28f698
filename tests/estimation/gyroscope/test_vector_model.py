"""The vector model: what sweeps with known axes tell, and how well it says it knows."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_model import VectorSolution, solve_vector_batch, solve_vector_model
from rig.estimation.sensor_axes import non_orthogonality

SPEED = np.pi / 3
SWEEPS: Array = SPEED * np.kron(np.eye(3), [[1.0], [-1.0]]).astype(np.float64)
RESTS = np.zeros((6, 3))
RATES = np.concatenate([SWEEPS, RESTS])
SCALE = np.array([1.1771, 1.1554, 1.1440])  # the turntable's LSM9DS1, SIX, table II
BIAS = np.array([0.0077, -0.0100, -0.0051])
VARIANCES = 0.035**2 / np.repeat([1428.0, 619.0], 6)[:, None] * np.array([1.0, 4.0, 0.3])
MOUNTING = Rotation.from_rotvec([0.05, -0.035, 0.06]).as_matrix()
SKEW = np.array([0.02, -0.015, 0.01])
SENSITIVITY = np.array([[3.0, -1.0, 2.0], [0.5, 4.0, -2.0], [1.0, 0.0, -3.0]]) * 1e-5  # rad/s per m/s²


def sensor_axes(skew: Array = SKEW) -> Array:
    """Unit rows whose pairwise sines are `skew`, and whose nearest rotation is MOUNTING."""
    x, y, z = np.sin(skew)
    values, vectors = np.linalg.eigh(np.array([[1.0, z, y], [z, 1.0, x], [y, x, 1.0]]))
    axes: Array = vectors @ np.diag(np.sqrt(values)) @ vectors.T @ MOUNTING
    return axes


def readings(rates: Array = RATES, scale: Array = SCALE, bias: Array = BIAS, axes: Array | None = None) -> Array:
    """Noise-free mean readings (N, 3)."""
    means: Array = rates @ (sensor_axes() if axes is None else axes).T / scale - bias
    return means


def noisy(means: Array, variances: Array = VARIANCES, runs: int | None = None, seed: int = 1) -> Array:
    shape = means.shape if runs is None else (runs, *means.shape)
    result: Array = means + np.random.default_rng(seed).normal(size=shape) * np.sqrt(variances)
    return result


def everything(solution: VectorSolution) -> Array:
    """(24,) k, b, F, c, non-orthogonality, small turns against MOUNTING."""
    turn = Rotation.from_matrix(solution.mounting @ MOUNTING.T).as_rotvec()
    parts = [solution.scale, solution.bias_rad_s, solution.matrix.ravel(), -solution.bias_rad_s]
    return np.concatenate([*parts, solution.non_orthogonality_rad, turn])


def test_scale_bias_skew_and_mounting_are_exact_without_noise() -> None:
    solution = solve_vector_model(readings(), RATES, VARIANCES)
    np.testing.assert_allclose(solution.scale, SCALE, rtol=1e-13)
    np.testing.assert_allclose(solution.bias_rad_s, BIAS, atol=1e-15)
    np.testing.assert_allclose(solution.non_orthogonality_rad, SKEW, atol=1e-14)
    np.testing.assert_allclose(solution.mounting, MOUNTING, atol=1e-14)
    np.testing.assert_allclose(solution.residuals_rad_s, 0, atol=1e-15)
    assert (solution.rank, solution.observations, solution.warnings) == (4, 12, ())
    assert solution.condition == pytest.approx(np.sqrt(3))


def test_the_bias_may_be_larger_than_the_speed() -> None:
    bias = np.array([3.0, -2.5, 4.0])
    np.testing.assert_allclose(solve_vector_model(readings(bias=bias), RATES, VARIANCES).bias_rad_s, bias, rtol=1e-13)


def test_a_missing_direction_is_made_up_for_by_the_others() -> None:
    some = RATES[[0, 2, 3, 4, 5, 6, 7]]
    solution = solve_vector_model(readings(some), some, VARIANCES[:7])
    np.testing.assert_allclose(solution.scale, SCALE, rtol=1e-13)
    whole = solve_vector_model(readings(), RATES, VARIANCES)
    assert solution.covariance[0, 0] > 1.5 * whole.covariance[0, 0]


def test_the_flange_frame_is_a_matter_of_naming() -> None:
    turn = Rotation.from_rotvec([0.7, -1.2, 0.4]).as_matrix()
    means = noisy(readings())
    one, other = solve_vector_model(means, RATES, VARIANCES), solve_vector_model(means, RATES @ turn.T, VARIANCES)
    np.testing.assert_allclose(other.scale, one.scale, rtol=1e-12)
    np.testing.assert_allclose(other.covariance, one.covariance, rtol=1e-9, atol=1e-20)
    np.testing.assert_allclose(other.non_orthogonality_rad, one.non_orthogonality_rad, atol=1e-13)
    np.testing.assert_allclose(other.mounting @ turn, one.mounting, atol=1e-12)


def test_order_and_unit_of_time_do_not_matter() -> None:
    means, order = noisy(readings()), np.random.default_rng(2).permutation(12)
    one = solve_vector_model(means, RATES, VARIANCES)
    shuffled = solve_vector_model(means[order], RATES[order], VARIANCES[order])
    np.testing.assert_allclose(everything(shuffled), everything(one), atol=1e-13)
    in_degrees = solve_vector_model(np.degrees(means), np.degrees(RATES), np.degrees(np.degrees(VARIANCES)))
    np.testing.assert_allclose(in_degrees.scale, one.scale, rtol=1e-12)
    np.testing.assert_allclose(np.radians(in_degrees.bias_rad_s), one.bias_rad_s, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.proof
def test_every_covariance_is_that_of_repeated_calibrations(thorough: bool) -> None:
    count, tolerance = (3000, 0.1) if thorough else (600, 0.22)  # four standard deviations of a variance from them
    truth = solve_vector_model(readings(), RATES, VARIANCES)
    runs = [everything(solve_vector_model(m, RATES, VARIANCES)) for m in noisy(readings(), runs=count)]
    variances = np.concatenate([
        np.diag(truth.covariance), np.diag(truth.matrix_covariance), np.diag(truth.angles_covariance_rad2)
    ])  # fmt: skip
    np.testing.assert_allclose(np.var(runs, axis=0), variances, rtol=tolerance)
    std = np.sqrt(np.diag(truth.covariance))
    np.testing.assert_allclose(np.cov(np.array(runs)[:, :6].T) / np.outer(std, std),
                               truth.covariance / np.outer(std, std), atol=tolerance)  # fmt: skip
    assert np.all(np.abs(np.mean(runs, axis=0) - everything(truth)) < 4 * np.sqrt(variances / count))


@pytest.mark.slow
def test_speeds_known_badly_are_in_the_covariance() -> None:
    std = SPEED * np.array([3e-3, 1e-4, 1e-3, 2e-3, 1e-3, 1e-3, *np.zeros(6)])
    truth = solve_vector_model(readings(), RATES, VARIANCES, speed_std_rad_s=std)
    factors = 1 + np.random.default_rng(3).normal(size=(20000, 12)) * std / SPEED
    weights = VARIANCES + (std[:, None] * (RATES / SPEED) @ truth.matrix.T) ** 2
    batch = solve_vector_batch(noisy(readings(), runs=20000), RATES * factors[..., None], weights)
    found = np.concatenate([batch.scale, batch.bias_rad_s], axis=1)
    np.testing.assert_allclose(np.var(found, axis=0), np.diag(truth.covariance), rtol=0.1)
    assert truth.covariance[0, 0] > 1.5 * solve_vector_model(readings(), RATES, VARIANCES).covariance[0, 0]


def test_the_batch_gives_the_numbers_of_single_runs() -> None:
    means = noisy(readings(), runs=5)
    batch = solve_vector_batch(means, RATES, VARIANCES)
    for i, run in enumerate(means):
        single = solve_vector_model(run, RATES, VARIANCES)
        np.testing.assert_allclose(batch.scale[i], single.scale, rtol=1e-13)
        np.testing.assert_allclose(batch.bias_rad_s[i], single.bias_rad_s, atol=1e-15)
        np.testing.assert_allclose(batch.matrix[i], single.matrix, atol=1e-14)


def gravity_seen() -> Array:
    """Mean gravity (12, 3) in the flange frame, from a different attitude for every observation."""
    directions = Rotation.random(12, random_state=5).as_matrix()[:, :, 2]
    return 9.80665 * directions


@pytest.mark.slow
@pytest.mark.proof
def test_gravity_gives_the_g_sensitivity_with_its_covariance(thorough: bool) -> None:
    count, tolerance = (2000, 0.1) if thorough else (400, 0.28)
    gravity = gravity_seen()
    means = readings() + gravity @ SENSITIVITY.T
    truth = solve_vector_model(means, RATES, VARIANCES, gravity_m_s2=gravity)
    assert truth.g_sensitivity is not None and truth.g_sensitivity_covariance is not None
    np.testing.assert_allclose(truth.g_sensitivity, SENSITIVITY, atol=1e-16)
    np.testing.assert_allclose(truth.scale, SCALE, rtol=1e-12)
    assert truth.rank == 7
    runs = []
    for m in noisy(means, runs=count, seed=4):
        solution = solve_vector_model(m, RATES, VARIANCES, gravity_m_s2=gravity)
        assert solution.g_sensitivity is not None
        runs.append([*solution.scale, *solution.bias_rad_s, *solution.g_sensitivity.ravel()])
    reported = np.concatenate([np.diag(truth.covariance), np.diag(truth.g_sensitivity_covariance)])
    np.testing.assert_allclose(np.var(runs, axis=0), reported, rtol=tolerance)


def test_g_sensitivity_asks_for_more_than_one_attitude() -> None:
    always_down = np.tile([0.0, 0.0, -9.80665], (12, 1))
    with pytest.raises(Fault, match=r"rank_deficient: .*\(4 of 7\).*against gravity"):
        solve_vector_model(readings(), RATES, VARIANCES, gravity_m_s2=always_down)


def test_something_beside_noise_is_warned_of() -> None:
    means = readings()
    means[3] += 0.02  # a knock during one sweep: twenty times its noise
    (warning,) = solve_vector_model(means, RATES, VARIANCES).warnings
    assert "times what the variances explain" in warning
    assert solve_vector_model(noisy(readings()), RATES, VARIANCES).warnings == ()


def test_non_orthogonality_names_the_pairs() -> None:
    axes = np.eye(3)
    axes[0] = [np.cos(0.03), np.sin(0.03), 0.0]  # x leans towards y
    np.testing.assert_allclose(non_orthogonality(axes), [0, 0, 0.03], atol=1e-15)
