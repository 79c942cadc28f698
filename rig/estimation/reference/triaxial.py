"""Tri-axial calibration of the paper TRIAX: F, bias and the reference vector from readings in known attitudes.

    v_m = F (Rᵀ v_ref + v̄) + b                                                             TRIAX, Eqs. (3), (9)

R takes body coordinates to table coordinates; v_ref, in table coordinates, is found as well. v̄ is what the table
itself adds: its rate for a gyroscope (v_ref is then the Earth's rate), nothing for an accelerometer or a magnetometer.
With v̄ = 0 the factor between F and v_ref is unknown, so ‖v_ref‖ and the side it points to must be given.

Three methods: "as_published" solves the stacked equations (`rig.estimation.reference.stacked`). The readings stand in
X, so their noise σ shrinks F⁻¹ by about (σ/v_rms)², however many readings there are; beside a standard deviation that
falls with √N this shows once √N σ/v_rms nears one. Averages of minutes stay far below it, single samples at slow rates
do not. "maximum_likelihood" goes on from there to the weighted least squares in the readings themselves
(`rig.estimation.reference.reference_model`): no such bias, no scaling of columns, and the most made of unequal noise.
"attitude_weighted" allows for attitudes that are not exactly known, as those of an arm
(`rig.estimation.reference.attitude_error`), and says how far off they are.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation import refusals
from rig.estimation.arrays import Array, scale_of
from rig.estimation.reference.attitude_error import (
    AttitudeError,
    AttitudeWeighted,
    Placed,
    furthest_off,
    solve_attitude_weighted,
)
from rig.estimation.reference.reference_model import (
    BIAS,
    REFERENCE,
    F,
    Known,
    KnownNorm,
    KnownVector,
    covariance_bound,
    most_likely,
    predicted,
    sensed,
    whitened,
    whitening,
)
from rig.estimation.reference.stacked import column_sizes, published_covariance, published_estimate, stack

EqualWeights = Literal["as_published", "maximum_likelihood"]
Method = EqualWeights | Literal["attitude_weighted"]

MAX_CONDITION = 1e4
NOTICEABLE = 0.5  # √N σ/v_rms
UNTRUSTWORTHY_RAD = 5e-3  # attitudes that are further off, and the reference's model is at fault rather than they
SUSPICIOUS_RAD = 5e-4  # whether one of the attitudes alone is to blame
ODD = 6.0  # times as far off as the others are
REMEDY = "Take more attitudes, turned about at least two different axes"


@dataclass(frozen=True, slots=True)
class TriaxialSolution:
    """What a tri-axial sensor's readings say, in the unit of the readings.

    - `matrix` F (3, 3), `bias` b (3,), `reference` v_ref (3,) in table coordinates.
    - `second_order` φ (3,), the diagonal of F̄ in 1/unit, or None.
    - `covariance` (15, 15) or (18, 18): the rows of F, v_ref, b, φ.
    - `residuals` (N, 3): reading less model. `rank` and `condition` are those of the scaled X; full is 15 (18), one
      less where ‖v_ref‖ is given. `iterations` counts linear solutions or Gauss–Newton steps.
    - `attitude_error` by the method "attitude_weighted", else None.
    """

    method: Method
    matrix: Array
    bias: Array
    reference: Array
    second_order: Array | None
    covariance: Array
    residuals: Array
    observations: int
    rank: int
    condition: float
    iterations: int
    warnings: tuple[str, ...]
    attitude_error: AttitudeError | None = None

    @property
    def theta(self) -> Array:
        """All that was found, (15,) or (18,), in the covariance's order."""
        second_order = () if self.second_order is None else self.second_order
        return np.concatenate([np.ravel(self.matrix), self.reference, self.bias, second_order])

    @property
    def attitude_std_rad(self) -> float:
        """How far the attitudes were found to be off about each axis; zero by a method that holds them."""
        return 0.0 if self.attitude_error is None else self.attitude_error.std_rad


