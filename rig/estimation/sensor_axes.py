"""What a gyroscope's matrix F says of its axes: scale factors, the angles between them, how the sensor is mounted.

Row F_i = a_i / k_i, with a_i the unit vector of sensor axis i in the flange frame.
"""

import numpy as np

from rig.estimation.arrays import Array

# The pairs y z, z x, x y; the angle of each is that about the third axis.
FIRST, SECOND = np.array([1, 2, 0]), np.array([2, 0, 1])
PAIR = np.arange(3)


def non_orthogonality(axes: Array) -> Array:
    """(3,) rad by which the angles between y and z, z and x, x and y fall short of 90°, from unit rows (3, 3)."""
    angles: Array = np.arcsin(np.clip((axes @ axes.T)[FIRST, SECOND], -1, 1))
    return angles


def nearest_rotation(axes: Array) -> Array:
    """The rotation (3, 3) nearest to three axes (rows) in the sum of squares: the orthogonal factor of axes = S R."""
    left, _, right = np.linalg.svd(axes)
    rotation: Array = left @ right
    return rotation


def parameter_jacobian(matrix: Array, scale: Array) -> Array:
    """(6, 12) derivative of k and b with respect to F (row by row) and c: δk = −k³ F_i·δF_i, δb = −δc."""
    jacobian = np.zeros((6, 12))
    jacobian[:3, :9].reshape(3, 3, 3)[PAIR, PAIR] = -(scale**3)[:, None] * matrix
    jacobian[3:, 9:] = -np.eye(3)
    return jacobian


def angle_jacobian(axes: Array, scale: Array, rotation: Array) -> Array:
    """(6, 9) derivative of the non-orthogonality and of the mounting's `rotation` with respect to F, row by row.

    δa_i = P_i δF_i with P_i = k_i (1 − a_i a_iᵀ). With A = S R and δR = [δθ]× R: (tr S − S) δθ = the axial vector of
    M − Mᵀ, M = δA Rᵀ.
    """
    project = scale[:, None, None] * (np.eye(3) - axes[:, :, None] * axes[:, None, :])
    against_axes, against_mounting = project @ axes.T, project @ rotation.T  # [i, :, j] = P_i a_j and P_i r_j
    stretch = axes @ rotation.T
    cosines = np.sqrt(1 - (axes @ axes.T)[FIRST, SECOND] ** 2)[:, None]
    sines, axial = np.zeros((3, 3, 3)), np.zeros((3, 3, 3))  # pair, row of F, element
    sines[PAIR, FIRST] = against_axes[FIRST, :, SECOND] / cosines
    sines[PAIR, SECOND] = against_axes[SECOND, :, FIRST] / cosines
    axial[PAIR, SECOND] = against_mounting[SECOND, :, FIRST]
    axial[PAIR, FIRST] = -against_mounting[FIRST, :, SECOND]
    turns = np.linalg.solve(np.trace(stretch) * np.eye(3) - stretch, axial.reshape(3, 9))
    return np.concatenate([sines.reshape(3, 9), turns])
