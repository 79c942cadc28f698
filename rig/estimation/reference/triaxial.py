"""Tri-axial calibration of the paper TRIAX: F, bias and the reference vector from readings in known attitudes.

    v_m = F (Rᵀ v_ref + v̄) + b                                                             TRIAX, Eqs. (3), (9)

R maps body coordinates to table coordinates; v_ref, in table coordinates, is estimated as well. v̄ is the table's own
motion: for a gyroscope its rate (v_ref is then the Earth's rate), zero for an accelerometer or a magnetometer. With v̄
= 0 the factor between F and v_ref is unknown, so ‖v_ref‖ and its half-space must be given.

There are three methods. "as_published" solves the stacked equations (`rig.estimation.reference.stacked`). Their design
contains the readings, so the readings' noise σ shrinks F⁻¹ by about (σ/v_rms)², regardless of their number N
(errors in variables). This is significant if √N σ/v_rms nears one: not for averages of minutes, but for single samples
at slow rates. "maximum_likelihood" continues with weighted least squares in the readings themselves
(`rig.estimation.reference.reference_model`), which is unbiased, independent of the scaling of columns, and efficient.
"attitude_weighted" also estimates attitude errors, such as those of an arm (`rig.estimation.reference.attitude_error`).
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
    AttitudeReadings,
    AttitudeWeighted,
    find_worst_attitude,
    solve_attitude_weighted,
)
from rig.estimation.reference.reference_model import (
    BIAS,
    REFERENCE,
    F,
    KnownNorm,
    KnownVector,
    ReferencePrior,
    covariance_bound,
    most_likely,
    predicted,
    sensed,
    whitened,
    whitening,
)
from rig.estimation.reference.stacked import column_sizes, compute_published_covariance, estimate_as_published, stack

EqualWeights = Literal["as_published", "maximum_likelihood"]
Method = EqualWeights | Literal["attitude_weighted"]

MAX_CONDITION = 1e4
MIN_NOISE_BIAS_RATIO = 0.5  # √N σ/v_rms, above which the noise biases the published method noticeably
MAX_ATTITUDE_ERROR_RAD = 5e-3  # with larger attitude errors, the model is wrong
GYROSCOPE_REMEDY = "; or calibrate only a gyroscope by them, which needs no exact attitudes"
SUSPICIOUS_ERROR_RAD = 5e-4  # attitude error above which a single wrong attitude is searched for
OUTLIER_RATIO = 6.0  # to the other attitudes' error
REMEDY = "Take more attitudes, turned about at least two different axes"


@dataclass(frozen=True, slots=True)
class TriaxialSolution:
    """A tri-axial sensor's calibration, in the unit of the readings.

    - method: the method's name.
    - matrix (3, 3): F, the scale factors and axes; bias (3,): b, the reading at zero input.
    - reference (3,): the reference v_ref in table coordinates.
    - second_order (3,): quadratic terms φ, the diagonal of F̄ in 1/unit, None if they were not estimated.
    - covariance (15, 15) or (18, 18): of the rows of F, v_ref, b, φ.
    - residuals (N, 3): readings minus model.
    - rank, condition: of the scaled design; the full rank is 15 (18), one less if ‖v_ref‖ is given.
    - iterations: number of linear solutions or Gauss-Newton steps.
    - attitude_error: estimated by the method "attitude_weighted", else None.
    - observations: number N of readings.
    - warnings: sentences for people.
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
        """The parameters (15,) or (18,), in the covariance's order."""
        second_order = () if self.second_order is None else self.second_order
        return np.concatenate([np.ravel(self.matrix), self.reference, self.bias, second_order])

    @property
    def attitude_std_rad(self) -> float:
        """The estimated error of attitudes about each axis, rad; zero if the method takes attitudes as exact."""
        return 0.0 if self.attitude_error is None else self.attitude_error.std_rad


