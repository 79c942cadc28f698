"""Accelerometers in attitudes whose errors are a smooth function of the attitude, as of a robot's joint zeros."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.analysis.external.attitude_equations import Equations
from rig.estimation.arrays import Array
from rig.estimation.external.placement import laid_down
from rig.estimation.reference.reference_model import BIAS, F, KnownNorm

pytestmark = pytest.mark.slow

GRAVITY_M_S2 = 9.81
NO_RESTS = np.zeros((0, 3))


def draw_session(rng: np.random.Generator) -> tuple[Equations, Array, Array]:
    """Return equations whose attitudes have errors linear in the attitudes' matrices, and the true F and bias."""
    count, noise_m_s2, error_rad = int(rng.integers(10, 30)), 10 ** rng.uniform(-3.5, -2), 10 ** rng.uniform(-3.5, -3.0)
    steps = Rotation.from_rotvec(rng.normal(0, 0.5, (count, 3)))
    path = [Rotation.random(random_state=rng)]
    for step in steps[1:]:
        path.append(step * path[-1])
    attitudes = Rotation.concatenate(path)
    errors = attitudes.as_matrix().reshape(count, 9) @ rng.normal(0, error_rad, (9, 3))
    forces = (Rotation.from_rotvec(errors) * attitudes).inv().apply([0, 0, GRAVITY_M_S2])
    matrix, bias = np.diag(rng.uniform(0.97, 1.03, 3)) + rng.normal(0, 0.01, (3, 3)), rng.uniform(-0.3, 0.3, 3)
    readings = forces @ matrix.T + bias + rng.normal(0, noise_m_s2, (count, 3))
    variances, dof = np.full((count, 3), noise_m_s2**2), np.full((count, 3), 100.0)
    reference = KnownNorm(GRAVITY_M_S2, np.array([0, 0, 1.0]))
    return Equations(readings, variances, attitudes.as_matrix(), None, reference, dof), matrix, bias


@pytest.mark.proof
@pytest.mark.timeout(1800)
def test_u_holds_if_attitudes_err_alike(thorough: bool) -> None:
    rng = np.random.default_rng(8)
    scales: list[Array] = []
    biases: list[Array] = []
    for _ in range(200 if thorough else 15):
        equations, matrix, bias = draw_session(rng)
        laid = laid_down(equations.solve("attitude_weighted").theta, equations.placed, NO_RESTS, NO_RESTS)
        u = np.sqrt(np.diag(laid.covariance))
        lengths = np.linalg.norm(laid.theta[F].reshape(3, 3), axis=1) - np.linalg.norm(matrix, axis=1)
        scales.append(lengths / u[[0, 4, 8]])
        biases.append((laid.theta[BIAS] - bias) / u[BIAS])
    for name, errors in (("scale", np.array(scales)), ("bias", np.array(biases))):
        rms, within = float(np.sqrt(np.mean(errors**2))), float(np.mean(np.abs(errors) < 2))
        print(f"{name}: RMS of error / u {rms:.2f}, {100 * within:.1f} % within U")
        assert (0.8 if thorough else 0.6) < rms < (1.2 if thorough else 1.4)
        assert within > (0.92 if thorough else 0.86)
