"""A magnetometer turned in a constant field, with iron fixed to the magnetometer: Eq. (7) of the paper TRIAX.

    m_m = F Rᵀ m + b,   F = M C_NO C_SI,   b = M C_NO b_HI + b_O

m is the field, C_SI and b_HI are the soft and hard iron, C_NO the non-orthogonality, M the scale factors, b_O the
sensor's own offset. (Below Eq. (7) the paper writes S for M.) Only the products F and b are identifiable, so the
correction m = F⁻¹ (m_m − b) removes the effects of iron and sensor together.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array
from rig.estimation.reference.attitude_error import effects, find_whiteners
from rig.estimation.reference.reference_model import most_likely, predicted, whitened
from rig.estimation.reference.triaxial import TriaxialSolution
from rig.estimation.refusals import convergence_required
from rig.estimation.statistics.coverage import false_alarm_of_each

MODEL = "m_m = F Rᵀ m + b"
PARAMETERS = 14  # F, b, and the field's direction, as its size is given
FALSE_ALARM_PROBABILITY = 1e-3  # of one of the two tests, for a steady, uniform field


def hard_iron(solution: TriaxialSolution) -> Array:
    """Return the field (3,) that changes the readings by as much as the bias of the `solution`."""
    return np.asarray(np.linalg.solve(solution.matrix, solution.bias), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Uniformity:
    """The test of a uniform field: χ² of the residuals in all attitudes and its critical value.

    `attitude_error_rad` is the assumed attitude error about each axis. The test allows the field to seem rotated by so
    much, but not to change its norm.
    """

    chi_square: float
    degrees_of_freedom: int
    limit: float
    attitude_error_rad: float

    @property
    def uniform(self) -> bool:
        """True if the residuals agree with a uniform field."""
        return self.chi_square <= self.limit


def uniformity(
    solution: TriaxialSolution,
    readings_t: ArrayLike,
    attitudes: ArrayLike,
    variances_t2: ArrayLike,
    attitude_error_rad: float,
) -> Uniformity:
    """Return the test that the field is uniform: χ² of a fit of the readings that assumes the given error of attitudes.

    `solution` fits the `readings_t` with `variances_t2` (N, 3) in `attitudes` (N, 3, 3). Raise Fault
    `attitude_untrustworthy` if no fit exists.
    """
    from scipy.special import chdtri

    m, r, v = (np.asarray(a, dtype=np.float64) for a in (readings_t, attitudes, variances_t2))
    v_bar = np.zeros_like(m)
    start = solution.theta
    with convergence_required():
        whiteners = find_whiteners(v, effects(start, r, v_bar), np.full(len(m), attitude_error_rad))
        theta, _ = most_likely(start, m, r, v_bar, whiteners, norm_known=True)
    whitened_residuals = whitened(whiteners, m - predicted(theta, r, v_bar))
    dof = whitened_residuals.size - PARAMETERS
    return Uniformity(
        float(np.sum(whitened_residuals**2)), dof, float(chdtri(dof, FALSE_ALARM_PROBABILITY)), attitude_error_rad
    )


@dataclass(frozen=True, slots=True)
class FieldDrift:
    """The most significant change (3,) of the readings in one attitude, and its std (3,).

    `limit` is the critical value of `chi_square`, with a Bonferroni correction for the number of changes.
    """

    change_t: Array
    std_t: Array
    chi_square: float
    limit: float

    @property
    def steady(self) -> bool:
        """True if noise explains the change of the readings."""
        return self.chi_square <= self.limit


def field_drift(means_t: ArrayLike, variances_t2: ArrayLike, repeatability_rad: float) -> FieldDrift:
    """Return the most significant change from the first to a later one of mean readings (N, 3) in one attitude, N ≥ 2.

    `variances_t2` (N, 3) are those of the means. The attitude repeats with a standard deviation of `repeatability_rad`
    about each axis.
    """
    from scipy.special import chdtri

    m, v = (np.asarray(a, dtype=np.float64) for a in (means_t, variances_t2))
    changes = m[1:] - m[0]
    stds = np.sqrt(v[1:] + v[0] + 2 * (repeatability_rad * np.linalg.norm(m[0])) ** 2)
    squares = np.sum((changes / stds) ** 2, axis=1)
    worst = int(np.argmax(squares))
    limit = float(chdtri(3, false_alarm_of_each(FALSE_ALARM_PROBABILITY, len(changes))))
    return FieldDrift(changes[worst], stds[worst], float(squares[worst]), limit)
