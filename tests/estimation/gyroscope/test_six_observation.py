"""The solver of the six observations: exact where the paper's iteration fails, honest in its uncertainty."""

import numpy as np
import pytest

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.accumulator import Accumulator, Solution
from rig.estimation.gyroscope.six_observation import closed_form, design

SPEED = np.pi / 3
DIRECTIONS = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], dtype=np.float64)
SCALE = np.array([1.1771, 1.1554, 1.1440])  # the turntable's LSM9DS1, SIX, table II
BIAS = np.array([0.0077, -0.0100, -0.0051])
LARGE_BIAS = np.array([0.15, -0.13, 0.18])
VARIANCE = np.full(3, 0.035**2 / 1428)


def tilt(degrees: float) -> Array:
    """A mounting error about (1, 1, 1)."""
    cross = np.array([[0, -1, 1], [1, 0, -1], [-1, 1, 0]]) / np.sqrt(3)
    angle = np.radians(degrees)
    rotation: Array = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return rotation


def sweeps(
    scale: Array = SCALE, bias: Array = BIAS, speeds: Array | float = SPEED, directions: Array = DIRECTIONS
) -> tuple[Array, Array]:
    """Noise-free mean readings (n, 3) of sweeps with 5° of mounting error, and their speeds (n,)."""
    every = np.broadcast_to(np.asarray(speeds, dtype=np.float64), len(directions))
    return every[:, None] * directions @ tilt(5).T / scale - bias, every


def gather(
    means: Array,
    speeds: Array,
    variance: Array = VARIANCE,
    weight: float | None = None,
    after: Accumulator | None = None,
) -> Accumulator:
    accumulated = Accumulator.empty() if after is None else after
    for mean, speed in zip(means, speeds, strict=True):
        accumulated = accumulated.add(mean, variance, float(speed), weight=weight)
    return accumulated


def values(solution: Solution) -> Array:
    return np.concatenate([solution.scale, solution.bias_rad_s])


@pytest.mark.parametrize("size", [0.0, 0.1, 1.0, 3.0])
def test_newton_is_exact_for_measured_speeds_whatever_the_bias(size: float) -> None:
    bias = size * np.array([1.0, -0.7, 0.4])
    means, speeds = sweeps(bias=bias, speeds=SPEED * (1 + 1e-3 * np.array([0, 1, -2, 3, -1, 2])))
    solution = gather(means, speeds).solve()
    np.testing.assert_allclose(solution.scale, SCALE, rtol=1e-11)
    np.testing.assert_allclose(solution.bias_rad_s, bias, atol=1e-11)
    assert solution.iterations <= 3


def test_newton_is_exact_where_one_way_round_is_faster_than_the_other() -> None:
    """The mean of the readings, from which they are counted, is then not the bias."""
    means, speeds = sweeps(speeds=SPEED * np.array([1, 2, 1, 2, 1, 2]))
    np.testing.assert_allclose(values(gather(means, speeds).solve()), [*SCALE, *BIAS], rtol=1e-9)


def test_the_closed_form_is_exact_at_one_speed() -> None:
    bias = np.array([2.0, -1.5, 1.0])  # β0/ω² = 8: sixteen times what Algorithm 1 bears
    means, speeds = sweeps(bias=bias)
    scale, found = closed_form(means, SPEED)
    np.testing.assert_allclose(scale, SCALE, rtol=1e-11)
    np.testing.assert_allclose(found, bias, rtol=1e-11)
    np.testing.assert_allclose(values(gather(means, speeds).solve()), [*scale, *found], rtol=1e-10)


def test_the_bias_belongs_to_the_reading_and_squares_stand_first() -> None:
    means, _ = sweeps()
    np.testing.assert_allclose(np.linalg.norm(SCALE * (means + BIAS), axis=1), SPEED)
    np.testing.assert_array_equal(design([2.0, 3.0, 5.0]), [4.0, 9.0, 25.0, 2.0, 3.0, 5.0])


def published(means: Array, speeds: Array) -> tuple[Array, int]:
    """Algorithm 1, line by line from the paper."""
    x, y = design(means), speeds**2
    inverse = np.linalg.inv(x.T @ x) @ x.T
    beta, passes = inverse @ y, 1
    while True:
        gamma = sum(beta[s + 3] ** 2 / (4 * beta[s]) for s in range(3))
        improved = inverse @ (y - gamma)
        passes += 1
        if np.sum(np.abs(improved - beta)) <= 1e-6:
            return improved, passes
        beta = improved


