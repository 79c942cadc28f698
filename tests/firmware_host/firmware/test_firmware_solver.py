"""The board's solver, in single precision, against the rig's in double; undefined behaviour is trapped."""

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from firmware_host.protocol import MAX_SCALE, METHODS, SOLUTION_STATUSES
from rig.errors import Fault
from rig.estimation import refusals
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.accumulator import Accumulator, SixObservationEstimator, Solution
from support.board.host_board import core

pytestmark = pytest.mark.slow

DIRECTIONS = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], dtype=np.float64)
SCALE_AGREEMENT = 1e-4  # relative
BIAS_AGREEMENT_RAD_S = 1e-5


class CAccumulator(ctypes.Structure):
    """`struct accumulator` of core/calibration/solver.h."""

    _fields_ = (("r", ctypes.c_float * 56), ("count", ctypes.c_uint16))


class CSolution(ctypes.Structure):
    """`struct solution` of core/calibration/solver.h."""

    _fields_ = (
        ("status", ctypes.c_int),
        ("iterations", ctypes.c_uint8),
        ("scale", ctypes.c_float * 3),
        ("bias_rad_s", ctypes.c_float * 3),
    )


@dataclass(frozen=True, slots=True)
class BoardSolution:
    status: str
    iterations: int
    scale: Array
    bias_rad_s: Array


def solve_on_board(means_rad_s: Array, speeds_rad_s: Array, method: str = "closed_form") -> BoardSolution:
    accumulator, solution = CAccumulator(), CSolution()
    core().solver_begin(ctypes.byref(accumulator))
    for mean, speed in zip(means_rad_s, speeds_rad_s, strict=True):
        core().solver_add(ctypes.byref(accumulator), (ctypes.c_float * 3)(*mean), ctypes.c_float(speed))
    core().solver_solve(ctypes.byref(accumulator), METHODS.index(method), ctypes.byref(solution))
    return BoardSolution(
        SOLUTION_STATUSES[solution.status],
        solution.iterations,
        np.array(solution.scale, dtype=np.float64),
        np.array(solution.bias_rad_s, dtype=np.float64),
    )


def solve_on_host(means_rad_s: Array, speeds_rad_s: Array, estimator: SixObservationEstimator = "newton") -> Solution:
    """In double precision, from what single precision holds of the observations, all with the same weight."""
    accumulated = Accumulator.empty()
    for mean, speed in zip(means_rad_s.astype(np.float32), speeds_rad_s.astype(np.float32), strict=True):
        accumulated = accumulated.add(mean, np.ones(3), float(speed), weight=1.0)
    return accumulated.solve(estimator)


def readings(
    directions: Array, speeds_rad_s: Array, scale: Array, bias_rad_s: Array, mounting: Rotation | None = None
) -> Array:
    """Mean readings (N, 3) of sweeps about `directions` (N, 3) at `speeds_rad_s` (N,)."""
    turned = directions if mounting is None else mounting.apply(directions)
    means: Array = speeds_rad_s[:, None] * turned / scale - bias_rad_s
    return means


@dataclass(frozen=True, slots=True)
class Case:
    """Observations, and β0/ω² of the bias behind them: Algorithm 1 converges below 1/2."""

    means_rad_s: Array
    speeds_rad_s: Array
    bias_ratio: float


def random_case(rng: np.random.Generator, largest_ratio: float) -> Case:
    """Six to thirty sweeps in any order, at 0.3 to 3.2 rad/s, equal or not, any mounting, with and without noise."""
    repeats = int(rng.choice([1, 1, 1, 2, 3, 5]))
    directions = rng.permutation(np.tile(DIRECTIONS, (repeats, 1)))
    speed = rng.uniform(0.3, 3.2)
    unequal = rng.choice([0.0, 0.1])
    speeds = speed * rng.uniform(1 - unequal, 1 + unequal, len(directions))
    mounting = Rotation.from_rotvec(rng.normal(size=3) * rng.choice([0.15, 2.0]))
    scale = rng.uniform(0.5, 1.5, 3)
    ratio = float(rng.choice([rng.uniform(0, 0.5), rng.uniform(0, largest_ratio)]))
    towards = rng.normal(size=3)
    bias = np.sqrt(ratio) * speed * towards / np.linalg.norm(towards) / scale
    noise = rng.choice([0.0, 1e-3]) * rng.normal(size=(len(directions), 3))
    return Case(readings(directions, speeds, scale, bias, mounting) + noise, speeds, ratio)


