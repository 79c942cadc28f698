"""An accelerometer at rest in known attitudes: TRIAX, Eqs. (10) and (11).

    a_m = F (s + F̄ s²) + b,   s = −Rᵀ g

s is the specific force, what an accelerometer feels: at rest the opposite of gravity. Eq. (10) writes g for it and
Eq. (11) −Rᵀ g in the first-order term; in the second-order term the sign does not matter. F̄ = diag(φ).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array
from rig.estimation.reference_model import KnownNorm
from rig.estimation.triaxial import Method, TriaxialSolution, solve_triaxial

MODEL = "a_m = F (s + φ s²) + b, s = −Rᵀ g"


@dataclass(frozen=True, slots=True)
class AccelerometerSolution:
    """F (3, 3), b (3,) in m/s², φ (3,) in 1/(m/s²) or None, and gravity in table coordinates (3,) in m/s².

    `covariance` (15, 15) or (18, 18): the rows of F, gravity, b, φ. `fit` has residuals, rank, condition, warnings.
    """

    matrix: Array
    bias_m_s2: Array
    gravity_table_m_s2: Array
    second_order_s2_m: Array | None
    covariance: Array
    fit: TriaxialSolution


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
) -> AccelerometerSolution:
    """Calibrate from mean readings (N, 3) with their variances (N, 3) in attitudes R (N, 3, 3), body to table.

    `gravity_m_s2` is the known size of g; `down` (3,) says to which side of the table it points, roughly: +z for the
    north-east-down frame of TRIAX, −z for the base frame of a robot on a floor. First order needs 5 attitudes, second
    order 6 (rank 14 and 17). `attitude_std_rad` (N,) as in `solve_triaxial`. Raises what `solve_triaxial` raises.
    """
    fit = solve_triaxial(
        readings_m_s2,
        attitudes,
        variances_m2_s4,
        KnownNorm(gravity_m_s2, -np.asarray(down, dtype=np.float64)),
        second_order=second_order,
        method=method,
        attitude_std_rad=attitude_std_rad,
    )
    sign = np.ones(len(fit.covariance))
    sign[9:12] = -1.0
    return AccelerometerSolution(
        fit.matrix, fit.bias, -fit.reference, fit.second_order, fit.covariance * np.outer(sign, sign), fit
    )


class Calibrated(Protocol):
    """F (3, 3), b (3,) in m/s², φ (3,) in 1/(m/s²) or None."""

    @property
    def matrix(self) -> Array: ...
    @property
    def bias_m_s2(self) -> Array: ...
    @property
    def second_order_s2_m(self) -> Array | None: ...


def specific_force(readings_m_s2: ArrayLike, solution: Calibrated) -> Array:
    """Calibrated readings s (…, 3), m/s²: the smaller root of φ s² + s = F⁻¹ (a_m − b)."""
    linear = (np.asarray(readings_m_s2, dtype=np.float64) - solution.bias_m_s2) @ np.linalg.inv(solution.matrix).T
    if solution.second_order_s2_m is None:
        return np.asarray(linear, dtype=np.float64)
    # The usual formula divides by φ, which may be zero; this one is the same root.
    return np.asarray(2 * linear / (1 + np.sqrt(1 + 4 * solution.second_order_s2_m * linear)), dtype=np.float64)