def solve_triaxial(
    readings: ArrayLike,
    attitudes: ArrayLike,
    variances: ArrayLike,
    prior: ReferencePrior,
    *,
    second_order: bool = False,
    method: Method = "as_published",
    attitude_std_rad: ArrayLike | None = None,
) -> TriaxialSolution:
    """Return a triad's matrix F, reference v_ref and bias b, and with `second_order` also the quadratic terms φ.

    - `readings`, `variances` (N, 3): mean readings and the variances of these means.
    - `attitudes` (N, 3, 3): R, body to table.
    - `prior`: the table's motion v̄ as a `KnownVector`, or, if it is at rest, the norm of v_ref as a `KnownNorm`.
    - `attitude_std_rad` (N,): the stated uncertainty of each attitude, for the method "attitude_weighted".

    Raise Fault `too_few_observations`, `not_finite`, `bad_variance`, `zero_reading`, `duplicated_observation`,
    `bad_attitude`, `rank_deficient`, `ill_conditioned`, `sign_unknown`, `wrong_unit`, `mirrored_axis`,
    `attitude_untrustworthy`; ValueError for a wrong shape.
    """
    m, r, v = (np.asarray(a, dtype=np.float64) for a in (readings, attitudes, variances))
    v_bar, norm_known = prior.v_bar(len(m)), isinstance(prior, KnownNorm)
    parameters = 18 if second_order else 15
    needed = parameters - norm_known
    _check(m, r, v, prior, parameters)

    with refusals.convergence_required():
        start, solutions = estimate_as_published(m, r, prior, second_order=second_order)
        squares = sensed(start, r, v_bar) ** 2 if second_order else None
        conditioning = _conditioning(stack(m, r, squares) / column_sizes(m, squares), m, v, needed)
        refusals.check_conditioning(conditioning, needed, MAX_CONDITION, "some of F, reference and bias", REMEDY)
        attitude_error = None
        whiteners = whitening(v)
        if method == "as_published":
            theta, iterations = start, solutions
            covariance = compute_published_covariance(theta, m, r, prior, v)
        elif method == "maximum_likelihood":
            theta, iterations = most_likely(start, m, r, v_bar, whiteners, norm_known=norm_known)
            covariance = covariance_bound(theta, r, v_bar, whiteners, norm_known=norm_known)
        else:
            stated = np.zeros(len(m)) if attitude_std_rad is None else np.asarray(attitude_std_rad, dtype=np.float64)
            placed = AttitudeReadings(m, v, r, v_bar, stated, norm_known)
            weighted = solve_attitude_weighted(start, placed)
            _check_attitudes(start, placed, weighted)
            theta, covariance, iterations = weighted.theta, weighted.covariance, weighted.iterations
            attitude_error, whiteners = weighted.attitude_error, weighted.whiteners
    if isinstance(prior, KnownNorm):  # attitudes that contradict the readings have been refused
        refusals.check_side(theta[REFERENCE], np.asarray(prior.side, dtype=np.float64))
    f = theta[F].reshape(3, 3)
    _check_scale(scale_of(f), m, prior)
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
        rank=conditioning.rank,
        condition=conditioning.condition,
        iterations=iterations,
        warnings=refusals.warn_of_residuals(whitened(whiteners, residuals), np.ones_like(v), 3 * len(m) - needed)
        + _errors_in_x(m, v, method),
        attitude_error=attitude_error,
    )


def solve_triaxial_batch(
    readings: ArrayLike,
    attitudes: ArrayLike,
    variances: ArrayLike,
    prior: ReferencePrior,
    *,
    second_order: bool = False,
    method: EqualWeights = "as_published",
) -> Array:
    """Return the parameters (R, 15 or 18) of many runs (R, N, 3) in the same attitudes, without checks.

    The parameters are F row by row, the reference, the bias, and the quadratic terms if `second_order`. `attitudes`
    (N, 3, 3), `variances` (N, 3) and `prior` are the same for every run, as in `solve_triaxial`.
    """
    m, r, v = (np.asarray(a, dtype=np.float64) for a in (readings, attitudes, variances))
    theta, _ = estimate_as_published(m, r, prior, second_order=second_order)
    if method == "maximum_likelihood":
        theta, _ = most_likely(theta, m, r, prior.v_bar(len(r)), whitening(v), norm_known=isinstance(prior, KnownNorm))
    return theta


