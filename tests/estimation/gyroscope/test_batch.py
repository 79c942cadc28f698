"""Fifteen thousand calibrations at once say what each of them says alone; and so does Levenberg–Marquardt."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.accumulator import Accumulator, Solution
from rig.estimation.gyroscope.levenberg_marquardt import (
    compute_squared_rate,
    compute_squared_rate_jacobian,
    solve_levenberg_marquardt,
)
from rig.estimation.gyroscope.six_observation_batch import algorithm_1_batch, newton_batch

SPEED = np.pi / 3
DIRECTIONS = np.kron(np.eye(3), [[1.0], [-1.0]])
VARIANCES = np.full((6, 3), 0.035**2 / 1200) * np.array([1.0, 4.0, 0.25])
WORST_BIAS = np.array([2.0, -1.5, 1.0])  # larger than the speed: β0/ω² = 8


def runs(count: int, bias: float = 0.1, repeats: int = 1, seed: int = 1) -> tuple[Array, Array, Array, Array]:
    """Means (R, N, 3), speeds (N,), and the true scale and bias (R, 3): SIX, section III-A, for any bias."""
    rng = np.random.default_rng(seed)
    scale, b = rng.uniform(0.8, 1.2, (count, 3)), rng.uniform(-bias, bias, (count, 3))
    speeds = np.tile(SPEED * (1 + 1e-3 * np.array([0, 1, -2, 3, -1, 2])), repeats)
    directions = np.tile(DIRECTIONS, (repeats, 1)) @ (np.eye(3) + rng.uniform(0, 0.1, (3, 3)) * (1 - np.eye(3)))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    exact = (speeds[:, None] * directions) / scale[:, None] - b[:, None]
    return exact + rng.normal(size=exact.shape) * 1e-3, speeds, scale, b


def one_by_one(means: Array, speeds: Array, weight: float | None = 1.0) -> Accumulator:
    accumulated = Accumulator.empty()
    for mean, speed in zip(means, speeds, strict=True):
        accumulated = accumulated.add(mean, np.full(3, 1e-6), float(speed), weight=weight)
    return accumulated


@pytest.mark.slow
@pytest.mark.parametrize("repeats", [1, 3])
def test_batches_give_the_numbers_of_single_runs(repeats: int) -> None:
    means, speeds, _, _ = runs(40, repeats=repeats)
    newton, published = newton_batch(means, speeds), algorithm_1_batch(means, speeds)
    assert newton.converged.all() and published.converged.all()
    for i, run in enumerate(means):
        single: Solution = one_by_one(run, speeds).solve()
        np.testing.assert_allclose(newton.scale[i], single.scale, rtol=1e-10)
        np.testing.assert_allclose(newton.bias_rad_s[i], single.bias_rad_s, atol=1e-10)
        assert newton.iterations[i] == single.iterations
        single = one_by_one(run, speeds).solve("algorithm_1")
        np.testing.assert_allclose(published.scale[i], single.scale, rtol=1e-10)
        np.testing.assert_allclose(published.bias_rad_s[i], single.bias_rad_s, atol=1e-10)
        assert published.iterations[i] == single.iterations


def test_runs_may_have_speeds_of_their_own() -> None:
    means, speeds, _, _ = runs(3, repeats=2)
    every = newton_batch(means, np.tile(speeds, (3, 1)))
    for i in range(3):
        alone = newton_batch(means[i : i + 1], speeds)
        np.testing.assert_allclose(every.scale[i], alone.scale[0], rtol=1e-12)


def test_newton_is_exact_where_algorithm_1_diverges() -> None:
    directions = SPEED * DIRECTIONS
    bias = WORST_BIAS * np.array([0.1, 0.5, 1.0, 2.0])[:, None]  # β0/ω² from 0.08 to 32
    means = directions - bias[:, None]
    newton, published = newton_batch(means, np.full(6, SPEED)), algorithm_1_batch(means, np.full(6, SPEED))
    np.testing.assert_allclose(newton.bias_rad_s, bias, rtol=1e-10)
    assert newton.converged.all()
    assert published.converged.tolist() == [True, False, False, False]
    assert np.isnan(published.scale[1:]).all() and np.isfinite(published.scale[0]).all()


def test_one_bad_run_does_not_stop_the_others() -> None:
    means, speeds, scale, _ = runs(4)
    means[1] = np.nan
    means[2, :] = means[2, 0]
    solution = newton_batch(means, speeds)
    assert solution.converged.tolist() == [True, False, False, True]
    assert np.isnan(solution.scale[1:3]).all()
    np.testing.assert_allclose(solution.scale[[0, 3]], scale[[0, 3]], atol=0.01)


@pytest.mark.slow
def test_a_batch_agrees_with_a_loop_of_scipy() -> None:
    means, speeds, _, _ = runs(150)
    batch = newton_batch(means, speeds)
    start = np.concatenate([np.ones(3), np.zeros(3)])
    loop = [
        least_squares(
            lambda x, m=m: speeds**2 - compute_squared_rate(x, m), start, method="lm", xtol=1e-12, ftol=1e-12
        ).x
        for m in means
    ]
    np.testing.assert_allclose(np.concatenate([batch.scale, batch.bias_rad_s], axis=1), loop, atol=1e-9)


@pytest.mark.parametrize("repeats", [1, 2])
def test_levenberg_marquardt_finds_the_closed_form(repeats: int) -> None:
    means, speeds, _, _ = runs(5, repeats=repeats)
    variances = np.tile(VARIANCES, (repeats, 1))
    newton = newton_batch(means, speeds)
    for i, run in enumerate(means):
        solution = solve_levenberg_marquardt(run, speeds, variances, weighted=False)
        # With more than six sweeps the two minimise different things, alike to the order of the noise squared.
        close = 1e-12 if repeats == 1 else 2e-5
        np.testing.assert_allclose(solution.scale, newton.scale[i], atol=close)
        np.testing.assert_allclose(solution.bias_rad_s, newton.bias_rad_s[i], atol=close)
        assert solution.rank == 6 and solution.iterations < 20 and solution.condition < 3
        left = np.sum((solution.scale * (run + solution.bias_rad_s)) ** 2, axis=1) - speeds**2
        np.testing.assert_allclose(left, 0, atol=1e-12 if repeats == 1 else 1e-2)


@pytest.mark.parametrize("bias", [WORST_BIAS, -WORST_BIAS, 3 * WORST_BIAS])
def test_levenberg_marquardt_finds_a_bias_larger_than_the_speed(bias: Array) -> None:
    scale = np.array([1.1771, 1.1554, 1.1440])
    solution = solve_levenberg_marquardt(SPEED * DIRECTIONS / scale - bias, np.full(6, SPEED), VARIANCES)
    np.testing.assert_allclose(solution.scale, scale, rtol=1e-9)
    np.testing.assert_allclose(solution.bias_rad_s, bias, rtol=1e-9)


@pytest.mark.parametrize("repeats", [1, 3])
def test_the_covariances_are_those_of_repeated_calibrations(repeats: int) -> None:
    count = 4000
    scale, bias = np.array([1.1771, 1.1554, 1.1440]), np.array([0.15, -0.13, 0.18])
    directions, variances = np.tile(DIRECTIONS, (repeats, 1)), np.tile(VARIANCES, (repeats, 1))
    speeds = SPEED * (1 + 1e-6 * np.arange(6 * repeats))
    exact = speeds[:, None] * directions / scale - bias
    draws = exact + np.random.default_rng(4).normal(size=(count, *exact.shape)) * np.sqrt(variances)
    batch = newton_batch(draws, speeds)
    empirical = np.var(np.concatenate([batch.scale, batch.bias_rad_s], axis=1), axis=0)
    reported = solve_levenberg_marquardt(exact, speeds, variances).covariance
    np.testing.assert_allclose(empirical, np.diag(reported), rtol=0.1)
    accumulated = Accumulator.empty()
    for mean, variance, speed in zip(exact, variances, speeds, strict=True):
        accumulated = accumulated.add(mean, variance, float(speed))
    np.testing.assert_allclose(empirical, np.diag(accumulated.solve().covariance), rtol=0.1)
    published = algorithm_1_batch(draws, speeds)
    assert published.converged.all()
    empirical = np.var(np.concatenate([published.scale, published.bias_rad_s], axis=1), axis=0)
    accumulated = Accumulator.empty()
    for mean, variance, speed in zip(exact, variances, speeds, strict=True):
        accumulated = accumulated.add(mean, variance, float(speed), weight=1.0)
    np.testing.assert_allclose(empirical, np.diag(accumulated.solve("algorithm_1").covariance), rtol=0.1)
    if repeats == 1:
        alone = [solve_levenberg_marquardt(draw, speeds, variances) for draw in draws[:20]]
        np.testing.assert_allclose([s.scale for s in alone], batch.scale[:20], rtol=1e-10)


def test_speeds_known_badly_are_in_the_covariance_of_levenberg_marquardt() -> None:
    scale = np.array([1.1771, 1.1554, 1.1440])
    std = SPEED * np.array([3e-3, 1e-4, 1e-3, 2e-3, 1e-3, 1e-3])
    exact = SPEED * DIRECTIONS / scale
    reported = solve_levenberg_marquardt(exact, np.full(6, SPEED), VARIANCES / 100, speed_std_rad_s=std).covariance
    speeds = SPEED + np.random.default_rng(5).normal(size=(4000, 6)) * std
    draws = exact + np.random.default_rng(6).normal(size=(4000, 6, 3)) * np.sqrt(VARIANCES / 100)
    batch = newton_batch(draws, speeds)
    empirical = np.var(np.concatenate([batch.scale, batch.bias_rad_s], axis=1), axis=0)
    np.testing.assert_allclose(empirical, np.diag(reported), rtol=0.1)


def test_the_jacobian_is_the_derivative() -> None:
    theta, means = np.array([1.1, 0.9, 1.2, 0.3, -0.2, 0.1]), runs(1)[0][0]
    steps = 1e-6 * np.eye(6)
    numeric = np.stack(
        [(compute_squared_rate(theta + h, means) - compute_squared_rate(theta - h, means)) / 2e-6 for h in steps],
        axis=1,
    )
    np.testing.assert_allclose(compute_squared_rate_jacobian(theta, means), numeric, atol=1e-8)


def test_levenberg_marquardt_refuses_a_repeated_direction() -> None:
    means = SPEED * DIRECTIONS[[0, 1, 2, 3, 4, 4]]
    means += np.random.default_rng(7).normal(size=(6, 3)) * np.sqrt(VARIANCES)
    with pytest.raises(Fault, match="rank_deficient"):
        solve_levenberg_marquardt(means, np.full(6, SPEED), VARIANCES)
