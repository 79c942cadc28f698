"""Rotation vectors of stacks of rotations, from the smallest angle to half a turn."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.estimation.arrays import rotation_vectors


@pytest.mark.parametrize("angle_rad", [0.0, 1e-12, 1e-7, 1e-3, 1.0, 3.0, np.pi - 1e-7])
def test_rotation_vectors_are_those_of_scipy(angle_rad: float) -> None:
    vectors = np.random.default_rng(0).normal(size=(5, 10, 3))
    vectors *= angle_rad / np.linalg.norm(vectors, axis=-1, keepdims=True)
    matrices = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(5, 10, 3, 3)
    np.testing.assert_allclose(rotation_vectors(matrices), vectors, rtol=0, atol=2e-15)


def test_a_half_turn_has_a_rotation_vector_of_pi() -> None:
    assert rotation_vectors(np.diag([1.0, -1.0, -1.0])) == pytest.approx([np.pi, 0, 0])