@pytest.mark.parametrize("speed", [3.0, SPEED])
@pytest.mark.parametrize(
    ("scale", "bias"),
    [
        (SCALE, BIAS),
        ([1.9074, 1.9529, 1.5635], [0.0827, 0.0265, -0.0805]),  # SIX, table I, row 1
        ([1.0979, 1.1052, 0.9851], [-0.1046, 0.1995, 0.1565]),  # row 2
        ([1.5044, 1.6494, 1.5282], [0.1483, -0.1282, 0.1794]),  # row 3
    ],
)
def test_algorithm_1_is_the_published_one(scale: Array, bias: Array, speed: float) -> None:
    means, speeds = sweeps(np.array(scale), np.array(bias), speed)
    beta, passes = published(means, speeds)
    solution = gather(means, speeds, weight=1.0).solve("algorithm_1")
    assert solution.iterations == passes
    np.testing.assert_allclose(solution.scale, np.sqrt(beta[:3]), rtol=1e-10)
    np.testing.assert_allclose(solution.bias_rad_s, beta[3:] / (2 * beta[:3]), rtol=1e-8)
    np.testing.assert_allclose(solution.scale, scale, atol=1e-5)


def test_algorithm_1_says_that_it_diverges() -> None:
    bias = np.array([0.4, -0.4, 0.4])  # β0/ω² = 0.58
    accumulated = gather(*sweeps(bias=bias))
    with pytest.raises(Fault, match=r"algorithm_1_diverged.*newton"):
        accumulated.solve("algorithm_1")
    np.testing.assert_allclose(accumulated.solve().bias_rad_s, bias, rtol=1e-10)


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.parametrize("bias", [SPEED / SCALE / np.sqrt(3), SPEED / SCALE * [1, 0, 0], np.array([30.0, -20.0, 10.0])])
def test_a_bias_as_large_as_the_turn_is_solved_with_its_uncertainty(bias: Array, thorough: bool) -> None:
    """‖K b‖ = ω makes Eq. (7) singular, and a sweep against such a bias reads almost zero."""
    rng = np.random.default_rng(9)
    means, speeds = sweeps(bias=bias)
    solution = gather(means, speeds).solve()
    np.testing.assert_allclose(values(solution), [*SCALE, *bias], rtol=1e-7, atol=1e-7)
    assert solution.condition < 1.2
    usual = gather(*sweeps()).solve().covariance
    np.testing.assert_allclose(solution.covariance, usual, rtol=0.02, atol=1e-9)
    count, tolerance = (500, 0.15) if thorough else (150, 0.25)
    draws = means + rng.normal(size=(count, 6, 3)) * np.sqrt(VARIANCE)
    errors = np.array([values(gather(draw, speeds).solve()) for draw in draws]) - [*SCALE, *bias]
    np.testing.assert_allclose(errors.std(axis=0), np.sqrt(np.diag(solution.covariance)), rtol=tolerance)