def solve_triaxial(
    readings: ArrayLike,
    attitudes: ArrayLike,
    variances: ArrayLike,
    known: Known,
    *,
    second_order: bool = False,
    method: Method = "as_published",
    attitude_std_rad: ArrayLike | None = None,
) -> TriaxialSolution:
    """Solve for F, v_ref and b, and φ with `second_order`.

    `readings`, `variances` (N, 3): mean readings and the variances of these means; `attitudes` (N, 3, 3): R, body to
    table; `known`: v̄ as a `KnownVector`, or what is known of v_ref where v̄ = 0 as a `KnownNorm`; `attitude_std_rad`
    (N,): how well each attitude is said to be known, for the method "attitude_weighted".

    Raises Fault `too_few_observations`, `not_finite`, `bad_variance`, `zero_reading`, `duplicated_observation`,
    `bad_attitude`, `rank_deficient`, `ill_conditioned`, `sign_unknown`, `wrong_unit`, `mirrored_axis`,
    `attitude_untrustworthy`; ValueError for a wrong shape.
    """
    m, r, v = (np.asarray(a, dtype=np.float64) for a in (readings, attitudes, variances))
    v_bar, norm_known = known.v_bar(len(m)), isinstance(known, KnownNorm)
    parameters = 18 if second_order else 15
    needed = parameters - norm_known
    _check(m, r, v, known, parameters)

    with refusals.convergence_required():
        start, solutions = published_estimate(m, r, known, second_order=second_order)
        squares = sensed(start, r, v_bar) ** 2 if second_order else None
        told = _conditioning(stack(m, r, squares) / column_sizes(m, squares), m, v, needed)
        refusals.check_conditioning(told, needed, MAX_CONDITION, "some of F, reference and bias", REMEDY)
        if isinstance(known, KnownNorm):
            refusals.check_side(start[REFERENCE], np.asarray(known.side, dtype=np.float64))
        attitude_error = None
        white = whitening(v)
        if method == "as_published":
            theta, iterations = start, solutions
            covariance = published_covariance(theta, m, r, known, v)
        elif method == "maximum_likelihood":
            theta, iterations = most_likely(start, m, r, v_bar, white, norm_known=norm_known)
            covariance = covariance_bound(theta, r, v_bar, white, norm_known=norm_known)
        else:
            stated = np.zeros(len(m)) if attitude_std_rad is None else np.asarray(attitude_std_rad, dtype=np.float64)
            placed = Placed(m, v, r, v_bar, stated, norm_known)
            found = solve_attitude_weighted(start, placed)
            _check_attitudes(start, placed, found)
            theta, covariance, iterations = found.theta, found.covariance, found.iterations
            attitude_error, white = found.attitude_error, found.white
    f = theta[F].reshape(3, 3)
    refusals.check_unit(scale_of(f))
    refusals.check_handedness(f)
    residuals = m - predicted(theta, r, v_bar)
    return TriaxialSolution(
        method=method,
        matrix=f,
        bias=theta[BIAS],
        reference=theta[REFERENCE],
        second_order=theta[15:] if second_order else None,
        covariance=covariance,
        residuals=residuals,
        observations=len(m),
        rank=told.rank,
        condition=told.condition,
        iterations=iterations,
        warnings=refusals.warn_of_residuals(whitened(white, residuals), np.ones_like(v), 3 * len(m) - needed)
        + _errors_in_x(m, v, method),
        attitude_error=attitude_error,
    )


