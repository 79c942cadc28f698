"""Hard and soft iron from known attitudes: TRIAX, Eq. (7)."""

import numpy as np
import pytest

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.reference.magnetometer import field_drift, hard_iron, uniformity
from rig.estimation.reference.reference_model import KnownNorm
from rig.estimation.reference.triaxial import EqualWeights, solve_triaxial, solve_triaxial_batch
from support.motions.rate_table import attitudes, noisy

METHODS: tuple[EqualWeights, ...] = ("as_published", "maximum_likelihood")
EARTH_FIELD = np.array([26.2, -0.9, 34.1]) * 1e-6  # T, north-east-down, near Lisbon
SCALE = np.diag([1.1, 0.95, 1.02])
NON_ORTHOGONALITY = np.array([[1.0, 0.02, -0.01], [0.0, 1.0, 0.03], [0.0, 0.0, 1.0]])
SOFT_IRON = np.array([[1.05, 0.04, -0.02], [0.04, 0.97, 0.03], [-0.02, 0.03, 1.10]])
HARD_IRON = np.array([12.0, -7.0, 20.0]) * 1e-6
OFFSET = np.array([1.0, 2.0, -3.0]) * 1e-6
MATRIX = SCALE @ NON_ORTHOGONALITY @ SOFT_IRON
BIAS = SCALE @ NON_ORTHOGONALITY @ HARD_IRON + OFFSET
KNOWN = KnownNorm(float(np.linalg.norm(EARTH_FIELD)), (0, 0, 1))
VARIANCES = np.full((20, 3), (0.1e-6) ** 2) * np.array([1.0, 2.0, 0.5])


def readings(r: Array) -> Array:
    """(N, 3) T: the iron bends the field, then the sensor reads it, as the text above Eq. (7) has it."""
    bent = np.einsum("nji,j->ni", r, EARTH_FIELD) @ SOFT_IRON.T + HARD_IRON
    result: Array = bent @ (SCALE @ NON_ORTHOGONALITY).T + OFFSET
    return result


@pytest.mark.parametrize("method", METHODS)
def test_iron_field_and_offset_are_found(method: EqualWeights) -> None:
    r = attitudes(20)
    solution = solve_triaxial(noisy(readings(r), VARIANCES), r, VARIANCES, KNOWN, method=method)
    std = np.sqrt(np.diag(solution.covariance))
    found = solution.theta
    assert np.all(np.abs(found - np.concatenate([MATRIX.ravel(), EARTH_FIELD, BIAS])) < 4 * std)
    assert solution.rank == 14 and not solution.warnings
    exact = solve_triaxial(readings(r), r, VARIANCES, KNOWN, method=method)
    np.testing.assert_allclose(exact.matrix, MATRIX, atol=1e-12)
    np.testing.assert_allclose(hard_iron(exact), np.linalg.solve(MATRIX, BIAS), atol=1e-17)
    np.testing.assert_allclose(exact.bias, BIAS, atol=1e-17)


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.parametrize("method", METHODS)
def test_the_covariance_is_that_of_repeated_calibrations(method: EqualWeights, thorough: bool) -> None:
    count, tolerance = (5000, 0.1) if thorough else (1200, 0.18)
    r = attitudes(20)
    reported = solve_triaxial(readings(r), r, VARIANCES, KNOWN, method=method).covariance
    found = solve_triaxial_batch(
        noisy(readings(r), VARIANCES, runs=count),
        r,
        VARIANCES,
        KNOWN,
        method=method,
    )
    np.testing.assert_allclose(np.var(found, axis=0), np.diag(reported), rtol=tolerance)


def test_an_axis_of_the_other_hand_is_refused() -> None:
    r = attitudes(20)
    with pytest.raises(Fault, match="mirrored_axis"):
        solve_triaxial(readings(r) * np.array([-1.0, 1.0, 1.0]), r, VARIANCES, KNOWN)


def test_microtesla_given_as_tesla_are_refused() -> None:
    r = attitudes(20)
    with pytest.raises(Fault, match="wrong_unit"):
        solve_triaxial(readings(r) * 1e6, r, VARIANCES * 1e12, KNOWN)


def test_a_field_that_drifts_is_told_from_noise() -> None:
    rng = np.random.default_rng(3)
    means = np.array([26.2, -0.9, 34.1]) * 1e-6 + rng.normal(0.0, 0.02e-6, (4, 3))
    variances = np.full((4, 3), (0.02e-6) ** 2)
    assert field_drift(means, variances, 0.0).steady
    means[2] += 0.2e-6
    drifted = field_drift(means, variances, 0.0)
    assert not drifted.steady and drifted.change_t == pytest.approx([0.2e-6] * 3, abs=0.1e-6)
    assert field_drift(means, variances, 5e-3).steady, "the arm may stand elsewhere"


def test_noise_seldom_makes_a_uniform_field_look_uneven_and_attitudes_that_are_known_to_be_off_do_not() -> None:
    r = attitudes(20)
    solution = solve_triaxial(readings(r), r, VARIANCES, KNOWN, method="maximum_likelihood")
    found = [uniformity(solution, noisy(readings(r), VARIANCES, seed=seed), r, VARIANCES, 0.0) for seed in range(40)]
    assert (
        np.mean([each.chi_square for each in found]) == pytest.approx(46, abs=5) and found[0].degrees_of_freedom == 46
    )
    assert all(each.uniform for each in found)
    uneven = readings(r) * (1 + 0.02 * np.sin(np.arange(20)))[:, None]
    assert not uniformity(solution, uneven, r, VARIANCES, 0.0).uniform
    assert not uniformity(solution, uneven, r, VARIANCES, 5e-3).uniform, "attitudes do not change its size"
