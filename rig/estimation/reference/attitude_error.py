"""Uncertain attitudes: their standard deviation, and the fit that includes it.

A small rotation ε of the body, (3,) rad, turns the reference v_ref in the body's frame and does not change its size:

    v_m = F (s + φ s²) + b + E ε,   s = Rᵀ v_ref + v̄,   E = F diag(1 + 2 φ s) [Rᵀ v_ref]×

v̄ is the part of the input that the table's own motion adds; F, φ and b are matrix, nonlinearity and bias. With
ε ~ N(0, δ² I) in every attitude a reading with noise σ (3,) has the covariance V = diag(σ²) + δ² E Eᵀ, which along
the reference does not depend on δ. The fit with these covariances is the fit to the reference as a vector for δ → 0,
and the fit to its size alone for δ → ∞. δ is the restricted maximum likelihood estimate (Patterson and Thompson,
Biometrika 58 (1971) 545).
"""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.reference.reference_model import (
    REFERENCE,
    SECOND,
    covariance_bound,
    most_likely,
    predicted,
    sensed,
    weighted_jacobian,
    whitened,
)
from rig.estimation.reference.reference_model import matrix as matrix_of

MIN_ERROR_RAD, MAX_ERROR_RAD = 1e-7, 0.3  # range of the attitude errors
GRID_POINTS = 40
MAX_ITERATIONS = 20
CONVERGED_CHANGE_RATIO = 1e-3  # of δ


@dataclass(frozen=True, slots=True)
class AttitudeError:
    """The estimated std of attitudes about each axis, in addition to their stated uncertainty.

    `uncertainty_rad` is the standard uncertainty of this estimate, towards larger values if the std is near zero.
    """

    std_rad: float
    uncertainty_rad: float


@dataclass(frozen=True, slots=True)
class AttitudeReadings:
    """Readings (N, 3) with the `variances` (N, 3) of their noise, in `attitudes` (N, 3, 3), body to table.

    `v_bar` (N, 3) is the input due to the table's own motion, in body axes; `attitude_std_rad` (N,) is the stated
    uncertainty of each attitude, zero if none is stated; `norm_known` is True if the norm of the reference is given.
    """

    readings: Array
    variances: Array
    attitudes: Array
    v_bar: Array
    attitude_std_rad: Array
    norm_known: bool

    def omit(self, attitude: int) -> "AttitudeReadings":
        """Return the readings without the attitude of index `attitude`."""
        remaining = np.arange(len(self.readings)) != attitude
        return AttitudeReadings(
            self.readings[remaining],
            self.variances[remaining],
            self.attitudes[remaining],
            self.v_bar[remaining],
            self.attitude_std_rad[remaining],
            self.norm_known,
        )


@dataclass(frozen=True, slots=True)
class AttitudeWeighted:
    """The parameters `theta` (p,), their covariance (p, p), the attitude error, and the readings' whiteners."""

    theta: Array
    covariance: Array
    attitude_error: AttitudeError
    whiteners: Array
    iterations: int


def solve_attitude_weighted(start: Array, placed: AttitudeReadings) -> AttitudeWeighted:
    """Return the most likely parameters and attitude error, by alternating steps from `start` until they converge."""
    r, v_bar, norm_known = placed.attitudes, placed.v_bar, placed.norm_known
    theta, steps, delta, last = start, 0, 0.0, np.inf
    for _ in range(MAX_ITERATIONS):
        rotations = effects(theta, r, v_bar)
        whiteners = find_whiteners(placed.variances, rotations, np.hypot(placed.attitude_std_rad, delta))
        theta, iterations = most_likely(theta, placed.readings, r, v_bar, whiteners, norm_known=norm_known)
        steps += iterations
        if abs(delta - last) <= CONVERGED_CHANGE_RATIO * delta:
            break
        last, delta = delta, _estimate_std(theta, placed)
    fit = weighted_jacobian(theta, r, v_bar, whiteners, norm_known=norm_known)  # pyrefly: ignore[unbound-name]  # MAX_ITERATIONS > 0
    whitened = whiteners @ rotations  # pyrefly: ignore[unbound-name]  # as above
    return AttitudeWeighted(
        theta,
        covariance_bound(theta, r, v_bar, whiteners, norm_known=norm_known),
        AttitudeError(delta, _find_uncertainty(delta, fit, whitened)),
        whiteners,
        steps,
    )


def find_worst_attitude(start: Array, placed: AttitudeReadings, fit: AttitudeWeighted) -> tuple[int, float, float]:
    """Return the index of the attitude that fits worst, its error in rad, and that error's standard deviation.

    Both follow from a fit to the other attitudes, because the worst one would distort the fit.
    """
    residuals = placed.readings - predicted(fit.theta, placed.attitudes, placed.v_bar)
    worst = int(np.argmax(np.sum(whitened(fit.whiteners, residuals) ** 2, axis=1)))
    rest = solve_attitude_weighted(start, placed.omit(worst))
    missed = placed.readings[worst] - predicted(rest.theta, placed.attitudes, placed.v_bar)[worst]
    rotation = effects(rest.theta, placed.attitudes, placed.v_bar)[worst]
    error_rad = np.linalg.lstsq(rotation, missed, rcond=1e-6)[0]  # rotations about the reference are not identifiable
    expected = float(np.hypot(rest.attitude_error.std_rad, placed.attitude_std_rad[worst]))
    return worst, float(np.linalg.norm(error_rad)), expected


