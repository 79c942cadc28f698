"""The axes in a gyroscope's matrix F: scale factors, the angles between axes, the sensor's mounting.

Row i of F is a_i / k_i, with the unit vector a_i of sensor axis i in the flange frame and its scale factor k_i.
"""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array, scale_of

# The pairs y z, z x, x y; the angle of each is that about the third axis.
FIRST_AXES, SECOND_AXES = np.array([1, 2, 0]), np.array([2, 0, 1])
PAIR_INDICES = np.arange(3)
# The other axis of pair p for axis i, as [p, i]; whether i is the second (1), the first (−1), or not in the pair (0).
OTHER_AXIS = -(PAIR_INDICES[:, None] + PAIR_INDICES) % 3
IDENTITY = np.eye(3)
AXIS_ORDER = np.roll(IDENTITY, -1, axis=1) - np.roll(IDENTITY, 1, axis=1)
IN_PAIR = np.abs(AXIS_ORDER)


@dataclass(frozen=True, slots=True)
class SensorAxes:
    """The axes of a sensor: `scale` (3,), unit vectors as rows of `axes` (3, 3), `mounting` (the nearest rotation)."""

    scale: Array
    axes: Array
    mounting: Array

    @staticmethod
    def from_matrix(matrix: Array) -> "SensorAxes":
        """Return the axes in a sensor's `matrix` (3, 3), each row of which is a unit vector over a scale factor."""
        scale = scale_of(matrix)
        axes = scale[:, None] * matrix
        return SensorAxes(scale, axes, nearest_rotation(axes))

    @property
    def non_orthogonality_rad(self) -> Array:
        """The non-orthogonality (3,) of the axes, rad."""
        return non_orthogonality(self.axes)

    @property
    def to_angles(self) -> Array:
        """The derivative (6, 9) of non-orthogonality, then mounting, with respect to the matrix, row by row."""
        return angle_jacobian(self.axes, self.scale, self.mounting)

    @property
    def correction_matrix(self) -> Array:
        """The matrix (3, 3) that maps offset-corrected readings to the right-angled frame nearest to the axes."""
        matrix: Array = self.mounting @ np.linalg.inv(self.axes / self.scale[:, None])
        return matrix

    def angles_covariance_rad2(self, of_matrix: Array) -> Array:
        """Return the covariance (6, 6) of non-orthogonality and mounting, from `of_matrix` (9, 9), F's, row by row."""
        to_angles = self.to_angles
        covariance: Array = to_angles @ of_matrix @ to_angles.T
        return covariance

    def non_orthogonality_std_rad(self, of_matrix: Array) -> Array:
        """Return the standard deviations (3,) of the non-orthogonality, from the covariance (9, 9) of the matrix."""
        std: Array = np.sqrt(np.diag(self.angles_covariance_rad2(of_matrix)))[:3]
        return std


def non_orthogonality(axes: Array) -> Array:
    """Return the non-orthogonality (3,), rad: 90° minus the angles y z, z x, x y between unit rows (3, 3)."""
    angles: Array = np.arcsin(np.clip((axes @ axes.T)[FIRST_AXES, SECOND_AXES], -1, 1))
    return angles


def nearest_rotation(axes: Array) -> Array:
    """Return the rotation (3, 3) nearest to three axes (rows): the factor R of the polar decomposition S R."""
    first, _, second = np.linalg.svd(axes)
    rotation: Array = first @ second
    return rotation


def parameter_jacobian(matrix: Array, scale: Array) -> Array:
    """Return the derivative (6, 12) of scale and bias with respect to the elements of F, row by row, and the offset.

    The bias is minus the offset. The scale factor k = 1/‖F_i‖ of axis i changes by δk = −k³ F_i·δF_i.
    """
    jacobian = np.zeros((6, 12))
    jacobian[:3, :9].reshape(3, 3, 3)[PAIR_INDICES, PAIR_INDICES] = -(scale**3)[:, None] * matrix
    jacobian[3:, 9:] = -IDENTITY
    return jacobian


def angle_jacobian(axes: Array, scale: Array, rotation: Array) -> Array:
    """Return the derivative (6, 9) of three non-orthogonalities and of the mounting with respect to F, row by row.

    A row a_i of the axes A changes by δa_i = k_i (I − a_i a_iᵀ) δF_i. The mounting is the factor R of A = S R. It
    changes by a small rotation δθ, so that δR = [δθ]× R, and (I tr S − S) δθ is the axial vector of M − Mᵀ with
    M = δA Rᵀ.
    """
    project = scale[:, None, None] * (IDENTITY - axes[:, :, None] * axes[:, None, :])
    stretch = axes @ rotation.T
    cosines = np.sqrt(1 - (axes @ axes.T)[FIRST_AXES, SECOND_AXES] ** 2)
    # P_i a_j, and below P_i r_j with the rows r_j of R, for the two axes of each pair: pair, row of F, element
    angles = (axes @ project)[PAIR_INDICES, OTHER_AXIS] * (IN_PAIR / cosines[:, None])[..., None]
    axial = (rotation @ project)[PAIR_INDICES, OTHER_AXIS] * AXIS_ORDER[..., None]
    turns = np.linalg.solve(stretch.trace() * IDENTITY - stretch, axial.reshape(3, 9))
    return np.concatenate([angles.reshape(3, 9), turns])
