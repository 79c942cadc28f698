"""The one array type of everything that computes."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
SMALLEST_SIZE = 1e-200  # an uncertainty below it is none: nothing measured is so sure, and to divide by it overflows


def scale_of(matrix: Array) -> Array:
    """Scale factors k (3,) of a sensor that reads F g + o: one over the length of each row of the `matrix` F (3, 3)."""
    scale: Array = 1 / np.linalg.norm(matrix, axis=1)
    return scale


def across(axis: Array) -> Array:
    """(2, 3) unit vectors at right angles to a unit vector (3,) and to each other."""
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first = first / np.linalg.norm(first)
    return np.array([first, np.cross(axis, first)])


def rotation_vectors(matrices: Array) -> Array:
    """(…, 3) rad of rotations (…, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(matrices).as_rotvec(), dtype=np.float64)


def in_units_of(values: ArrayLike, sizes: ArrayLike) -> Array:
    """Values over sizes ≥ 0, of any one shape; infinite where a value is not zero and its size as good as none."""
    value, size = np.asarray(values, dtype=np.float64), np.asarray(sizes, dtype=np.float64)
    none = np.where(value == 0, 0.0, np.copysign(np.inf, value))
    found: Array = np.divide(value, size, out=none, where=size > SMALLEST_SIZE)
    return found