def differences(board: BoardSolution, host: Solution) -> tuple[float, float]:
    """Largest relative difference in scale, largest difference in bias, rad/s."""
    return (
        float(np.max(np.abs(board.scale / host.scale - 1))),
        float(np.max(np.abs(board.bias_rad_s - host.bias_rad_s))),
    )


@pytest.mark.thorough
def test_the_closed_form_agrees_with_double_precision_also_where_algorithm_1_diverges() -> None:
    rng = np.random.default_rng(20261121)
    found = []
    for _ in range(3000):
        case = random_case(rng, largest_ratio=4.0)
        board = solve_on_board(case.means_rad_s, case.speeds_rad_s)
        try:
            host = solve_on_host(case.means_rad_s, case.speeds_rad_s)
        except Fault as refused:
            assert refused.name == "rank_deficient"  # a mounting that hides a direction; the board's gate is wider
            continue
        assert board.status == "solved"
        assert board.iterations <= 4
        found.append((case.bias_ratio > 0.5, *differences(board, host)))
    diverging, scale, bias = np.array(found).T
    assert len(found) > 2700 and np.sum(diverging) > 1000
    assert scale.max() < SCALE_AGREEMENT / 10 and bias.max() < BIAS_AGREEMENT_RAD_S / 2
    mild = diverging == 0
    assert scale[mild].max() < SCALE_AGREEMENT / 40 and bias[mild].max() < BIAS_AGREEMENT_RAD_S / 8


@pytest.mark.thorough
def test_algorithm_1_agrees_with_double_precision_or_says_that_it_does_not_converge() -> None:
    rng = np.random.default_rng(7)
    solved = diverged = 0
    for _ in range(1500):
        case = random_case(rng, largest_ratio=1.5)
        board = solve_on_board(case.means_rad_s, case.speeds_rad_s, "algorithm_1")
        try:
            host = solve_on_host(case.means_rad_s, case.speeds_rad_s, "algorithm_1")
        except Fault as refused:
            if refused.name == "algorithm_1_diverged":
                assert board.status == "not_converged"
                assert not board.scale.any() and not board.bias_rad_s.any()
                diverged += 1
            continue
        if case.bias_ratio < 0.5 and host.iterations < 100:  # beyond, it converges by chance if at all
            assert board.status == "solved"
            assert abs(board.iterations - host.iterations) <= 2 + host.iterations // 5
            scale, bias = differences(board, host)
            assert scale < SCALE_AGREEMENT and bias < BIAS_AGREEMENT_RAD_S
            solved += 1
    assert solved > 700 and diverged > 300


def test_a_few_passes_are_enough_for_a_common_sensor_and_one_step_for_the_closed_form() -> None:
    speeds = np.full(6, 1.0472)
    means = readings(
        DIRECTIONS, speeds, np.array([1.1771, 1.1554, 1.1440]), np.array([0.0077, -0.01, -0.0051])
    )  # SIX, table II
    assert solve_on_board(means, speeds).iterations == 1
    assert 3 <= solve_on_board(means, speeds, "algorithm_1").iterations <= 6


axis = st.floats(-1, 1, allow_nan=False, width=32)


@given(
    more=st.lists(st.sampled_from(range(6)), max_size=14),
    order=st.permutations(range(6)),
    scale=st.tuples(*[st.floats(0.5, 1.5)] * 3),
    bias_by_speed=st.tuples(axis, axis, axis),
    mounting=st.tuples(axis, axis, axis),
    ratios=st.lists(st.floats(0.9, 1.1), min_size=20, max_size=20),
    speed_rad_s=st.floats(0.2, 3.2),
)
def test_any_observations_the_rig_accepts_are_solved_alike(
    *,
    more: list[int],
    order: Sequence[int],
    scale: tuple[float, float, float],
    bias_by_speed: tuple[float, float, float],
    mounting: tuple[float, float, float],
    ratios: list[float],
    speed_rad_s: float,
) -> None:
    directions = DIRECTIONS[[*order, *more]]
    speeds = speed_rad_s * np.array(ratios[: len(directions)])
    bias = np.array(bias_by_speed) * speed_rad_s
    means = readings(directions, speeds, np.array(scale), bias, Rotation.from_rotvec(mounting))
    board = solve_on_board(means, speeds)
    try:
        host = solve_on_host(means, speeds)
    except Fault:
        return
    assert board.status == "solved"
    scale_difference, bias_difference = differences(board, host)
    assert scale_difference < SCALE_AGREEMENT and bias_difference < BIAS_AGREEMENT_RAD_S


