"""Rotations of the simulated hand: the product of many small rotations."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def exp_map(vector: Array) -> Array:
    """Return rotations (…, 3, 3) for rotation vectors (…, 3), rad."""
    from scipy.spatial.transform import Rotation

    flat = np.asarray(Rotation.from_rotvec(np.reshape(vector, (-1, 3))).as_matrix(), dtype=np.float64)
    return flat.reshape(*np.shape(vector), 3)


def log_map(matrix: Array) -> Array:
    """Return the rotation vector (3,), rad, of a rotation (3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(matrix).as_rotvec(), dtype=np.float64)


def multiply_steps(steps: Array) -> Array:
    """Return the products 1, exp(φ₁), exp(φ₁) exp(φ₂), … (n + 1, 3, 3) of the rotation vectors φ in `steps` (n, 3).

    They are computed √n rows at a time.
    """
    width = int(np.ceil(np.sqrt(len(steps))))
    padded = np.zeros((width * width, 3))
    padded[: len(steps)] = steps
    products = exp_map(padded).reshape(width, width, 3, 3)
    for column in range(1, width):
        products[:, column] = products[:, column - 1] @ products[:, column]
    for row in range(1, width):
        products[row] = products[row - 1, -1] @ products[row]
    return np.concatenate([np.eye(3)[None], products.reshape(-1, 3, 3)[: len(steps)]])


def align_vectors(start: Array, end: Array) -> Array:
    """Return the rotation (3, 3) from the unit vector `start` to `end` about the axis at right angles to both."""
    axis = np.cross(start, end)
    if (size := float(np.linalg.norm(axis))) < 1e-3:
        if start @ end > 0:
            return exp_map(axis)
        axis = np.cross(start, np.eye(3)[np.argmin(np.abs(start))])
        size = float(np.linalg.norm(axis))
    return exp_map(axis / size * np.arctan2(np.linalg.norm(np.cross(start, end)), start @ end))