def _check(m: Array, r: Array, v: Array, prior: ReferencePrior, parameters: int) -> None:
    """Raise as `solve_triaxial` does for inputs of a wrong shape, number or value."""
    count = len(m)
    refusals.require_shape("readings", m, (count, 3))
    refusals.require_shape("attitudes", r, (count, 3, 3))
    refusals.require_shape("variances", v, (count, 3))
    refusals.check_count(count, parameters // 3, parameters)
    refusals.check_finite(readings=m, attitudes=r, variances=v)
    if isinstance(prior, KnownVector):
        refusals.require_shape("known", prior.v_bar(count), (count, 3))
        refusals.check_finite(known=prior.v_bar(count))
    refusals.check_variances(v)
    refusals.check_signal(m)
    if isinstance(prior, KnownNorm):
        refusals.check_duplicates(m)  # averages never repeat; single samples of a turning sensor may
    refusals.check_rotations(r)
    if isinstance(prior, KnownNorm):
        _check_size(m, prior.norm)


def _check_size(m: Array, norm: float) -> None:
    """Raise Fault `wrong_unit` if readings (N, 3) are far smaller, or scatter far more, than the reference's `norm`."""
    size, spread = (float(np.sqrt(np.mean(np.sum(vectors**2, axis=1)))) for vectors in (m, m - m.mean(axis=0)))
    refusals.check_unit(np.full(3, norm / np.clip(norm, spread, size)), refusals.UNIT_RATIOS)


def _check_scale(scale: Array, m: Array, prior: ReferencePrior) -> None:
    """Raise Fault `wrong_unit` or, if the units are right, `attitude_untrustworthy`, for an implausible scale (3,).

    If the readings (N, 3) of every axis reach from about minus to plus a known norm, their units are right.
    """
    if isinstance(prior, KnownNorm) and not refusals.is_plausible(scale).all():
        amplitudes = np.ptp(m, axis=0) / 2
        if refusals.is_plausible(amplitudes / prior.norm).all():
            raise refusals.untrustworthy_attitudes(
                "the readings have the size of the reference, but the attitudes do not fit them with any scale factors"
            )
    refusals.check_unit(scale, refusals.UNIT_RATIOS if isinstance(prior, KnownNorm) else refusals.ANGLE_UNIT_RATIOS)


def _conditioning(scaled: Array, m: Array, v: Array, needed: int) -> refusals.Conditioning:
    """Return the conditioning of the scaled design, which needs the rank `needed`.

    Directions dominated by noise, with variances `v` of the readings `m`, do not count towards the rank."""
    noise = np.sqrt(v.max() / np.mean(m**2)) * (np.sqrt(len(m)) + np.sqrt(3))
    return refusals.condition_of(scaled, needed, float(noise))


def _errors_in_x(m: Array, v: Array, method: Method) -> tuple[str, ...]:
    """Return a warning if noise in the design biases the published estimate by more than its standard deviation."""
    if method != "as_published" or len(m) * v.mean() < MIN_NOISE_BIAS_RATIO**2 * np.mean(m**2):
        return ()
    return ("noise in the readings biases the published estimate; maximum_likelihood does not suffer from it",)


def _check_attitudes(start: Array, placed: AttitudeReadings, fit: AttitudeWeighted) -> None:
    """Raise Fault if all attitudes are wrong, or if one is wrong and the others suffice to identify it."""
    enough = 3 * (len(placed.readings) - 1) > len(start) + 3
    check_trustworthy(fit.attitude_error.std_rad, lambda: find_worst_attitude(start, placed, fit), enough=enough)


def check_trustworthy(error_rad: float, furthest: Callable[[], tuple[int, float, float]], *, enough: bool) -> None:
    """Raise Fault `attitude_untrustworthy` if the error of all attitudes, or of the worst one, is too large.

    `error_rad` is the standard deviation of all. `furthest` returns the index of the worst attitude, and two errors in
    rad: that of this attitude and the standard deviation of the others. It is called if `enough` others remain.
    """
    message = f"the readings show that each attitude is off by {1e3 * error_rad:.2g} mrad"
    if error_rad > SUSPICIOUS_ERROR_RAD and enough:
        worst, worst_rad, expected = furthest()
        if expected <= MAX_ATTITUDE_ERROR_RAD and worst_rad > max(MAX_ATTITUDE_ERROR_RAD, OUTLIER_RATIO * expected):
            error_rad = worst_rad
            by_others = f"but the others by {1e3 * expected:.2g} mrad"
            message = f"attitude {worst + 1} is off by {1e3 * worst_rad:.2g} mrad, {by_others}"
    if error_rad > MAX_ATTITUDE_ERROR_RAD:
        limit = f"the limit is {1e3 * MAX_ATTITUDE_ERROR_RAD:.0f} mrad"
        raise refusals.untrustworthy_attitudes(f"{message}; {limit}", GYROSCOPE_REMEDY)