def test_one_sweep_with_a_badly_known_speed_does_not_make_the_design_a_bad_one() -> None:
    accumulated = Accumulator.empty()
    for sweep, (mean, speed) in enumerate(zip(*sweeps(), strict=True)):
        accumulated = accumulated.add(mean, VARIANCE * 1e-4, float(speed), 1e-2 if sweep == 0 else 0.0)
    solution = accumulated.solve()
    assert solution.rank == 6 and solution.condition < 1.2
    np.testing.assert_allclose(values(solution), [*SCALE, *BIAS], rtol=1e-7)


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.parametrize(
    ("repeats", "bias"),
    [
        (1, BIAS),
        pytest.param(3, BIAS, marks=[pytest.mark.proof, pytest.mark.thorough]),
        pytest.param(1, LARGE_BIAS, marks=[pytest.mark.proof, pytest.mark.thorough]),
        (3, LARGE_BIAS),
    ],
)
def test_the_covariance_is_that_of_repeated_calibrations(repeats: int, bias: Array) -> None:
    rng = np.random.default_rng(5)
    means, speeds = sweeps(bias=bias, directions=np.tile(DIRECTIONS, (repeats, 1)))
    variance = VARIANCE * np.array([1.0, 4.0, 0.25])
    reported = gather(means, speeds, variance).solve().covariance
    draws = means + rng.normal(size=(4000 // repeats, *means.shape)) * np.sqrt(variance)
    errors = np.array([values(gather(draw, speeds, variance).solve()) for draw in draws]) - [*SCALE, *bias]
    np.testing.assert_allclose(np.var(errors, axis=0), np.diag(reported), rtol=0.1 * np.sqrt(repeats))
    std = np.sqrt(np.diag(reported))
    np.testing.assert_allclose(np.corrcoef(errors.T), reported / np.outer(std, std), atol=0.06 * np.sqrt(repeats))
    assert np.all(np.abs(errors.mean(axis=0)) < 4 * std / np.sqrt(len(errors)))


@pytest.mark.slow
@pytest.mark.proof
def test_speeds_known_badly_make_the_scale_uncertain(thorough: bool) -> None:
    count, tolerance = (1500, 0.1) if thorough else (300, 0.18)
    rng = np.random.default_rng(6)
    means, speeds = sweeps()
    std = SPEED * np.array([1e-2, 1e-4, 3e-3, 3e-3, 1e-3, 1e-3])
    accumulated = Accumulator.empty()
    for mean, speed, deviation in zip(means, speeds, std, strict=True):
        accumulated = accumulated.add(mean, VARIANCE / 100, float(speed), float(deviation))
    reported = np.sqrt(np.diag(accumulated.solve().covariance))
    draws = speeds + rng.normal(size=(count, 6)) * std
    errors = np.array([values(gather(means, draw, VARIANCE / 100).solve()) for draw in draws]) - [*SCALE, *BIAS]
    np.testing.assert_allclose(errors.std(axis=0), reported, rtol=tolerance)


def test_sweeps_add_up_in_any_order_and_from_any_parts() -> None:
    means, speeds = sweeps(directions=np.tile(DIRECTIONS, (3, 1)))
    whole = gather(means, speeds).solve()
    parts = gather(means[:11][::-1], speeds[:11], after=gather(means[11:], speeds[11:]))
    np.testing.assert_allclose(values(parts.solve()), values(whole), rtol=1e-9)
    once = gather(means[:6], speeds[:6]).solve()
    np.testing.assert_allclose(whole.covariance, once.covariance / 3, rtol=1e-6, atol=1e-15)
    assert (whole.observations, once.observations) == (18, 6)


def test_a_noisy_sweep_counts_for_less() -> None:
    means, speeds = sweeps(directions=np.tile(DIRECTIONS, (2, 1)))
    off = np.array([0.0, 0.0, 0.05])
    sound = gather(means[:6], speeds[:6])
    poor = gather(means[6:] + off, speeds[6:], VARIANCE * 1e4, after=sound).solve()
    alike = gather(means[6:] + off, speeds[6:], after=sound).solve()
    assert abs(poor.bias_rad_s[2] - BIAS[2]) < 1e-4
    assert abs(alike.bias_rad_s[2] - BIAS[2]) > 1e-2


def noisy(means: Array) -> Array:
    noise: Array = np.random.default_rng(3).normal(size=means.shape) * np.sqrt(VARIANCE)
    return means + noise


NEGATIVE = np.array([[1, 0, 2], [-1, 0, 2], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64)


@pytest.mark.parametrize(
    ("means", "speeds", "name"),
    [
        pytest.param(*sweeps(directions=DIRECTIONS[:5]), "too_few_observations", id="five sweeps"),
        pytest.param(*sweeps(directions=DIRECTIONS[[1, 1, 2, 3, 4, 5]]), "rank_deficient: .* z ", id="duplicate"),
        pytest.param(
            noisy(sweeps(directions=DIRECTIONS[[1, 1, 2, 3, 4, 5]])[0]),
            sweeps()[1],
            "rank_deficient: .* z ",
            id="noisy",
        ),
        pytest.param(
            noisy(sweeps(directions=DIRECTIONS[[0, 1, 2, 2, 4, 5]])[0]),
            sweeps()[1],
            "rank_deficient: .* x ",
            id="no −x",
        ),
        pytest.param(
            noisy(sweeps(directions=DIRECTIONS[[0, 1, 0, 1, 0, 1]])[0]), sweeps()[1], "rank_deficient", id="one axis"
        ),
        pytest.param(np.zeros((6, 3)), sweeps()[1], "zero_reading", id="zeros"),
        pytest.param(np.full((6, 3), np.nan), sweeps()[1], "not_finite", id="NaN"),
        pytest.param(sweeps()[0], np.full(6, np.inf), "not_finite", id="infinite speed"),
        pytest.param(sweeps()[0], np.zeros(6), "bad_speed", id="no speed"),
        pytest.param(sweeps()[0], -sweeps()[1], "bad_speed", id="negative speed"),
        pytest.param(NEGATIVE, np.sqrt([3.5, 3.5, 1, 1, 1, 1]), "negative_square", id="negative square"),
    ],
)
def test_readings_that_make_no_calibration_are_refused_by_name(means: Array, speeds: Array, name: str) -> None:
    with pytest.raises(Fault, match=name):
        gather(means, speeds).solve()


def test_a_variance_must_be_positive() -> None:
    with pytest.raises(Fault, match="bad_variance"):
        gather(*sweeps(), variance=np.zeros(3))


@pytest.mark.parametrize("degrees", [0.0, 10.0, 20.0])
@pytest.mark.parametrize("size", [0.0, 0.2, 0.6, 3.0])
def test_good_designs_pass_the_gate(degrees: float, size: float) -> None:
    means = SPEED * DIRECTIONS @ tilt(degrees).T / SCALE - size
    assert gather(noisy(means), np.full(6, SPEED)).solve().rank == 6
