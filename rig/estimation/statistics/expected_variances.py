"""Variance components of readings with shared errors: expected values instead of the most likely ones.

The components are the arm's errors, the bias random walk, and the disturbance of single dwells, as in
`rig.estimation.statistics.bias_process` and `rig.estimation.reference.shared_errors`, estimated together. Only a few
readings determine a component. Its most likely value, and with it every uncertainty, would be too small in one run and
too large in the next.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array

WALK_POINTS = 12
WALK_SPAN = 100.0  # ratio of the largest to the smallest random walk
MIN_ERROR_RAD, MAX_ERROR_RAD, ERROR_GRID_POINTS = 1e-5, 0.03, 25  # grid of δ; the first is better than any arm

INDEPENDENT_FRACTIONS = (0.001, 0.01, 0.1, 0.5)  # of δ²: between nearly all and half of an arm's errors may be constant
# grid of a disturbance's size: the largest, in standard deviations of the noise, and the number of points
MAX_DISTURBANCE_RATIO, DISTURBANCE_GRID_POINTS = 30.0, 8


@dataclass(frozen=True, slots=True)
class ResidualInputs:
    """Residuals (n,) of a fit, its columns `slopes` (n, q), and the covariances of the errors.

    - `covariance` (n, n): covariance of all errors except the arm's and the random walk.
    - `effects(fraction)` (n, P): effects of the arm's errors, of which this fraction is independent in each dwell.
    - `walk` (n, n): covariance of a random walk of rate 1.
    - `noise` (n,): variances of the readings' own noise.
    """

    residuals: Array
    slopes: Array
    covariance: Array
    effects: Callable[[float], Array]
    walk: Array
    noise: Array


@dataclass(frozen=True, slots=True)
class ErrorSizes:
    """The estimated standard deviations of the shared errors.

    `walk`: the bias random walk in one second; `std_rad`: the attitude error; `independent_fraction`: the fraction of
    the attitude error's variance that is independent in each dwell.
    """

    walk: float
    std_rad: float
    independent_fraction: float


def estimate_variances(fit: ResidualInputs, fractions: Sequence[float]) -> ErrorSizes:
    """Return the random walk and the attitude error: root mean squares over their posterior on a grid.

    The prior of the random walk is spike-and-slab, with a log-uniform slab; that of the attitude error is log-uniform.
    A fraction of the attitude error's variance is independent in each dwell. The `fractions` are its possible values,
    all equally probable; their mean, weighted by the posterior variance, is returned too.
    """
    constant = np.diag(fit.walk) > 0
    typical = np.sqrt(np.median(fit.noise[constant]) / np.median(np.diag(fit.walk)[constant]))
    walks = np.concatenate([[0.0], typical * np.geomspace(WALK_SPAN**-0.5, WALK_SPAN**0.5, WALK_POINTS)])
    sizes = np.geomspace(MIN_ERROR_RAD, MAX_ERROR_RAD, ERROR_GRID_POINTS)
    columns = fit.slopes.shape[1]
    free = np.linalg.qr(fit.slopes, mode="complete")[0][:, columns:].T  # contrasts, free of the columns
    residuals, covariance, walk = (free @ fit.residuals, free @ fit.covariance @ free.T, free @ fit.walk @ free.T)
    whiteners = [np.linalg.inv(np.linalg.cholesky(covariance + rate**2 * walk)) for rate in walks]
    of_arm = [free @ fit.effects(fraction) for fraction in fractions]
    # Axes: fraction, walk, attitude error.
    log_posterior = np.array(
        [[_find_log_likelihoods(residuals, whitener, effects, sizes) for whitener in whiteners] for effects in of_arm]
    )
    log_posterior[:, 1:] -= np.log(WALK_POINTS)  # all points of the slab together are as probable as the spike, walk 0
    weights = np.exp(log_posterior - log_posterior.max())
    weights /= weights.sum()
    walk_square, attitude_square = weights.sum(axis=(0, 2)) @ walks**2, weights.sum(axis=1) @ sizes**2
    fraction = attitude_square @ fractions / attitude_square.sum()
    return ErrorSizes(float(np.sqrt(walk_square)), float(np.sqrt(attitude_square.sum())), float(fraction))


def estimate_disturbances(
    fit: ResidualInputs, sizes: ErrorSizes, causes: Sequence[Array], odds: Sequence[float]
) -> Array:
    """Return the expected variances (k,) of k `causes` of additional errors.

    Each cause has independent errors, of which q columns (n, q) state the effects on the readings at variance 1. The
    variances have log-uniform priors, and `odds` (k,) that the cause exists; at most one cause is assumed to exist.
    """
    effects = sizes.std_rad * fit.effects(sizes.independent_fraction)
    whitener = np.linalg.inv(np.linalg.cholesky(fit.covariance + sizes.walk**2 * fit.walk + effects @ effects.T))
    basis = np.linalg.qr(whitener @ fit.slopes)[0]
    residuals = whitener @ fit.residuals
    residuals = residuals - basis @ (basis.T @ residuals)
    volumes = np.geomspace(1.0, MAX_DISTURBANCE_RATIO, DISTURBANCE_GRID_POINTS) ** 2
    log_posterior = np.zeros((len(causes), DISTURBANCE_GRID_POINTS))
    for row, columns in enumerate(causes):
        projected = whitener @ columns
        projected = projected - basis @ (basis.T @ projected)
        growth, directions = np.linalg.eigh(projected.T @ projected)
        components = np.square(directions.T @ (projected.T @ residuals))
        grown = 1 + volumes[:, None] * growth.clip(min=0.0)
        log_likelihood = 0.5 * np.sum(volumes[:, None] * components / grown - np.log(grown), axis=1)
        log_posterior[row] = np.log(odds[row] / DISTURBANCE_GRID_POINTS) + log_likelihood
    most = max(float(log_posterior.max()), 0.0)
    weights = np.exp(log_posterior - most)
    expected: Array = weights @ volumes / (weights.sum() + np.exp(-most))
    return expected


def _find_log_likelihoods(residuals: Array, whitener: Array, effects: Array, sizes: Array) -> Array:
    """Return log-likelihoods (k,) of residuals (n,), up to a constant, for attitude errors of the `sizes` (k,).

    `whitener` (n, n), triangular, whitens all modelled errors except the arm's `effects` (n, P).
    """
    scaled = whitener @ effects
    growth, directions = np.linalg.eigh(scaled @ scaled.T)
    squares = np.square(whitener @ residuals @ directions)
    variance = 1 + np.square(sizes)[:, None] * growth.clip(min=0.0)
    deviance = np.sum(np.log(variance) + squares / variance, axis=1)
    return np.asarray(np.log(np.diag(whitener)).sum() - deviance / 2, dtype=np.float64)