@given(
    st.lists(st.sampled_from(range(6)), min_size=6, max_size=20),
    st.sampled_from(range(6)),
    st.floats(0, 3e-4),
    st.integers(0, 2**32 - 1),
    st.sampled_from(METHODS),
)
def test_a_missing_direction_is_degenerate_however_often_the_others_were_swept(
    swept: list[int], missing: int, noise_rad_s: float, seed: int, method: str
) -> None:
    directions = DIRECTIONS[[(missing + 1) % 6 if i == missing else i for i in swept]]
    speeds = np.full(len(directions), 1.0472)
    means = readings(directions, speeds, np.array([1.18, 1.16, 1.14]), np.array([0.01, -0.02, 0.03]))
    means += noise_rad_s * np.random.default_rng(seed).normal(size=means.shape)
    board = solve_on_board(means, speeds, method)
    assert board.status == "degenerate"
    assert not board.scale.any() and not board.bias_rad_s.any()


@pytest.mark.parametrize(("angle_deg", "status"), [(5.0, "degenerate"), (20.0, "solved")])  # condition 326 and 19
def test_a_direction_swept_at_too_small_an_angle_to_another_is_degenerate(angle_deg: float, status: str) -> None:
    angle_rad = np.radians(angle_deg)
    leaning = np.array([0.0, np.sin(angle_rad), np.cos(angle_rad)])
    directions = np.vstack([DIRECTIONS[:4], leaning, -leaning, leaning * (1, -1, 1), (np.sqrt(0.5), 0.0, np.sqrt(0.5))])
    speeds = np.full(len(directions), 1.0472)
    means = readings(directions, speeds, np.array([1.1771, 1.1554, 1.1440]), np.array([0.0077, -0.0100, -0.0051]))
    assert solve_on_board(means, speeds).status == status


def test_readings_that_are_all_alike_or_zero_are_degenerate() -> None:
    for means in (np.zeros((6, 3)), np.full((8, 3), 0.7), np.outer(np.arange(1, 8), [0.1, 0.2, 0.3])):
        assert solve_on_board(means, np.full(len(means), 1.0)).status == "degenerate"


@pytest.mark.parametrize("method", METHODS)
def test_readings_no_scale_factor_explains_are_degenerate(method: str) -> None:
    """They lie on x² + y² − z²/2 = 1, well apart."""
    means = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [1.5, 0, 2.5**0.5], [-1.5, 0, -(2.5**0.5)]])
    with pytest.raises(Fault) as refused:
        solve_on_host(means, np.ones(6))
    assert refused.value.name == "negative_square"
    assert solve_on_board(means, np.ones(6), method).status == "degenerate"


@pytest.mark.parametrize("count", range(6))
def test_fewer_than_six_are_too_few(count: int) -> None:
    speeds = np.full(count, 1.0)
    means = readings(DIRECTIONS[:count], speeds, np.ones(3), np.zeros(3))
    assert solve_on_board(means, speeds).status == "too_few_observations"


def test_hundreds_of_observations_lose_no_precision() -> None:
    rng = np.random.default_rng(3)
    directions = np.tile(DIRECTIONS, (100, 1))
    speeds = rng.uniform(0.9, 1.1, len(directions))
    means = readings(directions, speeds, np.array([1.2, 0.9, 1.1]), np.array([0.1, 0.2, -0.3]))
    means += 1e-3 * rng.normal(size=means.shape)
    scale, bias = differences(solve_on_board(means, speeds), solve_on_host(means, speeds))
    assert scale < SCALE_AGREEMENT / 10 and bias < BIAS_AGREEMENT_RAD_S / 2


def test_what_is_not_a_number_is_degenerate() -> None:
    speeds = np.full(6, 1e30)
    means = readings(DIRECTIONS, speeds, np.ones(3), np.zeros(3))
    assert solve_on_board(means, speeds).status == "degenerate"


def test_board_and_host_refuse_the_same_scale_factors() -> None:
    """The estimators know no board, so each end has its own constant."""
    assert MAX_SCALE == refusals.MAX_SCALE_RATIO
