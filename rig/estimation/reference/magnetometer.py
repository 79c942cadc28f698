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
from rig.estimation.reference.attitude_error import effects, whitening_with
from rig.estimation.reference.reference_model import most_likely, predicted, whitened
from rig.estimation.reference.triaxial import TriaxialSolution
from rig.estimation.refusals import convergence_required
from rig.estimation.statistics.coverage import false_alarm_of_each

MODEL = "m_m = F Rᵀ m + b"
FREE = 14  # F and b, and the field's direction: its size is given
FALSE_ALARM = 1e-3  # in which a steady, uniform field is refused for one of the two


def hard_iron(solution: TriaxialSolution) -> Array:
    """(3,) F⁻¹ b: the field that would read as b."""
    return np.asarray(np.linalg.solve(solution.matrix, solution.bias), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Uniformity:
    """Whether the field was the same in all attitudes: χ² of what the model leaves, and what noise rarely makes it.

    `attitude_error_rad` is how far off the attitudes were taken to be about each axis: what is left may turn the field
    by so much, and may not change its size.
    """

    chi_square: float
    degrees_of_freedom: int
    limit: float
    attitude_error_rad: float

    @property
    def uniform(self) -> bool:
        """Whether the field is uniform, as far as residuals show it."""
        return self.chi_square <= self.limit


def uniformity(
    solution: TriaxialSolution,
    readings_t: ArrayLike,
    attitudes: ArrayLike,
    variances_t2: ArrayLike,
    attitude_error_rad: float,
) -> Uniformity:
    """What the best fit with attitudes off by so much leaves, from the `solution` of these readings.

    Raises Fault `attitude_untrustworthy` where there is none.
    """
    from scipy.special import chdtri

    m, r, v = (np.asarray(a, dtype=np.float64) for a in (readings_t, attitudes, variances_t2))
    v_bar = np.zeros_like(m)
    start = solution.theta
    with convergence_required():
        white = whitening_with(v, effects(start, r, v_bar), np.full(len(m), attitude_error_rad))
        theta, _ = most_likely(start, m, r, v_bar, white, norm_known=True)
    left = whitened(white, m - predicted(theta, r, v_bar))
    freedom = left.size - FREE
    return Uniformity(float(np.sum(left**2)), freedom, float(chdtri(freedom, FALSE_ALARM)), attitude_error_rad)


@dataclass(frozen=True, slots=True)
class FieldDrift:
    """The largest change (3,) of the readings in one attitude, as χ² of its three components says, and its σ (3,).

    `limit` is what that χ² rarely is by noise, however many changes there were to choose from.
    """

    change_t: Array
    std_t: Array
    chi_square: float
    limit: float

    @property
    def steady(self) -> bool:
        """Whether noise explains it."""
        return self.chi_square <= self.limit


def field_drift(means_t: ArrayLike, variances_t2: ArrayLike, repeatability_rad: float) -> FieldDrift:
    """Drift of each reading (N, 3), N ≥ 2, from the first; attitudes repeat to `repeatability_rad` about each axis."""
    from scipy.special import chdtri

    m, v = (np.asarray(a, dtype=np.float64) for a in (means_t, variances_t2))
    changes = m[1:] - m[0]
    stds = np.sqrt(v[1:] + v[0] + 2 * (repeatability_rad * np.linalg.norm(m[0])) ** 2)
    squares = np.sum((changes / stds) ** 2, axis=1)
    worst = int(np.argmax(squares))
    limit = float(chdtri(3, false_alarm_of_each(FALSE_ALARM, len(changes))))
    return FieldDrift(changes[worst], stds[worst], float(squares[worst]), limit)
