"""Errors that observations have in common: drawn again and again, the stated covariance holds."""

import numpy as np
import pytest

from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.common_errors import CommonErrorModel
from rig.estimation.gyroscope.vector_model import solve_vector_model
from rig.estimation.sensor_axes import non_orthogonality
from rig.motion.geometry import axis_errors
from rig.motion.steps import Sweep
from rig.plans.motions.six_sweeps import plan_six_observation

AXIS_STD_RAD = 1e-3
MATRIX = np.array([[0.85, 0.04, -0.03], [-0.05, 0.87, 0.02], [0.02, -0.03, 0.88]])
BIAS = np.array([0.0077, -0.0100, -0.0051])
DRAWS, FEW = 200, 60  # in `make proof`, and in `make test` with wider limits


def movement(axes: int) -> tuple[Array, Array]:
    """Rates (N, 3) of sweeps and of as many rests, and by how much the arm's errors change them (P, N, 3)."""
    arm = ArmSection(host="127.0.0.2", payload_kg=0.35)
    sweeps = plan_six_observation(arm, SixObservationSection.model_validate({"axes": axes})).sweeps
    rates = np.array([sweep.speed_rad_s * np.array(sweep.axis_flange) for sweep in sweeps])
    off = np.array([_sign(sweep) * sweep.speed_rad_s * axis_errors(sweep.start_q_rad, sweep.joint) for sweep in sweeps])
    still = np.zeros_like(rates)
    return np.concatenate([rates, still]), AXIS_STD_RAD * np.swapaxes(np.concatenate([off, np.zeros_like(off)]), 0, 1)


def _sign(sweep: Sweep) -> int:
    return 1 if sweep.direction == "ccw" else -1


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.parametrize(("axes", "most_deg"), [(3, 0.12), (6, 0.01)])
def test_the_angles_stated_uncertainty_holds_the_arms_errors(axes: int, most_deg: float, thorough: bool) -> None:
    rates, off = movement(axes)
    rng = np.random.default_rng(axes)
    variances = np.full(rates.shape, 7e-5**2)  # an MPU-9250 over six seconds
    none, unit = np.zeros(len(rates)), MATRIX / np.linalg.norm(MATRIX, axis=1, keepdims=True)
    drawn = []
    stated = []
    for _ in range(DRAWS if thorough else FEW):
        true = rates + np.einsum("p,pni->ni", rng.standard_normal(len(off)), off)
        means = true @ MATRIX.T - BIAS + np.sqrt(variances) * rng.standard_normal(rates.shape)
        found, _ = CommonErrorModel(means, rates, variances, lambda f: off @ f.T, none).solve()
        drawn.append(found.non_orthogonality_rad - non_orthogonality(unit))
        stated.append(np.sqrt(np.diag(found.angles_covariance_rad2))[:3])
    assert np.degrees(np.max(stated)) < most_deg
    ratio = np.sqrt(np.mean(np.square(drawn), axis=0)) / np.mean(stated, axis=0)
    most = 0.15 if thorough else 0.3
    assert np.all((ratio > 1 - most) & (ratio < 1 + most)), ratio


def test_what_the_observations_do_not_tell_leaves_the_solution_as_it_is() -> None:
    rates, off = movement(3)
    rng = np.random.default_rng(1)
    variances = np.full(rates.shape, 1e-8)
    means = rates @ MATRIX.T - BIAS + 1e-4 * rng.standard_normal(rates.shape)
    plain = solve_vector_model(means, rates, variances)
    found, errors = CommonErrorModel(means, rates, variances, lambda f: off @ f.T, np.zeros(len(rates))).solve()
    np.testing.assert_allclose(errors.sizes, 0.0, atol=1e-6)
    for name in ("scale", "bias_rad_s", "matrix", "covariance", "response"):
        np.testing.assert_allclose(getattr(found, name), getattr(plain, name), rtol=1e-6, atol=1e-12)
