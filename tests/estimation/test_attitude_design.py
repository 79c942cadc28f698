"""How well attitudes will tell an accelerometer, before it is measured."""

from itertools import product

import numpy as np
import pytest

from rig.config.procedures.attitude_sets import FACE_ATTITUDES, OPTIMAL_ATTITUDES, WristAngles
from rig.estimation.arrays import Array
from rig.estimation.design.attitude_design import (
    ExpectedStds,
    Order,
    assess_identifiability,
    g_efficiency,
    predict_stds,
)
from rig.estimation.reference.attitude_error import effects, find_whiteners
from rig.estimation.reference.reference_model import KnownNorm, weighted_jacobian
from rig.estimation.reference.triaxial import solve_triaxial
from support.motions.arm_attitudes import attitudes_of, joints_rad
from support.motions.exchange_search import exchange_search, information, log_determinant

G = 9.80665
UP = np.array([0.0, 0.0, 1.0])
KVH, MPU9250 = 119e-6 * G, 300e-6 * G  # m/s²/√Hz


def flange_to_base(wrists_deg: tuple[WristAngles, ...]) -> Array:
    return attitudes_of(joints_rad(wrists_deg))


def reached(wrists_deg: tuple[WristAngles, ...], error_rad: float, order: Order = 1) -> ExpectedStds:
    """By a KVH 1775 in 10 s."""
    noise = np.full(len(wrists_deg), KVH / np.sqrt(10))
    return predict_stds(flange_to_base(wrists_deg), G * UP, noise, error_rad, order)


@pytest.mark.parametrize(
    ("wrists_deg", "error_rad", "scale_ppm", "angle_mrad", "bias_ug"),
    [
        (OPTIMAL_ATTITUDES, 0.0, 15.5, 0.022, 8.9),
        (OPTIMAL_ATTITUDES, 1e-4, 19.5, 0.033, 13.8),
        (OPTIMAL_ATTITUDES, 1e-3, 20.6, 0.036, 15.3),
        (OPTIMAL_ATTITUDES, 3e-3, 20.6, 0.036, 15.4),
        (FACE_ATTITUDES, 0.0, 18.8, 0.027, 10.9),
        (FACE_ATTITUDES, 1e-4, 18.8, 0.076, 16.8),
        (FACE_ATTITUDES, 1e-3, 18.8, 0.708, 18.8),
        (FACE_ATTITUDES, 3e-3, 18.8, 2.12, 18.8),
    ],
)
def test_faces_are_best_on_an_exact_table_and_lose_the_angles_on_a_real_arm(
    wrists_deg: tuple[WristAngles, ...], error_rad: float, scale_ppm: float, angle_mrad: float, bias_ug: float
) -> None:
    """The figures are those of an earlier calculation, made independently."""
    found = reached(wrists_deg, error_rad)
    assert 1e6 * found.scale_std == pytest.approx(scale_ppm, abs=0.06)
    assert 1e3 * found.non_orthogonality_std_rad == pytest.approx(angle_mrad, rel=0.02)
    assert 1e6 * found.bias_std_m_s2 / G == pytest.approx(bias_ug, abs=0.06)


@pytest.mark.slow
def test_condition_and_efficiency_are_those_of_the_best_designs() -> None:
    faces, eighteen = flange_to_base(FACE_ATTITUDES), flange_to_base(OPTIMAL_ATTITUDES)
    assert assess_identifiability(faces, UP).condition == pytest.approx(np.sqrt(3))
    assert assess_identifiability(faces, UP, 2).condition == pytest.approx(1 + np.sqrt(2))
    assert [g_efficiency(faces, UP, order) for order in (1, 2)] == pytest.approx([1.0, 1.0], abs=1e-6)
    assert assess_identifiability(eighteen, UP).condition < 1.9
    assert 0.9 < g_efficiency(eighteen, UP) < 1


