"""Rotations of the simulated hand: what a course of small turns adds up to."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rotation_from_rotvec(vector: Array) -> Array:
    """(…, 3, 3) rotations by vectors (…, 3), rad."""
    from scipy.spatial.transform import Rotation

    flat = np.asarray(Rotation.from_rotvec(np.reshape(vector, (-1, 3))).as_matrix(), dtype=np.float64)
    return flat.reshape(*np.shape(vector), 3)


def rotvec_from_rotation(matrix: Array) -> Array:
    """(3,) rad of a rotation (3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(matrix).as_rotvec(), dtype=np.float64)


def accumulate_rotations(steps: Array) -> Array:
    """(n + 1, 3, 3): 1, exp(φ₁), exp(φ₁) exp(φ₂), … of steps (n, 3); in rows of √n, all rows at once."""
    width = int(np.ceil(np.sqrt(len(steps))))
    padded = np.zeros((width * width, 3))
    padded[: len(steps)] = steps
    products = rotation_from_rotvec(padded).reshape(width, width, 3, 3)
    for column in range(1, width):
        products[:, column] = products[:, column - 1] @ products[:, column]
    for row in range(1, width):
        products[row] = products[row - 1, -1] @ products[row]
    return np.concatenate([np.eye(3)[None], products.reshape(-1, 3, 3)[: len(steps)]])


def find_shortest_rotation(start: Array, end: Array) -> Array:
    """The rotation (3, 3) that takes the unit vector `start` to `end`, about the axis at right angles to both."""
    axis = np.cross(start, end)
    if (size := float(np.linalg.norm(axis))) < 1e-3:
        if start @ end > 0:
            return rotation_from_rotvec(axis)
        axis = np.cross(start, np.eye(3)[np.argmin(np.abs(start))])
        size = float(np.linalg.norm(axis))
    return rotation_from_rotvec(axis / size * np.arctan2(np.linalg.norm(np.cross(start, end)), start @ end))
