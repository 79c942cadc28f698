"""Accelerometers in the attitudes of an arm that is not quite where it says: the weights that its errors ask for."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.config.procedures.attitude_sets import FACE_ATTITUDES, OPTIMAL_ATTITUDES
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.reference.reference_model import KnownNorm
from rig.estimation.reference.triaxial import Method, TriaxialSolution, solve_triaxial
from rig.study.rate_table import ACCELEROMETER_BIAS_M_S2, ACCELEROMETER_MATRIX, MG
from support.motions.arm_attitudes import attitudes_of, draw_true_attitudes, joints_rad

NORM = 9.80665
UP = NORM * np.array([0.02, -0.01, 1.0]) / np.linalg.norm([0.02, -0.01, 1.0])  # a base that is not quite upright
KVH_10_S, MPU_3_S, ADIS_3_S = (1e-3 * MG * density / np.sqrt(s) for density, s in ((119, 10), (300, 3), (23, 3)))
JOINTS = joints_rad(OPTIMAL_ATTITUDES)
AXIS_PAIRS = [1, 2, 0], [2, 0, 1]

pytestmark = pytest.mark.slow

Arm = Callable[[Array, np.random.Generator], Array]


def independent(error_rad: float) -> Arm:
    def arm(joints: Array, rng: np.random.Generator) -> Array:
        off = Rotation.from_rotvec(error_rad * rng.normal(size=(len(joints), 3))).as_matrix()
        attitudes: Array = attitudes_of(joints) @ off
        return attitudes

    return arm


def geometry(error_rad: float) -> Arm:
    return lambda joints, rng: draw_true_attitudes(joints, error_rad, rng)


def solve(m: Array, std: float, method: Method, r: Array, *, attitude_std_rad: Array | None = None) -> TriaxialSolution:
    variances = np.full_like(m, std**2)
    return solve_triaxial(m, r, variances, KnownNorm(NORM, (0, 0, 1)), method=method, attitude_std_rad=attitude_std_rad)


def recorded(arm: Arm, std: float, seed: int, joints: Array = JOINTS) -> Array:
    """Mean readings (N, 3) in the attitudes that `arm` really takes."""
    rng = np.random.default_rng(seed)
    felt = np.einsum("nji,j->ni", arm(joints, rng), UP)
    readings: Array = felt @ ACCELEROMETER_MATRIX.T + ACCELEROMETER_BIAS_M_S2 + std * rng.normal(size=felt.shape)
    return readings


@dataclass(frozen=True, slots=True)
class Errors:
    """RMS over runs: scale (parts), non-orthogonality (rad), bias (m/s²); and of scale and bias over what is stated."""

    scale: float
    non_orthogonality: float
    bias: float
    over_stated: float
    found_rad: Array


def errors(arm: Arm, std: float, method: Method, runs: int, joints: Array = JOINTS) -> Errors:
    scale = []
    angles = []
    bias = []
    stated = []
    found = []
    true_scale = np.linalg.norm(ACCELEROMETER_MATRIX, axis=1)
    true_axes = ACCELEROMETER_MATRIX / true_scale[:, None]
    for seed in range(runs):
        solution = solve(recorded(arm, std, seed, joints), std, method, attitudes_of(joints))
        size = np.linalg.norm(solution.matrix, axis=1)
        axes = solution.matrix / size[:, None]
        jacobian = np.zeros((6, 15))
        for i in range(3):
            jacobian[i, 3 * i : 3 * i + 3] = axes[i] / true_scale[i]
            jacobian[3 + i, 12 + i] = 1
        scale.append(size / true_scale - 1)
        bias.append(solution.bias - ACCELEROMETER_BIAS_M_S2)
        angles.append((axes @ axes.T - true_axes @ true_axes.T)[AXIS_PAIRS])
        covariance = np.diag(jacobian @ solution.covariance @ jacobian.T)
        stated.append(np.concatenate([scale[-1], bias[-1]]) / np.sqrt(covariance))
        found.append(0.0 if solution.attitude_error is None else solution.attitude_error.std_rad)
    rms = [float(np.sqrt(np.mean(np.square(each)))) for each in (scale, angles, bias, stated)]
    return Errors(rms[0], rms[1], rms[2], rms[3], np.array(found))


@pytest.mark.one_in(4)
@pytest.mark.parametrize(
    ("arm", "std", "better"),
    [
        pytest.param(geometry(1e-3), MPU_3_S, 2.5, id="MPU-9250, geometry"),
        pytest.param(geometry(1e-3), KVH_10_S, 8, id="KVH, geometry"),
        pytest.param(independent(1e-3), KVH_10_S, 8, id="KVH"),
        pytest.param(geometry(1e-3), ADIS_3_S, 15, id="ADIS16465, geometry"),
    ],
)
def test_an_arm_that_errs_by_a_milliradian_costs_little_and_is_reported(arm: Arm, std: float, better: float) -> None:
    """TRIAX weighs all directions alike, and no dwell however long helps it."""
    published, weighted = (errors(arm, std, method, 30) for method in ("as_published", "attitude_weighted"))
    assert weighted.scale * better < published.scale and weighted.bias * better < published.bias
    assert weighted.non_orthogonality * better < published.non_orthogonality
    assert 0.8 < weighted.over_stated < 1.3 < published.over_stated
    assert 0.7e-3 < np.sqrt(np.mean(weighted.found_rad**2)) < 1.4e-3


@pytest.mark.parametrize(
    "error_rad",
    [pytest.param(error, marks=[pytest.mark.proof, pytest.mark.thorough]) for error in (0.0, 1e-4, 3e-3)] + [1e-3],
)
def test_it_is_never_worse_than_equal_weights_or_than_the_size_of_gravity_alone(error_rad: float) -> None:
    arm = independent(error_rad)
    weighted = errors(arm, KVH_10_S, "attitude_weighted", 30)
    alike = errors(arm, KVH_10_S, "maximum_likelihood", 30)
    r, loose = attitudes_of(JOINTS), np.full(len(JOINTS), 0.03)
    size_alone = [
        solve(recorded(arm, KVH_10_S, seed), KVH_10_S, "attitude_weighted", r, attitude_std_rad=loose).bias
        for seed in range(30)
    ]
    size_alone_bias = np.sqrt(np.mean(np.square(np.array(size_alone) - ACCELEROMETER_BIAS_M_S2)))
    assert weighted.bias < 1.05 * min(alike.bias, size_alone_bias)
    assert weighted.scale < 1.05 * alike.scale


def test_exact_attitudes_are_found_exact_and_cost_nothing() -> None:
    weighted, alike = (
        errors(independent(0.0), MPU_3_S, method, 30) for method in ("attitude_weighted", "as_published")
    )
    assert np.median(weighted.found_rad) == 0.0
    assert weighted.scale < 1.03 * alike.scale and 0.85 < weighted.over_stated < 1.2


@pytest.mark.proof
def test_the_uncertainty_of_the_attitude_error_is_its_scatter(thorough: bool) -> None:
    found = [solve(recorded(independent(1e-3), KVH_10_S, seed), KVH_10_S, "attitude_weighted", attitudes_of(JOINTS))
             for seed in range(60 if thorough else 30)]  # fmt: skip
    told = [each.attitude_error for each in found]
    std = np.std([each.std_rad for each in told if each is not None])
    stated = np.mean([each.uncertainty_rad for each in told if each is not None])
    assert stated == pytest.approx(std, rel=0.3 if thorough else 0.4)


def test_faces_alone_lose_the_angles_between_the_axes_on_a_real_arm() -> None:
    eighteen, faces = (
        errors(independent(1e-3), KVH_10_S, "attitude_weighted", 20, joints_rad(wrists))
        for wrists in (OPTIMAL_ATTITUDES, FACE_ATTITUDES)
    )
    assert faces.non_orthogonality > 5 * eighteen.non_orthogonality


def test_what_is_said_of_the_attitudes_is_believed() -> None:
    m, r = recorded(independent(1e-3), KVH_10_S, 3), attitudes_of(JOINTS)
    told = solve(m, KVH_10_S, "attitude_weighted", r, attitude_std_rad=np.full(len(r), 1e-3))
    found = solve(m, KVH_10_S, "attitude_weighted", r)
    assert told.attitude_error is not None and told.attitude_error.std_rad < 5e-4
    np.testing.assert_allclose(np.diag(told.covariance), np.diag(found.covariance), rtol=0.3)
    worse = np.full(len(r), 1e-6)
    worse[5] = 0.01  # one that slipped, and it is known
    moved = m.copy()
    moved[5] = (
        ACCELEROMETER_MATRIX @ (r[5].T @ Rotation.from_rotvec([0, 0.01, 0]).as_matrix() @ UP) + ACCELEROMETER_BIAS_M_S2
    )
    slipped = solve(moved, KVH_10_S, "attitude_weighted", r, attitude_std_rad=worse)
    assert np.abs(slipped.bias - ACCELEROMETER_BIAS_M_S2).max() < 0.1 * MG


@pytest.mark.parametrize("method", ["as_published", "maximum_likelihood", "attitude_weighted"])
def test_one_attitude_that_was_moved_by_two_degrees_is_seen(method: Method) -> None:
    r = attitudes_of(JOINTS)
    for place in range(0, 18, 3):
        wrong = r.copy()
        wrong[place] = r[place] @ Rotation.from_rotvec([np.radians(2), 0, 0]).as_matrix()
        if np.linalg.norm(np.cross(wrong[place].T @ UP, r[place].T @ UP)) < 0.01 * NORM**2:
            wrong[place] = r[place] @ Rotation.from_rotvec([0, np.radians(2), 0]).as_matrix()
        m = recorded(independent(0.0), MPU_3_S, place)
        if method == "attitude_weighted":
            with pytest.raises(Fault, match=rf"attitude_untrustworthy: attitude {place + 1} is off by"):
                solve(m, MPU_3_S, method, wrong)
        else:
            assert "times what the variances explain" in solve(m, MPU_3_S, method, wrong).warnings[0]
