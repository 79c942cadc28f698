"""Tri-axial calibration on a simulated rate table: truth found, uncertainty honest, blind spots refused."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.reference.reference_model import KnownNorm, KnownVector, jacobian, predicted
from rig.estimation.reference.triaxial import EqualWeights, TriaxialSolution, solve_triaxial, solve_triaxial_batch
from rig.study.rate_table import (
    AVERAGING_S,
    DEG_H,
    GYRO_BIAS_RAD_S,
    GYRO_MATRIX,
    GYRO_RANDOM_WALK,
    GYRO_REFERENCE_RAD_S,
    simulate_oscillation,
)
from support.motions.rate_table import attitudes, noisy

METHODS: tuple[EqualWeights, ...] = ("as_published", "maximum_likelihood")
THETA = np.concatenate([GYRO_MATRIX.ravel(), GYRO_REFERENCE_RAD_S, GYRO_BIAS_RAD_S])
UP = np.array([0.0, 0.0, -1.0])  # north-east-down; in the north the Earth's rate has a part upwards
EARTH = KnownNorm(float(np.linalg.norm(GYRO_REFERENCE_RAD_S)), UP)
UNEVEN = np.array([1.0, 2.0, 0.5])  # Fig. 3: one axis is noisier than the others


def values(solution: TriaxialSolution) -> Array:
    return np.concatenate([solution.matrix.ravel(), solution.reference, solution.bias])


def readings(r: Array, rates: Array | None = None, theta: Array = THETA) -> Array:
    return predicted(theta, r, np.zeros((len(r), 3)) if rates is None else rates)


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_the_published_gyroscope_is_found_from_25_hz_samples(method: EqualWeights) -> None:
    r, rates = simulate_oscillation(600)  # ten minutes
    variances = np.full((len(r), 3), GYRO_RANDOM_WALK**2 * 25)
    solution = solve_triaxial(noisy(readings(r, rates), variances), r, variances, KnownVector(rates), method=method)
    std = np.sqrt(np.diag(solution.covariance))
    assert np.all(np.abs(values(solution) - THETA) < 4 * std)
    np.testing.assert_allclose(solution.matrix, GYRO_MATRIX, atol=2e-6)
    np.testing.assert_allclose(solution.reference / DEG_H, [-1.0755, -11.5266, -10.1612], atol=0.15)
    np.testing.assert_allclose(solution.bias / DEG_H, [-0.5434, 0.1925, -0.0279], atol=0.15)
    assert np.linalg.norm(solution.reference) / DEG_H == pytest.approx(15.4035, abs=0.15)
    assert (solution.rank, solution.warnings) == (15, ())
    assert np.allclose(np.var(solution.residuals, axis=0), variances[0], rtol=0.05)


@pytest.mark.parametrize("method", METHODS)
def test_a_still_gyroscope_knows_the_earth_from_its_norm(method: EqualWeights) -> None:
    r = attitudes(10)
    variances = np.full((10, 3), GYRO_RANDOM_WALK**2 / AVERAGING_S)
    exact = solve_triaxial(readings(r), r, variances, EARTH, method=method)
    np.testing.assert_allclose(values(exact), THETA, rtol=1e-9, atol=1e-17)
    assert (exact.rank, exact.observations) == (14, 10)
    with pytest.raises(Fault, match="mirrored_axis"):  # the wrong side turns F as well
        solve_triaxial(readings(r), r, variances, KnownNorm(EARTH.norm, [0, 0, 1]), method=method)


@pytest.mark.one_in(3)
@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("still", [True, False])
def test_the_covariance_is_that_of_repeated_calibrations(method: EqualWeights, still: bool, thorough: bool) -> None:
    count, tolerance = (6000, 0.1) if thorough else (1200, 0.18)
    r = attitudes(16)
    rates = None if still else np.random.default_rng(3).normal(size=(16, 3)) * 1e-3
    known = EARTH if rates is None else KnownVector(rates)
    variances = np.full((16, 3), GYRO_RANDOM_WALK**2 / AVERAGING_S) * UNEVEN
    exact = readings(r, rates)
    reported = solve_triaxial(exact, r, variances, known, method=method).covariance
    draws = noisy(exact, variances, runs=count)
    found = solve_triaxial_batch(draws, r, variances, known, method=method)
    std = np.sqrt(np.diag(reported))
    np.testing.assert_allclose(np.var(found, axis=0), std**2, rtol=tolerance)
    np.testing.assert_allclose(np.cov(found.T) / np.outer(std, std), reported / np.outer(std, std), atol=tolerance)
    # The bias that remains is of the second order in the noise: small against what one calibration can know.
    assert np.all(np.abs(found.mean(axis=0) - THETA) < tolerance * std)


@pytest.mark.parametrize(("share", "is_warned"), [(0.45, False), (0.55, True)])
def test_the_published_estimate_is_warned_of_where_noise_of_all_readings_is_half_of_what_they_read(
    share: float, is_warned: bool
) -> None:
    r, rates = simulate_oscillation(40)
    exact = readings(r, rates)
    variances = np.full((1000, 3), share**2 * np.mean(exact**2) / 1000)
    warnings = solve_triaxial(exact, r, variances, KnownVector(rates), method="as_published").warnings
    assert any("maximum_likelihood" in warning for warning in warnings) == is_warned


@pytest.mark.slow
def test_noise_in_slow_readings_biases_the_published_estimate_and_only_that() -> None:
    r, rates = simulate_oscillation(40)
    rates = 0.02 * rates  # ten times the noise that TRIAX reports of single samples
    variances = np.full((1000, 3), np.radians(0.0475) ** 2)
    exact = readings(r, rates)
    ratios = {}
    for method in METHODS:
        solution = solve_triaxial(noisy(exact, variances), r, variances, KnownVector(rates), method=method)
        draws = noisy(exact, variances, runs=20)
        found = np.array([solve_triaxial_batch(d, r, variances, KnownVector(rates), method=method) for d in draws])
        ratios[method] = np.abs(found.mean(axis=0) - THETA) / np.sqrt(np.diag(solution.covariance))
        assert any("maximum_likelihood" in warning for warning in solution.warnings) == (method == "as_published")
    assert ratios["as_published"][:9].max() > 3
    assert ratios["maximum_likelihood"].max() < 1


def test_maximum_likelihood_makes_more_of_uneven_noise() -> None:
    r = attitudes(30)
    variances = np.full((30, 3), (0.05 * DEG_H) ** 2) * np.array([100.0, 1.0, 1.0])
    plain, best = (solve_triaxial(readings(r), r, variances, EARTH, method=method) for method in METHODS)
    gain = np.diag(plain.covariance) / np.diag(best.covariance)
    assert np.all(gain > 0.999) and gain.max() > 5


@pytest.mark.parametrize("method", METHODS)
def test_the_table_frame_and_the_units_are_a_matter_of_naming(method: EqualWeights) -> None:
    r, turn = attitudes(12), Rotation.from_rotvec([0.4, -0.3, 0.9]).as_matrix()
    variances = np.full((12, 3), (0.05 * DEG_H) ** 2)
    m = noisy(readings(r), variances)
    one = solve_triaxial(m, r, variances, EARTH, method=method)
    turned = solve_triaxial(m, turn @ r, variances, KnownNorm(EARTH.norm, turn @ UP), method=method)
    np.testing.assert_allclose(turned.matrix, one.matrix, atol=1e-9)
    np.testing.assert_allclose(turned.reference, turn @ one.reference, rtol=1e-7)
    unit = 1 / DEG_H
    scaled = solve_triaxial(m * unit, r, variances * unit**2, KnownNorm(EARTH.norm * unit, UP), method=method)
    np.testing.assert_allclose(scaled.matrix, one.matrix, atol=1e-9)
    np.testing.assert_allclose(scaled.bias, one.bias * unit, atol=1e-7)
    assert scaled.condition == pytest.approx(one.condition)


def test_the_jacobian_is_the_derivative() -> None:
    rng = np.random.default_rng(5)
    theta = np.concatenate([GYRO_MATRIX.ravel(), rng.normal(size=3), rng.normal(size=3), 0.1 * rng.normal(size=3)])
    r, rates = attitudes(4), rng.normal(size=(4, 3))
    for p in (15, 18):
        numeric = [
            (predicted(theta[:p] + h, r, rates) - predicted(theta[:p] - h, r, rates)) / 2e-6 for h in 1e-6 * np.eye(p)
        ]
        np.testing.assert_allclose(jacobian(theta[:p], r, rates), np.stack(numeric, axis=-1), atol=1e-8)


def about(axis: str, count: int = 12) -> Array:
    """Attitudes that differ only by turns about one axis of the table."""
    matrices: Array = Rotation.from_rotvec(
        np.radians(np.linspace(0, 330, count))[:, None] * np.eye(3)["xyz".index(axis)]
    ).as_matrix()
    return matrices


@pytest.mark.parametrize("noise", [0.0, 0.05 * DEG_H])
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_turns_about_one_axis_are_not_enough(axis: str, noise: float) -> None:
    variances = np.full((12, 3), (0.05 * DEG_H) ** 2)
    m = noisy(readings(about(axis)), np.full((12, 3), noise**2))
    with pytest.raises(Fault, match=r"rank_deficient: .* of 14\).*more attitudes"):
        solve_triaxial(m, about(axis), variances, KnownNorm(15 * DEG_H, [0, 0, -1]))


def test_rates_about_one_axis_are_not_enough() -> None:
    r, rates = about("z"), np.linspace(-1, 1, 12)[:, None] * np.array([0.0, 0.0, 1.0])
    variances = np.full((12, 3), 1e-12)
    with pytest.raises(Fault, match=r"rank_deficient: .* of 15\)"):
        solve_triaxial(noisy(readings(r, rates), variances), r, variances, KnownVector(rates))


def test_a_few_attitudes_close_together_are_not_enough() -> None:
    r = Rotation.from_rotvec(0.001 * np.random.default_rng(1).normal(size=(12, 3))).as_matrix()
    variances = np.full((12, 3), (0.05 * DEG_H) ** 2)
    with pytest.raises(Fault, match=r"rank_deficient|ill_conditioned"):
        solve_triaxial(noisy(readings(r), variances), r, variances, KnownNorm(15 * DEG_H, [0, 0, -1]))


def test_a_reference_across_the_given_side_has_no_sign() -> None:
    theta = np.concatenate([np.eye(3).ravel(), [1.0, 0.0, 0.01], np.zeros(3)])
    r = attitudes(10)
    with pytest.raises(Fault, match="sign_unknown"):
        solve_triaxial(readings(r, theta=theta), r, np.full((10, 3), 1e-8), KnownNorm(1, [0, 0, 1]))


def test_what_is_no_attitude_is_refused() -> None:
    r = attitudes(10)
    m, variances = readings(r), np.full((10, 3), 1e-14)
    for wrong in (2 * r, -r, r + 0.01):
        with pytest.raises(Fault, match="bad_attitude"):
            solve_triaxial(m, wrong, variances, KnownNorm(1, [0, 0, -1]))
    with pytest.raises(ValueError, match="known must be"):
        solve_triaxial(m, r, variances, KnownVector(m[:9]))


def test_one_face_stated_as_its_opposite_is_no_wrong_unit() -> None:
    faces = [[0, 1, 0], [0, -1, 0], [1, 0, 0], [-1, 0, 0], [0, 0, 0], [2, 0, 0]]  # quarter turns about x, y, z
    r = Rotation.from_euler("xyz", np.pi / 2 * np.array(faces, dtype=float)).as_matrix()
    gravity = KnownNorm(9.8, np.array([0.0, 0.0, 1.0]))
    theta = np.concatenate([np.eye(3).ravel(), [0, 0, 9.8], [0.1, -0.1, 0.1]])
    variances = np.full((6, 3), 1e-8)
    read = noisy(readings(r, theta=theta), variances)
    assert solve_triaxial(read, r, variances, gravity).matrix == pytest.approx(np.eye(3), abs=1e-3)
    r[2] = r[3]
    with pytest.raises(Fault, match="attitude_untrustworthy: "):
        solve_triaxial(read, r, variances, gravity)
