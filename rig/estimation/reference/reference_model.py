"""The forward model of a sensor's readings in known attitudes, Eqs. (3), (9), (10) of the paper TRIAX, and its fit.

    v_m = F (s + φ s²) + b,   s = Rᵀ v_ref + v̄

v_m is a mean reading, and s the true quantity in body axes. R maps the body frame to the table frame, v_ref is fixed to
the table, and v̄ is the known part of s, such as a joint's rate. θ holds F (row by row), v_ref and b: 15 numbers, or 18
with φ (3,) if the model has second-order terms.

The least-squares fit weighted by the readings' variances is the maximum likelihood estimate; Gauss–Newton
reaches it from the paper's estimate in a few steps. With v̄ = 0, F and v_ref are identifiable only up to a common
factor, so ‖v_ref‖ is fixed.

The covariance V of readings is given as whiteners W (…, N, 3, 3) with W V Wᵀ = I, as `whitening` returns them.

All functions broadcast over runs: readings (…, N, 3), θ (…, 15 or 18).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array

F, REFERENCE, BIAS, SECOND = slice(0, 9), slice(9, 12), slice(12, 15), slice(15, 18)
STEP_LIMIT = 30
STEP_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class KnownVector:
    """The part `added` (N, 3) of the input, in body coordinates, that the table's motion adds, such as its own rate."""

    added: ArrayLike

    def v_bar(self, count: int) -> Array:
        """Return the input (N, 3) that the table's motion adds in `count` attitudes."""
        return np.asarray(self.added, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class KnownNorm:
    """The given norm of a resting table's reference, a vector that has a positive dot product with `side` (3,)."""

    norm: float
    side: ArrayLike

    def v_bar(self, count: int) -> Array:
        """Return the input (N, 3) that the table's motion adds in `count` attitudes: zero."""
        return np.zeros((count, 3))


ReferencePrior = KnownVector | KnownNorm


def sensed(theta: Array, attitudes: Array, v_bar: Array) -> Array:
    """Return the sensor's input s = Rᵀ v_ref + `v_bar` (…, N, 3) in attitudes R (N, 3, 3); `theta` contains v_ref."""
    s: Array = np.einsum("nji,...j->...ni", attitudes, theta[..., REFERENCE]) + v_bar
    return s


def predicted(theta: Array, attitudes: Array, v_bar: Array) -> Array:
    """Return the readings (…, N, 3) that the model predicts for the parameters `theta`."""
    s = sensed(theta, attitudes, v_bar)
    if theta.shape[-1] > 15:
        s = s + theta[..., None, SECOND] * s**2
    readings: Array = s @ np.swapaxes(matrix(theta), -1, -2) + theta[..., None, BIAS]
    return readings


def matrix(theta: Array) -> Array:
    """Return the matrix F (…, 3, 3) in the parameters `theta`."""
    return theta[..., F].reshape(*theta.shape[:-1], 3, 3)


def jacobian(theta: Array, attitudes: Array, v_bar: Array) -> Array:
    """Return the derivative (…, N, 3, 15 or 18) of the readings with respect to the parameters `theta`."""
    s, f = sensed(theta, attitudes, v_bar), matrix(theta)[..., None, :, :]
    slope, nonlinear = np.ones_like(s), s
    if theta.shape[-1] > 15:
        second = theta[..., None, SECOND]
        slope, nonlinear = 1 + 2 * second * s, s + second * s**2
    rows = np.zeros((*s.shape, theta.shape[-1]))
    for i in range(3):
        rows[..., i, 3 * i : 3 * i + 3] = nonlinear
        rows[..., i, 12 + i] = 1.0
    rows[..., REFERENCE] = (f * slope[..., None, :]) @ np.swapaxes(attitudes, -1, -2)
    if theta.shape[-1] > 15:
        rows[..., SECOND] = f * (s**2)[..., None, :]
    return rows


def free_directions(theta: Array, *, norm_known: bool) -> Array:
    """Return the directions (…, p, q) in which `theta` may change: q = p, or p − 1 if the reference's norm is given."""
    p = theta.shape[-1]
    free = np.zeros((*theta.shape[:-1], p, p))
    free[...] = np.eye(p)
    if not norm_known:
        return free
    reference = theta[..., REFERENCE]
    unit = reference / np.linalg.norm(reference, axis=-1, keepdims=True)
    # Householder: the reflection of v_ref to the first axis; its other columns are perpendicular to v_ref.
    sign = np.where(unit[..., :1] < 0, -1.0, 1.0)
    mirror = unit + sign * np.array([1.0, 0.0, 0.0])
    mirror = mirror / np.linalg.norm(mirror, axis=-1, keepdims=True)
    free[..., REFERENCE, REFERENCE] = np.eye(3) - 2 * mirror[..., :, None] * mirror[..., None, :]
    return free[..., np.arange(p) != REFERENCE.start]


def whitening(variances: Array) -> Array:
    """Return whiteners (…, N, 3, 3) of readings with three independent errors of variances (…, N, 3)."""
    return np.asarray(np.eye(3) / np.sqrt(variances)[..., None], dtype=np.float64)


def whitened(whiteners: Array, residuals: Array) -> Array:
    """Return residuals (…, N, 3) times whiteners W, which makes them independent, with the standard deviation 1."""
    independent: Array = (whiteners @ residuals[..., None])[..., 0]
    return independent


def weighted_jacobian(theta: Array, attitudes: Array, v_bar: Array, whiteners: Array, *, norm_known: bool) -> Array:
    """Return the whitened Jacobian (…, 3 N, q) of the readings in the free directions of the parameters `theta`."""
    return _reduce_jacobian(theta, attitudes, v_bar, whiteners, free_directions(theta, norm_known=norm_known))


def _reduce_jacobian(theta: Array, attitudes: Array, v_bar: Array, whiteners: Array, free: Array) -> Array:
    """Return the whitened Jacobian (…, 3 N, q) of the readings in the directions `free` (…, p, q)."""
    rows = whiteners @ jacobian(theta, attitudes, v_bar)
    reduced: Array = rows.reshape(*rows.shape[:-3], -1, rows.shape[-1]) @ free
    return reduced


def covariance_bound(theta: Array, attitudes: Array, v_bar: Array, whiteners: Array, *, norm_known: bool) -> Array:
    """Return the Cramér–Rao bound (…, p, p) of the parameters: the inverse of the Fisher information.

    `norm_known`: True if the norm of the reference is given.
    """
    free = free_directions(theta, norm_known=norm_known)
    reduced = _reduce_jacobian(theta, attitudes, v_bar, whiteners, free)
    size = np.linalg.norm(reduced, axis=-2, keepdims=True)
    scaled = reduced / size
    inverse = np.linalg.inv(np.swapaxes(scaled, -1, -2) @ scaled) / (np.swapaxes(size, -1, -2) * size)
    bound: Array = free @ inverse @ np.swapaxes(free, -1, -2)
    return bound


def most_likely(
    start: Array, readings: Array, attitudes: Array, v_bar: Array, whiteners: Array, *, norm_known: bool
) -> tuple[Array, int]:
    """Return the parameters (…, p) of weighted least squares, by Gauss–Newton from `start`, and the number of steps."""
    theta = start.copy()
    norm = np.linalg.norm(theta[..., REFERENCE], axis=-1, keepdims=True)
    steps = 0
    while steps < STEP_LIMIT:
        steps += 1
        free = free_directions(theta, norm_known=norm_known)
        reduced = _reduce_jacobian(theta, attitudes, v_bar, whiteners, free)
        residuals = whitened(whiteners, readings - predicted(theta, attitudes, v_bar))
        size = np.linalg.norm(reduced, axis=-2)
        scaled = reduced / size[..., None, :]
        across = np.swapaxes(scaled, -1, -2)
        right = across @ residuals.reshape(*residuals.shape[:-2], -1, 1)
        step = np.linalg.solve(across @ scaled, right)[..., 0]
        theta = theta + (free @ (step / size)[..., None])[..., 0]
        if norm_known:
            reference = theta[..., REFERENCE]
            theta[..., REFERENCE] = reference * (norm / np.linalg.norm(reference, axis=-1, keepdims=True))
        # In standard deviations of a reading. The term for rounding is large in this unit if the variances are small.
        rounding = 1e-13 * np.linalg.norm(whitened(whiteners, readings))
        if np.max(np.linalg.norm(step, axis=-1)) <= STEP_TOLERANCE + rounding:
            break
    return theta, steps
