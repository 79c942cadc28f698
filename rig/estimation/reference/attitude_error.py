"""Attitudes that are not exactly known: how far off they are, and the fit that allows for it.

A small rotation ε of the body, (3,) rad, turns the reference in the body's frame and cannot change its size:

    v_m = F (s + φ s²) + b + E ε,   s = Rᵀ v_ref + v̄,   E = F diag(1 + 2 φ s) [Rᵀ v_ref]×

So with ε ~ N(0, δ² 1) in every attitude a reading's covariance is V = diag(σ²) + δ² E Eᵀ: along the reference it is as
well known as ever. For δ → 0 this is the fit of equal directions, for δ → ∞ the one to the size of the reference alone.
δ is what restricted maximum likelihood (Patterson and Thompson, Biometrika 58 (1971) 545) makes of the residuals.
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

SMALLEST_RAD, LARGEST_RAD = 1e-7, 0.3  # of the attitude errors that are looked for
GRID = 40
PASSES = 20
SETTLED = 1e-3  # of δ


@dataclass(frozen=True, slots=True)
class AttitudeError:
    """δ in rad, about each axis, beyond what was stated of the attitudes; `uncertainty_rad` is one standard deviation.

    Upwards: the likelihood is one-sided near zero.
    """

    std_rad: float
    uncertainty_rad: float


@dataclass(frozen=True, slots=True)
class Placed:
    """Readings (N, 3) with the `variances` (N, 3) of their noise, in `attitudes` (N, 3, 3), body to table.

    `v_bar` (N, 3) is what the table itself adds; `attitude_std_rad` (N,) how well each attitude is said to be known,
    zero where nothing is said; `norm_known` whether ‖v_ref‖ is given.
    """

    readings: Array
    variances: Array
    attitudes: Array
    v_bar: Array
    attitude_std_rad: Array
    norm_known: bool

    def without(self, attitude: int) -> "Placed":
        """The readings in all attitudes but one."""
        left = np.arange(len(self.readings)) != attitude
        return Placed(
            self.readings[left],
            self.variances[left],
            self.attitudes[left],
            self.v_bar[left],
            self.attitude_std_rad[left],
            self.norm_known,
        )


@dataclass(frozen=True, slots=True)
class AttitudeWeighted:
    """θ (p,) and its covariance (p, p), the attitude error found, W (N, 3, 3) of the readings, the steps it took."""

    theta: Array
    covariance: Array
    attitude_error: AttitudeError
    white: Array
    iterations: int


def solve_attitude_weighted(start: Array, placed: Placed) -> AttitudeWeighted:
    """The most likely θ and δ from `start` (p,), alternately, until δ stands still."""
    r, v_bar, norm_known = placed.attitudes, placed.v_bar, placed.norm_known
    theta, steps, delta, last = start, 0, 0.0, np.inf
    for _ in range(PASSES):
        turned = effects(theta, r, v_bar)
        white = whitening_with(placed.variances, turned, np.hypot(placed.attitude_std_rad, delta))
        theta, taken = most_likely(theta, placed.readings, r, v_bar, white, norm_known=norm_known)
        steps += taken
        if abs(delta - last) <= SETTLED * delta:
            break
        last, delta = delta, _restricted(theta, placed)
    fit = weighted_jacobian(theta, r, v_bar, white, norm_known=norm_known)
    return AttitudeWeighted(
        theta,
        covariance_bound(theta, r, v_bar, white, norm_known=norm_known),
        AttitudeError(delta, _uncertainty(delta, fit, white @ turned)),
        white,
        steps,
    )


def furthest_off(start: Array, placed: Placed, fit: AttitudeWeighted) -> tuple[int, float, float]:
    """The attitude that fits worst, by how much the others say it is off, rad, and how far off it may be.

    One that was not reached makes all look worse than they are, itself better.
    """
    residuals = placed.readings - predicted(fit.theta, placed.attitudes, placed.v_bar)
    worst = int(np.argmax(np.sum(whitened(fit.white, residuals) ** 2, axis=1)))
    rest = solve_attitude_weighted(start, placed.without(worst))
    missed = placed.readings[worst] - predicted(rest.theta, placed.attitudes, placed.v_bar)[worst]
    turned = effects(rest.theta, placed.attitudes, placed.v_bar)[worst]
    off = np.linalg.lstsq(turned, missed, rcond=1e-6)[0]  # about the reference itself nothing can be told
    expected = float(np.hypot(rest.attitude_error.std_rad, placed.attitude_std_rad[worst]))
    return worst, float(np.linalg.norm(off)), expected


def effects(theta: Array, attitudes: Array, v_bar: Array) -> Array:
    """E (N, 3, 3): the change of each reading by a small rotation of its attitude."""
    turning = np.einsum("nji,j->ni", attitudes, theta[REFERENCE])
    cross = np.zeros((len(attitudes), 3, 3))
    x, y, z = turning.T
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -z, y, -x
    cross -= np.swapaxes(cross, -1, -2)
    if len(theta) > 15:
        cross = (1 + 2 * theta[SECOND] * sensed(theta, attitudes, v_bar))[..., None] * cross
    effect: Array = matrix_of(theta) @ cross
    return effect


def whitening_with(variances: Array, turned: Array, std_rad: Array) -> Array:
    """W (N, 3, 3) of readings with noise `variances` (N, 3) in attitudes known to `std_rad` (N,); `turned` is E."""
    spread = turned * std_rad[:, None, None]
    covariance = np.eye(3) * variances[:, :, None] + spread @ np.swapaxes(spread, -1, -2)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)), dtype=np.float64)


def _restricted(theta: Array, placed: Placed) -> float:
    """The likeliest δ."""
    r, v_bar = placed.attitudes, placed.v_bar
    turned = effects(theta, r, v_bar)
    white = whitening_with(placed.variances, turned, placed.attitude_std_rad)
    spread = white @ turned
    growth, directions = np.linalg.eigh(spread @ np.swapaxes(spread, -1, -2))
    white = np.swapaxes(directions, -1, -2) @ white
    residuals = whitened(white, placed.readings - predicted(theta, r, v_bar))
    fit = weighted_jacobian(theta, r, v_bar, white, norm_known=placed.norm_known)
    return likeliest(growth.clip(min=0.0).ravel(), residuals.ravel(), fit)[0]


def likeliest(growth: Array, residuals: Array, slopes: Array, beside: Array | None = None) -> tuple[float, float]:
    """δ, rad, that makes residuals (n,) of independent readings with variances 1 + δ² γ likeliest, and − ln of that.

    The likelihood is of what the slopes (n, q) leave; columns (n, k) `beside` them explain more. It is up to a constant
    that is of the slopes alone. δ is the best of a grid, then between its neighbours.
    """
    from scipy.optimize import minimize_scalar

    count = slopes.shape[1]
    # The likelihood does not know what the columns explain: by orthonormal ones, it keeps its digits.
    basis = np.linalg.qr(slopes if beside is None else np.column_stack([slopes, beside]))[0]
    left = residuals - basis @ (basis.T @ residuals)

    def lost(log_delta: float) -> float:
        weights = 1 / (1 + np.exp(2 * log_delta) * growth)
        weighted = basis * weights[:, None]
        try:
            lower = np.linalg.cholesky(basis.T @ weighted)
        except np.linalg.LinAlgError:  # δ so far beyond the noise that rounding is all there is
            return float("inf")
        explained = np.linalg.solve(lower, left @ weighted)
        chi_square = left**2 @ weights - explained @ explained
        return float(0.5 * (chi_square - np.log(weights).sum()) + np.log(np.diag(lower)[:count]).sum())

    grid = np.linspace(np.log(SMALLEST_RAD), np.log(LARGEST_RAD), GRID)
    values = [lost(each) for each in grid]
    best = int(np.argmin(values))
    if best == 0 or values[0] - values[best] < 1e-6:
        return 0.0, lost(-np.inf)  # no likelier than exact attitudes
    bounds = grid[best - 1], grid[min(best + 1, GRID - 1)]
    found = minimize_scalar(lost, bounds=bounds, method="bounded", options={"xatol": 1e-5})
    return float(np.exp(found.x)), float(found.fun)


def _uncertainty(delta: float, fit: Array, turned: Array) -> float:
    """Uncertainty by expected information on δ²: half the trace of (P G)², G = E Eᵀ, P what the fit leaves, white."""
    orthogonal = np.linalg.qr(fit)[0].reshape(*turned.shape[:2], -1)
    growth = turned @ np.swapaxes(turned, -1, -2)
    grown = growth @ orthogonal
    taken = np.einsum("nip,niq->pq", orthogonal, grown)
    information = 0.5 * float(np.sum(growth**2) - 2 * np.sum(grown**2) + np.sum(taken**2))
    if information <= 0:
        return float("inf")
    return float(np.sqrt(delta**2 + information**-0.5) - delta)
