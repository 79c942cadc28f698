"""The accelerometer of TRIAX from static attitudes, with and without second-order terms."""

from typing import Any

import numpy as np
import pytest

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer import specific_force
from rig.estimation.reference.reference_model import KnownNorm
from rig.estimation.reference.triaxial import EqualWeights, solve_triaxial, solve_triaxial_batch
from rig.study.rate_table import (
    ACCELEROMETER_BIAS_M_S2,
    ACCELEROMETER_MATRIX,
    ACCELEROMETER_RANDOM_WALK,
    ACCELEROMETER_REFERENCE_M_S2,
    ACCELEROMETER_SECOND_ORDER,
    AVERAGING_S,
    MG,
)
from support.motions.rate_table import attitudes, noisy

METHODS: tuple[EqualWeights, ...] = ("as_published", "maximum_likelihood")
GRAVITY = -ACCELEROMETER_REFERENCE_M_S2
NORM = float(np.linalg.norm(GRAVITY))
KNOWN = KnownNorm(NORM, (0, 0, -1))  # north-east-down
FIRST = np.concatenate([ACCELEROMETER_MATRIX.ravel(), -GRAVITY, ACCELEROMETER_BIAS_M_S2])
THETA = np.concatenate([FIRST, ACCELEROMETER_SECOND_ORDER])
VARIANCES = np.full((30, 3), ACCELEROMETER_RANDOM_WALK**2 / AVERAGING_S) * np.array([1.0, 0.5, 2.0])


def readings(r: Array, second_order: Array = ACCELEROMETER_SECOND_ORDER) -> Array:
    """a_m (N, 3), m/s²: TRIAX, Eq. (11)."""
    g = np.einsum("nji,j->ni", r, GRAVITY)
    result: Array = (-g + second_order * g**2) @ ACCELEROMETER_MATRIX.T + ACCELEROMETER_BIAS_M_S2
    return result


@pytest.mark.parametrize("method", METHODS)
def test_the_published_accelerometer_is_found(method: EqualWeights) -> None:
    r = attitudes(30)
    m = noisy(readings(r), VARIANCES)
    solution = solve_triaxial(m, r, VARIANCES, KNOWN, second_order=True, method=method)
    std = np.sqrt(np.diag(solution.covariance))
    assert np.all(np.abs(solution.theta - THETA) < 4 * std)
    np.testing.assert_allclose(solution.matrix, ACCELEROMETER_MATRIX, atol=3e-5)
    np.testing.assert_allclose(solution.bias / MG, [0.9664, -0.4173, 0.8803], atol=0.05)
    np.testing.assert_allclose(solution.reference, -GRAVITY, atol=2e-4)
    assert solution.second_order is not None
    np.testing.assert_allclose(solution.second_order, ACCELEROMETER_SECOND_ORDER, atol=2e-6)
    assert (solution.rank, solution.warnings) == (17, ())
    np.testing.assert_allclose(np.linalg.norm(solution.reference), NORM, rtol=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_first_order_is_exact_for_a_linear_sensor(method: EqualWeights) -> None:
    r = attitudes(5)
    exact = solve_triaxial(readings(r, np.zeros(3)), r, VARIANCES[:5], KNOWN, method=method)
    np.testing.assert_allclose(exact.theta, FIRST, atol=1e-11)
    assert exact.rank == 14 and exact.second_order is None


def test_the_iteration_settles_and_leaves_what_first_order_cannot_explain() -> None:
    r = attitudes(30)
    tiny = np.full((30, 3), 1e-10)
    first = solve_triaxial(readings(r), r, tiny, KNOWN)
    second = solve_triaxial(readings(r), r, tiny, KNOWN, second_order=True)
    np.testing.assert_allclose(second.theta, THETA, atol=1e-9)
    assert 2 <= second.iterations <= 10
    assert np.abs(second.residuals).max() < 1e-9
    assert np.abs(first.residuals).max() > 1e-4
    assert "times what the variances explain" in first.warnings[0] and not second.warnings


@pytest.mark.one_in(2)
@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("second_order", [pytest.param(False, marks=[pytest.mark.proof, pytest.mark.thorough]), True])
def test_the_covariance_is_that_of_repeated_calibrations(
    method: EqualWeights, second_order: bool, thorough: bool
) -> None:
    count, tolerance = (5000, 0.1) if thorough else (1200, 0.18)
    r = attitudes(14)
    variances = VARIANCES[:14] * 25  # loud enough that rounding is nowhere near
    exact = readings(r, ACCELEROMETER_SECOND_ORDER if second_order else np.zeros(3))
    options: dict[str, Any] = {"second_order": second_order, "method": method}
    reported = solve_triaxial(exact, r, variances, KNOWN, **options).covariance
    draws = noisy(exact, variances, runs=count)
    found = solve_triaxial_batch(draws, r, variances, KNOWN, **options)
    np.testing.assert_allclose(np.var(found, axis=0), np.diag(reported), rtol=tolerance)
    std = np.sqrt(np.diag(reported))
    np.testing.assert_allclose(np.corrcoef(found.T), reported / np.outer(std, std), atol=0.8 * tolerance)


def test_calibrated_readings_are_the_specific_force() -> None:
    r = attitudes(30)
    for second_order in (np.zeros(3), ACCELEROMETER_SECOND_ORDER):
        m = readings(r, second_order)
        solution = solve_triaxial(m, r, VARIANCES, KNOWN, second_order=bool(second_order.any()))
        found = specific_force(m, solution.matrix, solution.bias, solution.second_order)
        np.testing.assert_allclose(found, -np.einsum("nji,j->ni", r, GRAVITY), atol=1e-9)


def test_a_frame_whose_z_axis_points_up_says_so() -> None:
    r = attitudes(10)
    over = np.diag([1.0, -1.0, -1.0])  # the same table, its frame turned over
    solution = solve_triaxial(readings(r, np.zeros(3)), over @ r, VARIANCES[:10], KnownNorm(NORM, [0, 0, 1]))
    np.testing.assert_allclose(solution.reference, -over @ GRAVITY, atol=1e-10)
    np.testing.assert_allclose(solution.matrix, ACCELEROMETER_MATRIX, atol=1e-12)


def test_second_order_asks_for_a_sixth_attitude() -> None:
    r = attitudes(5)
    with pytest.raises(Fault, match=r"too_few_observations: 5 .* 18 parameters; at least 6 are needed"):
        solve_triaxial(readings(r), r, VARIANCES[:5], KNOWN, second_order=True)


def test_readings_in_g_are_refused() -> None:
    r = attitudes(30)
    with pytest.raises(Fault, match=r"wrong_unit: .* look like g"):
        solve_triaxial(readings(r) / 9.80665, r, VARIANCES / 96, KNOWN)
