"""What sound readings of a magnetometer contradict no more often than is meant."""

import numpy as np
import pytest
from scipy.stats import kstest

from rig.analysis.consistency.reference_alternatives import ReferenceModel
from rig.analysis.reference.arm_patterns import Posture, StatedArm, arm_patterns
from rig.analysis.reference.reference_budgets import UNTESTED_DRIFT_T, drift_patterns
from rig.config.procedures.attitude_sets import MAGNETIC_ATTITUDES
from rig.estimation.reference.accelerometer_model import LEVER, NO_SWEEPS, PARAMETERS, Dwells, Movement
from rig.estimation.reference.reference_model import KnownNorm
from rig.estimation.reference.triaxial import solve_triaxial
from rig.motion.geometry import NOMINAL, flange_pose
from support.motions.arm_attitudes import draw_true_arm, joints_rad
from support.recordings.reference_p_values import p_values

pytestmark = pytest.mark.slow

JOINTS = joints_rad(MAGNETIC_ATTITUDES)
FIELD_T = np.array([17.0, -4.0, -44.7]) * 1e-6  # in the base's axes
NOISE_T = 0.32e-6 / np.sqrt(80 * 3.0)  # of a dwell of three seconds
ARM_RAD = 1e-4


def read_of(seed: int) -> ReferenceModel:
    """Of a field that drifts as it may where it is not tested, on an arm that is good to so much."""
    rng = np.random.default_rng([seed, 11])
    arm, told = draw_true_arm(ARM_RAD, rng), flange_pose(JOINTS)[:, :3, :3]
    change_t = UNTESTED_DRIFT_T * rng.uniform(-1, 1, 3)
    fields_t = FIELD_T + np.linspace(-0.5, 0.5, len(JOINTS))[:, None] * change_t
    matrix = np.diag(1 + 0.03 * rng.normal(size=3)) @ (np.eye(3) + 0.01 * rng.normal(size=(3, 3)))
    felt = np.einsum("nji,nj->ni", arm(JOINTS)[:, :3, :3], fields_t)
    means = felt @ matrix.T + 3e-5 * rng.normal(size=3) + NOISE_T * rng.normal(size=felt.shape)
    variances = np.full_like(means, NOISE_T**2)
    known = KnownNorm(float(np.linalg.norm(FIELD_T)), (0.0, 0.0, -1.0))
    found = solve_triaxial(means, told, variances, known, method="attitude_weighted")
    theta = np.zeros(PARAMETERS)
    theta[: LEVER.start] = found.theta
    movement = Movement(Dwells(means, variances, told), NO_SWEEPS)
    arm_known = StatedArm(NOMINAL, float(np.degrees(np.sqrt(3) * ARM_RAD)), np.eye(3), found.attitude_std_rad)
    drift, _ = drift_patterns(found.matrix, told, None)
    of_arm = arm_patterns(theta, movement, [Posture(joint) for joint in JOINTS], arm_known)
    times_s = np.linspace(0.0, 5.0 * len(JOINTS), len(JOINTS))
    return ReferenceModel(theta, movement, np.concatenate([drift / np.sqrt(3), of_arm]), times_s, second_order=False)


@pytest.mark.thorough
@pytest.mark.proof
@pytest.mark.timeout(3600)
def test_p_values_of_a_magnetometer_are_no_smaller_than_uniform_ones(thorough: bool) -> None:
    """Kolmogorov and Smirnov do not refuse it at 1 %, of each check."""
    found: dict[str, list[float]] = {}
    for seed in range(200 if thorough else 2):
        for name, rate in p_values(read_of(seed)).items():
            found.setdefault(name, []).append(rate)
    chances = {name: kstest(each, "uniform", alternative="greater").pvalue for name, each in found.items()}
    print({name: (f"{chance:.3f}", f"least {min(found[name]):.4f}") for name, chance in chances.items()})
    assert {"bias_changed", "scale_changed", "loose_mounting", "asymmetry", "residuals"} <= chances.keys()
    assert all(chance > 0.01 for chance in chances.values())
