"""How a gyroscope's triad and an accelerometer's are turned against each other."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.errors import Fault
from rig.estimation.triads import align_triads

TURN_RAD = np.array([0.004, -0.007, 0.012])
MOUNTING = Rotation.from_rotvec([0.02, 0.5, -0.03])
NOTHING = np.zeros((9, 9))


def test_two_triads_at_right_angles_are_told_by_the_turn_between_them() -> None:
    gyroscope = np.diag([0.98, 1.01, 1.03]) @ MOUNTING.as_matrix()
    accelerometer = np.diag([1.02, 0.99, 1.0]) @ (Rotation.from_rotvec(TURN_RAD) * MOUNTING).as_matrix()
    found = align_triads(gyroscope, accelerometer, NOTHING, NOTHING)
    np.testing.assert_allclose(found.vector_rad, TURN_RAD, atol=1e-12)
    np.testing.assert_allclose(found.rotation @ found.rotation.T, np.eye(3), atol=1e-12)


@pytest.mark.slow
@pytest.mark.proof
def test_the_covariance_is_the_scatter_of_the_turns(thorough: bool) -> None:
    count, tolerance = (2000, 0.1) if thorough else (500, 0.2)
    rng = np.random.default_rng(1)
    skew = np.eye(3) + 0.02 * rng.normal(size=(3, 3))
    gyroscope = skew @ MOUNTING.as_matrix()
    accelerometer = (Rotation.from_rotvec(20 * TURN_RAD) * MOUNTING).as_matrix()
    stds = 1e-4 * rng.uniform(1, 5, size=(2, 9))
    told = align_triads(gyroscope, accelerometer, *(np.diag(std**2) for std in stds))
    turns = []
    for _ in range(count):
        moved = stds * rng.normal(size=(2, 9))
        drawn = align_triads(
            gyroscope + moved[0].reshape(3, 3), accelerometer + moved[1].reshape(3, 3), NOTHING, NOTHING
        )
        turns.append(Rotation.from_matrix(drawn.rotation @ told.rotation.T).as_rotvec())
    np.testing.assert_allclose(
        np.cov(np.transpose(turns)), told.covariance_rad2, atol=tolerance * told.covariance_rad2.max()
    )


def test_a_mirrored_triad_has_no_turn() -> None:
    with pytest.raises(Fault, match="mirrored_axis"):
        align_triads(np.eye(3), np.diag([1.0, 1.0, -1.0]), NOTHING, NOTHING)
