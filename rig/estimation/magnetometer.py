"""A magnetometer turned in a constant field, with the iron that turns with it: TRIAX, Eq. (7).

    m_m = F Rᵀ m + b,   F = M C_NO C_SI,   b = M C_NO b_HI + b_O

C_SI and b_HI are the soft and hard iron, C_NO the non-orthogonality, M the scale factors, b_O the sensor's own offset.
(Below Eq. (7) TRIAX writes S C_NO b_HI; the line above it makes that M.) Only the products F and b can be seen from
readings: iron and sensor are not told apart, and need not be, because the correction m = F⁻¹ (m_m − b) takes both out.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array
from rig.estimation.reference_model import KnownNorm
from rig.estimation.triaxial import Method, TriaxialSolution, solve_triaxial

MODEL = "m_m = F Rᵀ m + b"


@dataclass(frozen=True, slots=True)
class MagnetometerSolution:
    """F (3, 3), b (3,) in tesla, and the field in table coordinates (3,) in tesla.

    `hard_iron_t` (3,) = F⁻¹ b: the field that would read as b. `covariance` (15, 15): the rows of F, the field, b.
    `fit` has residuals, rank, condition, warnings.
    """

    matrix: Array
    bias_t: Array
    field_table_t: Array
    hard_iron_t: Array
    covariance: Array
    fit: TriaxialSolution


def solve_magnetometer(
    readings_t: ArrayLike,
    attitudes: ArrayLike,
    variances_t2: ArrayLike,
    *,
    field_t: float,
    side: ArrayLike = (0.0, 0.0, 1.0),
    method: Method = "as_published",
) -> MagnetometerSolution:
    """Calibrate from mean readings (N, 3) with their variances (N, 3) in attitudes R (N, 3, 3), body to table.

    `field_t` is the known size of the field; `side` (3,) a table vector with which it makes less than a right angle
    (down, in the northern hemisphere). Needs 5 attitudes (rank 14). Raises what `solve_triaxial` raises.
    """
    fit = solve_triaxial(readings_t, attitudes, variances_t2, KnownNorm(field_t, side), method=method)
    hard_iron = np.asarray(np.linalg.solve(fit.matrix, fit.bias), dtype=np.float64)
    return MagnetometerSolution(fit.matrix, fit.bias, fit.reference, hard_iron, fit.covariance, fit)


def field(readings_t: ArrayLike, solution: MagnetometerSolution) -> Array:
    """Calibrated readings (…, 3) in tesla, in body coordinates."""
    readings = np.asarray(readings_t, dtype=np.float64)
    return np.asarray((readings - solution.bias_t) @ np.linalg.inv(solution.matrix).T, dtype=np.float64)