def test_second_order_terms_triple_the_uncertainty_of_the_bias() -> None:
    first, second = (reached(OPTIMAL_ATTITUDES, 1e-3, order) for order in (1, 2))
    assert first.second_order_std_s2_m is None and second.second_order_std_s2_m == pytest.approx(6.1e-6, rel=0.02)
    assert 2.5 < second.bias_std_m_s2 / first.bias_std_m_s2 < 3
    assert reached(OPTIMAL_ATTITUDES, 0.0, 2).second_order_std_s2_m == pytest.approx(2.9e-6, rel=0.02)


@pytest.mark.slow
def test_no_other_eighteen_of_the_grid_are_noticeably_better() -> None:
    """D-optimal for 1 mrad: the determinant's 14th root, what a search finds over that of the eighteen."""
    grid = tuple((float(first), -90.0, float(third)) for first, third in product(range(-180, 180, 45), repeat=2))
    attitudes, theta = flange_to_base(grid), np.array([*np.eye(3).ravel(), *UP, 0.0, 0.0, 0.0])
    still = np.zeros((len(grid), 3))
    noise = np.full_like(still, (KVH / G) ** 2 / 10)
    white = find_whiteners(noise, effects(theta, attitudes, still), np.full(len(grid), 1e-3))
    rows = weighted_jacobian(theta, attitudes, still, white, norm_known=True).reshape(len(grid), 3, -1)
    each = information(rows)
    best = log_determinant(each, exchange_search(each, 18, np.random.default_rng(0), starts=10))
    shipped = log_determinant(each, [grid.index(wrists) for wrists in OPTIMAL_ATTITUDES])
    faces = log_determinant(each, [grid.index(wrists) for wrists in FACE_ATTITUDES])
    assert np.exp((best - shipped) / 14) < 1.001
    assert np.exp((best - faces) / 14) > 1.3  # the search would tell


@pytest.mark.parametrize(
    ("wrists_deg", "rank", "undetermined"),
    [
        (tuple((0.0, -90.0, float(third)) for third in range(-180, 180, 30)), 9, {"bias of z", "scale of z"}),
        (tuple((float(first), -90.0, 0.0) for first in range(-180, 180, 30)), 9, {"bias of x", "scale of x"}),
        (OPTIMAL_ATTITUDES[:4], 9, {"bias of z", "angle y z", "the vertical"}),
    ],
)
def test_attitudes_about_one_axis_or_too_few_are_said_to_tell_too_little(
    wrists_deg: tuple[WristAngles, ...], rank: int, undetermined: set[str]
) -> None:
    told = assess_identifiability(flange_to_base(wrists_deg), UP)
    assert (told.rank, told.needed, told.condition) == (rank, 14, np.inf)
    assert undetermined <= set(told.undetermined) and "bias of y" not in told.undetermined
    assert g_efficiency(flange_to_base(wrists_deg), UP) == 0.0


def test_full_rank_leaves_nothing_undetermined() -> None:
    assert assess_identifiability(flange_to_base(OPTIMAL_ATTITUDES), UP, 2).undetermined == ()
    faces = assess_identifiability(flange_to_base(FACE_ATTITUDES), UP)
    assert (faces.rank, faces.undetermined) == (14, ())


@pytest.mark.slow
def test_what_is_expected_is_what_a_fit_reaches() -> None:
    attitudes, rng = flange_to_base(OPTIMAL_ATTITUDES), np.random.default_rng(5)
    std = MPU9250 / np.sqrt(3)
    felt = G * attitudes[:, 2]
    off = []
    for _ in range(60):
        readings = felt + std * rng.normal(size=felt.shape)
        fit = solve_triaxial(
            readings,
            attitudes,
            np.full_like(felt, std**2),
            KnownNorm(G, UP),
            method="maximum_likelihood",
        )
        off.append([*(np.linalg.norm(fit.matrix, axis=1) - 1), *fit.bias])
    scale, bias = np.sqrt(np.mean(np.square(off).reshape(-1, 2, 3), axis=(0, 2)))
    told = predict_stds(attitudes, G * UP, np.full(18, std), 0.0)
    assert scale == pytest.approx(told.scale_std, rel=0.15)
    assert bias == pytest.approx(told.bias_std_m_s2, rel=0.15)
