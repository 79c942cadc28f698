"""An accelerometer at rest in known attitudes: TRIAX, Eqs. (10) and (11).

    a_m = F (s + F̄ s²) + b,   s = −Rᵀ g

s is the specific force, what an accelerometer feels: at rest the opposite of gravity. Eq. (10) writes g for it and
Eq. (11) −Rᵀ g in the first-order term; in the second-order term the sign does not matter. F̄ = diag(φ).
"""

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array
from rig.estimation.reference_model import KnownNorm
from rig.estimation.triaxial import Method, TriaxialSolution, solve_triaxial

MODEL = "a_m = F (s + φ s²) + b, s = −Rᵀ g"


def solve_accelerometer(
    readings_m_s2: ArrayLike,
    attitudes: ArrayLike,
    variances_m2_s4: ArrayLike,
    *,
    gravity_m_s2: float,
    down: ArrayLike = (0.0, 0.0, 1.0),
    second_order: bool = False,
    method: Method = "as_published",
    attitude_std_rad: ArrayLike | None = None,
) -> TriaxialSolution:
    """Calibrate from mean readings (N, 3) with their variances (N, 3) in attitudes R (N, 3, 3), body to table.

    `gravity_m_s2` is the known size of g; `down` (3,) says to which side of the table it points, roughly: +z for the
    north-east-down frame of TRIAX, −z for the base frame of a robot on a floor. First order needs 5 attitudes, second
    order 6 (rank 14 and 17). `attitude_std_rad` (N,) as in `solve_triaxial`. Raises what `solve_triaxial` raises.
    The solution's reference is what is felt at rest, the opposite of gravity.
    """
    return solve_triaxial(
        readings_m_s2,
        attitudes,
        variances_m2_s4,
        KnownNorm(gravity_m_s2, -np.asarray(down, dtype=np.float64)),
        second_order=second_order,
        method=method,
        attitude_std_rad=attitude_std_rad,
    )


def specific_force(readings_m_s2: ArrayLike, matrix: Array, bias_m_s2: Array, second_order_s2_m: Array | None) -> Array:
    """Calibrated readings s (…, 3), m/s²: the smaller root of φ s² + s = F⁻¹ (a_m − b); φ (3,) may be None."""
    linear = (np.asarray(readings_m_s2, dtype=np.float64) - bias_m_s2) @ np.linalg.inv(matrix).T
    if second_order_s2_m is None:
        return np.asarray(linear, dtype=np.float64)
    # The usual formula divides by φ, which may be zero; this one is the same root.
    return np.asarray(2 * linear / (1 + np.sqrt(1 + 4 * second_order_s2_m * linear)), dtype=np.float64)
