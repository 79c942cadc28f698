"""The one array type of everything that computes."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def scale_of(matrix: Array) -> Array:
    """Scale factors k (3,) of a sensor that reads F g + o: one over the length of each row of the `matrix` F (3, 3)."""
    scale: Array = 1 / np.linalg.norm(matrix, axis=1)
    return scale
