"""What peers average into a wrong answer, every estimator refuses by name; what looks bad but is good, it solves."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.accumulator import Accumulator
from rig.estimation.gyroscope.levenberg_marquardt import solve_levenberg_marquardt
from rig.estimation.gyroscope.six_observation import closed_form
from rig.estimation.gyroscope.vector_model import solve_vector_model
from rig.estimation.reference.reference_model import KnownNorm
from rig.estimation.reference.triaxial import solve_triaxial
from rig.estimation.refusals import (
    check_axes,
    check_conditioning,
    check_reading_ratio,
    check_unit,
    condition_of,
    convergence_required,
    warn_of_residuals,
)
from support.motions.rate_table import attitudes

SPEED = np.pi / 3
SCALE, BIAS = np.array([1.1771, 1.1554, 1.1440]), np.array([0.0077, -0.0100, -0.0051])
RATES: Array = np.repeat(np.eye(3), 2, axis=0) * np.tile([[SPEED], [-SPEED]], (3, 1))
VARIANCE = 0.035**2 / 1428

Estimate = Callable[[Array, Array], Any]


def newton(means: Array, rates: Array) -> Any:
    accumulated = Accumulator.empty()
    for mean, rate in zip(means, rates, strict=True):
        accumulated = accumulated.add(mean, np.full(3, VARIANCE), float(np.linalg.norm(rate)))
    return accumulated.solve()


def levenberg_marquardt(means: Array, rates: Array) -> Any:
    return solve_levenberg_marquardt(means, np.linalg.norm(rates, axis=1), np.full(means.shape, VARIANCE))


def vector(means: Array, rates: Array) -> Any:
    return solve_vector_model(means, rates, np.full(means.shape, VARIANCE), nominal_mounting=np.eye(3))


EVERY: tuple[Estimate, ...] = (newton, levenberg_marquardt, vector)
WITH_DIRECTION: tuple[Estimate, ...] = (vector,)
SPEED_ONLY: tuple[Estimate, ...] = (newton, levenberg_marquardt)


def readings(rates: Array = RATES) -> Array:
    exact: Array = rates / SCALE - BIAS
    noise: Array = np.random.default_rng(1).normal(size=exact.shape) * np.sqrt(VARIANCE)
    return exact + noise


def changed(row: int, value: float) -> Array:
    means = readings()
    means[row, 0] = value
    return means


ONE_AXIS = RATES[[0, 1, 0, 1, 0, 1]]
TWICE = RATES[[0, 1, 2, 3, 4, 4]]

CASES = [
    pytest.param(EVERY, changed(2, np.nan), RATES, "not_finite", id="NaN"),
    pytest.param(EVERY, changed(2, np.inf), RATES, "not_finite", id="infinite"),
    pytest.param(EVERY, readings()[:3], RATES[:3], "too_few_observations", id="three sweeps"),
    pytest.param(SPEED_ONLY, readings()[:5], RATES[:5], "too_few_observations", id="five sweeps"),
    pytest.param(SPEED_ONLY, readings(TWICE), TWICE, "rank_deficient", id="a direction missing, another twice"),
    pytest.param(
        (levenberg_marquardt, vector),
        readings()[[0, 1, 2, 3, 4, 4]],
        RATES,
        "duplicated_observation",
        id="the same recording twice",
    ),
    pytest.param(EVERY, readings(ONE_AXIS), ONE_AXIS, "rank_deficient", id="all on one axis"),
    pytest.param(EVERY, np.zeros((6, 3)), RATES, "zero_reading", id="all zeros"),
    pytest.param(EVERY, np.degrees(readings()), RATES, "wrong_unit.*readings", id="°/s read"),
    pytest.param(EVERY, readings(), np.degrees(RATES), "wrong_unit.*rates", id="°/s turned"),
    pytest.param(WITH_DIRECTION, readings()[:, [1, 0, 2]], RATES, "swapped_axes.*x reads y, y reads x", id="swapped"),
    pytest.param(WITH_DIRECTION, readings()[:, [1, 2, 0]], RATES, "swapped_axes", id="renamed in turn"),
    pytest.param(WITH_DIRECTION, readings() * [1, -1, 1], RATES, "mirrored_axis.*y", id="mirrored axis"),
    pytest.param(WITH_DIRECTION, -readings(), RATES, "mirrored_axis.*x, y, z", id="directions turned round"),
]


@pytest.mark.parametrize(("estimates", "means", "rates", "name"), CASES)
def test_it_is_refused_by_name(estimates: tuple[Estimate, ...], means: Array, rates: Array, name: str) -> None:
    for estimate in estimates:
        with pytest.raises(Fault, match=name) as refusal:
            estimate(means, rates)
        assert refusal.value.what and refusal.value.remedy


@pytest.mark.parametrize("size", [1.5, 5.0])
def test_a_bias_larger_than_the_speed_is_no_reason_to_refuse(size: float) -> None:
    bias: Array = size * SPEED * np.array([1.0, -0.8, 0.6])
    means = RATES / SCALE - bias
    scale, found = closed_form(means, SPEED)
    np.testing.assert_allclose(scale, SCALE, rtol=1e-9)
    np.testing.assert_allclose(found, bias, rtol=1e-9)
    for estimate in EVERY:
        solution = estimate(means, RATES)
        np.testing.assert_allclose(solution.bias_rad_s, bias, rtol=1e-9)


def test_readings_no_gyroscope_can_give_have_a_negative_square() -> None:
    means = np.array([[1, 0, 2], [-1, 0, 2], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64)
    speeds = np.sqrt([3.5, 3.5, 1, 1, 1, 1])
    accumulated = Accumulator.empty()
    for mean, speed in zip(means, speeds, strict=True):
        accumulated = accumulated.add(mean, np.full(3, VARIANCE), float(speed))
    with pytest.raises(Fault, match="negative_square"):
        accumulated.solve()
    with pytest.raises(Fault, match="negative_square"):
        solve_levenberg_marquardt(means, speeds, np.full((6, 3), VARIANCE))


def test_a_variance_must_be_positive_and_a_shape_right() -> None:
    with pytest.raises(Fault, match="bad_variance"):
        solve_vector_model(readings(), RATES, np.zeros((6, 3)))
    with pytest.raises(Fault, match="bad_variance"):
        solve_levenberg_marquardt(readings(), np.full(6, SPEED), np.zeros((6, 3)))
    with pytest.raises(Fault, match="bad_speed"):
        solve_levenberg_marquardt(readings(), np.zeros(6), np.full((6, 3), VARIANCE))
    with pytest.raises(ValueError, match="rates must be"):
        solve_vector_model(readings(), RATES[:5], np.full((6, 3), VARIANCE))


def test_what_is_hardly_told_is_ill_conditioned() -> None:
    leaning: Array = SPEED * np.array(
        [[1, 0, 0], [-1, 0, 0], [1, 0.02, 0], [-1, -0.02, 0], [1, 0, 0.02], [-1, 0, -0.02]]
    )
    with pytest.raises(Fault, match=r"ill_conditioned: .*condition .*the limit is 100"):
        vector(readings(leaning), leaning)
    with pytest.raises(Fault, match="ill_conditioned"):
        check_conditioning(condition_of(np.diag([1.0, 1e-3]), 2), 2, 100.0, "y", "Do more")
    with pytest.raises(Fault, match=r"rank_deficient: .*\(1 of 2\)"):
        check_conditioning(condition_of(np.diag([1.0, 1e-3]), 2, noise=1e-3), 2, 100.0, "y", "Do more")


def test_a_sensor_mounted_otherwise_than_said_is_refused() -> None:
    turned = Rotation.from_rotvec(np.full(3, np.radians(58) / np.sqrt(3))).as_matrix()
    with pytest.raises(Fault, match=r"wrong_mounting: .* 47° off"):
        check_axes(turned, np.eye(3))
    check_axes(turned, turned)
    check_axes(turned, None)
    with pytest.raises(Fault, match=r"mirrored_axis.*left-handed"):
        check_axes(np.diag([1.0, 1.0, -1.0]), None)


def test_triaxial_readings_are_refused_alike() -> None:
    r, variances = attitudes(8), np.full((8, 3), 1e-8)
    m = np.einsum("nji,j->ni", r, [0.3, 0.2, 0.9])
    spoiled = m.copy()
    spoiled[3, 1] = np.nan
    frozen = np.tile(m[:1], (8, 1))
    cases = [
        (m[:4], r[:4], "too_few_observations"),
        (spoiled, r, "not_finite"),
        (np.zeros((8, 3)), r, "zero_reading"),
        (frozen, r, "duplicated_observation"),
        (frozen + 1e-4 * np.arange(8)[:, None], r, "rank_deficient"),
        (m, np.tile(r[:1], (8, 1, 1)), "rank_deficient"),
    ]
    for readings_, attitudes_, name in cases:
        count = len(readings_)
        with pytest.raises(Fault, match=name):
            solve_triaxial(readings_, attitudes_, variances[:count], KnownNorm(1, [0, 0, 1]))


def test_residuals_are_compared_with_what_their_variances_explain() -> None:
    assert warn_of_residuals(np.ones((4, 3)), np.ones((4, 3)), 6) == ()
    assert "5.7 times" in warn_of_residuals(4 * np.ones((4, 3)), np.ones((4, 3)), 6)[0]
    assert warn_of_residuals(np.ones((4, 3)), np.ones((4, 3)), 0) == ()


def test_one_name_has_one_wording_whichever_estimator_refuses() -> None:
    """A revolution added alone has no row; everything else reads alike, gathered or solved at once."""
    spoiled: list[tuple[Array, Array, Array]] = [
        (np.full((6, 3), np.nan), RATES, np.full((6, 3), VARIANCE)),
        (np.zeros((6, 3)), RATES, np.full((6, 3), VARIANCE)),
        (readings(), RATES, np.zeros((6, 3))),
        (readings(), 0 * RATES, np.full((6, 3), VARIANCE)),
        (readings()[:5], RATES[:5], np.full((5, 3), VARIANCE)),
    ]
    for means, rates, variances in spoiled:
        speeds = np.linalg.norm(rates, axis=1)
        with pytest.raises(Fault) as at_once:
            solve_levenberg_marquardt(means, speeds, variances)
        with pytest.raises(Fault) as gathered:
            accumulated = Accumulator.empty()
            for mean, speed, variance in zip(means, speeds, variances, strict=True):
                accumulated = accumulated.add(mean, variance, float(speed))
            accumulated.solve()
        assert str(gathered.value) == str(at_once.value).replace(", row 0", "")


def test_a_wrong_unit_is_named_alike_by_scale_factor_and_by_turn_rate() -> None:
    doubtful: tuple[Callable[[], None], ...] = (
        lambda: check_unit(np.full(3, np.pi / 180)),
        lambda: check_reading_ratio(57.3, "sweep 1"),
    )
    for degrees_read in doubtful:
        with pytest.raises(Fault, match=r"wrong_unit: .*: the readings look like degrees per second given as rad/s"):
            degrees_read()
    with pytest.raises(Fault, match=r"wrong_unit: in sweep 1 the gyroscope reads 5 times .*: check range"):
        check_reading_ratio(5.0, "sweep 1")
    with pytest.raises(Fault, match="wrong_unit"):
        check_reading_ratio(0.25, "sweep 1")
    check_reading_ratio(3.9, "sweep 1")


def test_a_fit_that_comes_to_no_end_is_refused_by_name() -> None:
    with pytest.raises(Fault, match=r"^attitude_untrustworthy: .* no fit converges"), convergence_required():
        np.linalg.cholesky(-np.eye(3))