def solve_triaxial_batch(
    readings: ArrayLike,
    attitudes: ArrayLike,
    variances: ArrayLike,
    known: Known,
    *,
    second_order: bool = False,
    method: EqualWeights = "as_published",
) -> Array:
    """θ (R, 15 or 18) = [rows of F, v_ref, b, φ] of many runs (R, N, 3) in the same attitudes, without gates.

    `attitudes` (N, 3, 3), `variances` (N, 3) and `known` are those of every run, as in `solve_triaxial`.
    """
    m, r, v = (np.asarray(a, dtype=np.float64) for a in (readings, attitudes, variances))
    theta, _ = published_estimate(m, r, known, second_order=second_order)
    if method == "maximum_likelihood":
        theta, _ = most_likely(theta, m, r, known.v_bar(len(r)), whitening(v), norm_known=isinstance(known, KnownNorm))
    return theta


def _check(m: Array, r: Array, v: Array, known: Known, parameters: int) -> None:
    count = len(m)
    refusals.require_shape("readings", m, (count, 3))
    refusals.require_shape("attitudes", r, (count, 3, 3))
    refusals.require_shape("variances", v, (count, 3))
    refusals.check_count(count, parameters // 3, parameters)
    refusals.check_finite(readings=m, attitudes=r, variances=v)
    if isinstance(known, KnownVector):
        refusals.require_shape("known", known.v_bar(count), (count, 3))
        refusals.check_finite(known=known.v_bar(count))
    refusals.check_variances(v)
    refusals.check_signal(m)
    if isinstance(known, KnownNorm):
        refusals.check_duplicates(m)  # averages never repeat; single samples of a turning sensor may
    refusals.check_rotations(r)
    if isinstance(known, KnownNorm):
        _check_size(m, known.norm)


def _check_size(m: Array, norm: float) -> None:
    """Raises Fault `wrong_unit` for readings smaller than the reference, or that differ by more, in any attitudes."""
    size, spread = (float(np.sqrt(np.mean(np.sum(each**2, axis=1)))) for each in (m, m - m.mean(axis=0)))
    refusals.check_unit(np.full(3, norm / np.clip(norm, spread, size)))


def _conditioning(scaled: Array, m: Array, v: Array, needed: int) -> refusals.Conditioning:
    """Conditioning of the scaled X. Its readings are noisy, so directions that only noise tells do not count."""
    noise = np.sqrt(v.max() / np.mean(m**2)) * (np.sqrt(len(m)) + np.sqrt(3))
    return refusals.condition_of(scaled, needed, float(noise))


def _errors_in_x(m: Array, v: Array, method: Method) -> tuple[str, ...]:
    """A warning where noise in X biases the published estimate by what its standard deviation does not cover."""
    if method != "as_published" or len(m) * v.mean() < NOTICEABLE**2 * np.mean(m**2):
        return ()
    return ("noise in the readings biases the published estimate; maximum_likelihood does not suffer from it",)


def _check_attitudes(start: Array, placed: Placed, fit: AttitudeWeighted) -> None:
    """Raises Fault where attitudes are off: all, or the one that fits worst where enough others are left to tell."""
    enough = 3 * (len(placed.readings) - 1) > len(start) + 3
    check_trustworthy(fit.attitude_error.std_rad, lambda: furthest_off(start, placed, fit), enough=enough)


def check_trustworthy(off_rad: float, furthest: Callable[[], tuple[int, float, float]], *, enough: bool) -> None:
    """Raises Fault `attitude_untrustworthy` where attitudes are off by so much each, or the `furthest` by far more.

    `furthest` gives the place of that one, by how much the others say it is off, and how far off they are, rad; it is
    asked where `enough` others are left to tell.
    """
    said = f"the readings say that the attitudes are off by {1e3 * off_rad:.2g} mrad each"
    if off_rad > SUSPICIOUS_RAD and enough:
        worst, by, expected = furthest()
        if by > max(UNTRUSTWORTHY_RAD, ODD * expected):
            off_rad = by
            said = (
                f"attitude {worst + 1} is off by {1e3 * by:.2g} mrad, say the others, which are by {1e3 * expected:.2g}"
            )
    if off_rad > UNTRUSTWORTHY_RAD:
        raise refusals.untrustworthy_attitudes(said)