def effects(theta: Array, attitudes: Array, v_bar: Array) -> Array:
    """Return the derivatives E (N, 3, 3) of the readings with respect to small rotations of their attitudes."""
    reference = np.einsum("nji,j->ni", attitudes, theta[REFERENCE])
    cross = np.zeros((len(attitudes), 3, 3))
    x, y, z = reference.T
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -z, y, -x
    cross -= np.swapaxes(cross, -1, -2)
    if len(theta) > 15:
        cross = (1 + 2 * theta[SECOND] * sensed(theta, attitudes, v_bar))[..., None] * cross
    effect: Array = matrix_of(theta) @ cross
    return effect


def find_whiteners(variances: Array, rotations: Array, std_rad: Array) -> Array:
    """Return whiteners (N, 3, 3) for noise `variances` (N, 3) and attitude errors `std_rad` (N,).

    `rotations` (N, 3, 3) are the effects of small rotations on the readings.
    """
    scaled = rotations * std_rad[:, None, None]
    covariance = np.eye(3) * variances[:, :, None] + scaled @ np.swapaxes(scaled, -1, -2)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)), dtype=np.float64)


def _estimate_std(theta: Array, placed: AttitudeReadings) -> float:
    """Return the restricted-maximum-likelihood estimate of the attitude error, rad."""
    r, v_bar = placed.attitudes, placed.v_bar
    rotations = effects(theta, r, v_bar)
    whiteners = find_whiteners(placed.variances, rotations, placed.attitude_std_rad)
    scaled = whiteners @ rotations
    growth, directions = np.linalg.eigh(scaled @ np.swapaxes(scaled, -1, -2))
    whiteners = np.swapaxes(directions, -1, -2) @ whiteners
    residuals = whitened(whiteners, placed.readings - predicted(theta, r, v_bar))
    fit = weighted_jacobian(theta, r, v_bar, whiteners, norm_known=placed.norm_known)
    return maximise_likelihood(growth.clip(min=0.0).ravel(), residuals.ravel(), fit)[0]


def maximise_likelihood(
    growth: Array, residuals: Array, slopes: Array, nuisance: Array | None = None
) -> tuple[float, float]:
    """Return the most likely attitude error δ, rad, and the negative restricted log-likelihood up to a constant.

    Residuals (n,) are independent with variances 1 + δ² γ, `growth` (n,) being γ; `slopes` (n, q) are the model's
    columns, `nuisance` (n, k) further explanatory columns. The constant depends on the slopes alone. The search takes
    the best δ of a grid and refines it between the grid's neighbouring values.
    """
    from scipy.optimize import minimize_scalar

    count = slopes.shape[1]
    # The likelihood depends on the columns' span alone; an orthonormal basis is numerically stable.
    basis = np.linalg.qr(slopes if nuisance is None else np.column_stack([slopes, nuisance]))[0]
    projected = residuals - basis @ (basis.T @ residuals)

    def negative_logs(log_deltas: Array) -> Array:
        """Return (χ² + ln det V + ln det of the slopes' information)/2, (m,), by ln δ (m,); V = diag(1 + δ² γ)."""
        weights = 1 / (1 + np.exp(2 * log_deltas)[:, None] * growth)  # diagonal of V⁻¹
        try:
            # Cholesky factor of the coefficients' information
            lower = np.linalg.cholesky((basis.T * weights[:, None, :]) @ basis)
        except np.linalg.LinAlgError:  # some δ is so far above the noise that rounding dominates
            if len(log_deltas) == 1:
                return np.array([np.inf])
            return np.concatenate([negative_logs(log_delta) for log_delta in log_deltas[:, None]])
        explained = np.linalg.solve(lower, ((projected * weights) @ basis)[..., None])[..., 0]
        chi_square = weights @ projected**2 - np.sum(explained**2, axis=1)  # after a weighted fit of the basis
        half_log_determinant = np.log(np.diagonal(lower, axis1=1, axis2=2)[:, :count]).sum(axis=1)
        return np.asarray(0.5 * (chi_square - np.log(weights).sum(axis=1)) + half_log_determinant)

    def negative_log(log_delta: float) -> float:
        return float(negative_logs(np.array([log_delta]))[0])

    grid = np.linspace(np.log(MIN_ERROR_RAD), np.log(MAX_ERROR_RAD), GRID_POINTS)
    values = negative_logs(grid)
    best = int(np.argmin(values))
    if best == 0 or values[0] - values[best] < 1e-6:
        return 0.0, negative_log(-np.inf)  # attitude errors are not more likely than exact attitudes
    bounds = grid[best - 1], grid[min(best + 1, GRID_POINTS - 1)]
    minimum = minimize_scalar(negative_log, bounds=bounds, method="bounded", options={"xatol": 1e-5})
    return float(np.exp(minimum.x)), float(minimum.fun)


def _find_uncertainty(delta: float, fit: Array, rotations: Array) -> float:
    """Return the standard uncertainty of the attitude error `delta` δ, from the expected information on δ².

    The information is tr((P G)²)/2 with G = E Eᵀ. E are the effects (`rotations`) on whitened readings, and P maps
    whitened readings to residuals.
    """
    orthogonal = np.linalg.qr(fit)[0].reshape(*rotations.shape[:2], -1)
    growth = rotations @ np.swapaxes(rotations, -1, -2)
    grown = growth @ orthogonal
    explained = np.einsum("nip,niq->pq", orthogonal, grown)
    information = 0.5 * float(np.sum(growth**2) - 2 * np.sum(grown**2) + np.sum(explained**2))
    if information <= 0:
        return float("inf")
    return float(np.sqrt(delta**2 + information**-0.5) - delta)
