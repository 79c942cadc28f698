"""An accelerometer at rest in known attitudes: Eqs. (10) and (11) of the paper TRIAX.

    a_m = F (s + F̄ s²) + b,   s = −Rᵀ g

s is the specific force, which at rest is the opposite of gravity, R the attitude and F̄ = diag(φ). Eq. (10) writes g
for s. Eq. (11) writes −Rᵀ g in the first-order term; in the second-order term the sign does not matter.
"""

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array

MODEL = "a_m = F (s + φ s²) + b, s = −Rᵀ g"


def specific_force(readings_m_s2: ArrayLike, matrix: Array, bias_m_s2: Array, second_order_s2_m: Array | None) -> Array:
    """Return the specific force s (…, 3) of readings a_m: the root of smaller size of φ s² + s = F⁻¹ (a_m − b)."""
    linear = (np.asarray(readings_m_s2, dtype=np.float64) - bias_m_s2) @ np.linalg.inv(matrix).T
    if second_order_s2_m is None:
        return np.asarray(linear, dtype=np.float64)
    # The usual formula divides by φ, which may be zero; this form of the same root does not.
    return np.asarray(2 * linear / (1 + np.sqrt(1 + 4 * second_order_s2_m * linear)), dtype=np.float64)
