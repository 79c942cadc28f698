"""Bias drift: flicker, a random walk, and scatter between averages.

The readings are averaged over windows. A random walk of rate q (rad/s per √s) changes the bias more the longer the time
between two windows; a scatter s has no memory; flicker noise is in between. The size of the flicker is given, because a
few averages do not determine it. q and s are estimated from the averages by restricted maximum likelihood (Patterson
and Thompson, Biometrika 58 (1971) 545), that is, from contrasts that do not depend on the fitted parameters.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array, median

GRID_POINTS = 25  # of each standard deviation
PARAMETER_COST = 1.0  # in the log-likelihood (Akaike, IEEE Trans. Autom. Control 19 (1974) 716)
GRID_RATIO = 300.0  # of the largest to the smallest standard deviation of the grid
REVOLUTION_PARTS = 24  # whose means give the harmonics of flicker noise to 1 %
FLICKER_CHANGE_RATIO = float(np.sqrt(2))  # change by flicker between adjacent means, relative to its Allan deviation

# Random walk and scatter (2,) from pairs of sizes (K, 2) and their log-likelihoods (K,).
Chosen = Callable[[Array, Array], Array]


@dataclass(frozen=True, slots=True)
class BiasProcess:
    """A drifting bias: random walk `walk_rad_s_sqrt_s` (q) and `scatter_rad_s` (s), zero if only noise was detected.

    `dof`: the number of contrasts used; `instability_rad_s`: the given Allan deviation of the bias' flicker.
    """

    walk_rad_s_sqrt_s: float = 0.0
    scatter_rad_s: float = 0.0
    dof: int = 0
    instability_rad_s: float = 0.0

    @property
    def is_drifting(self) -> bool:
        """True if more than noise and the given flicker was detected."""
        return self.walk_rad_s_sqrt_s > 0.0 or self.scatter_rad_s > 0.0

    @property
    def steady(self) -> bool:
        """True if neither a random walk, nor a scatter, nor a flicker is part of the process."""
        return not self.is_drifting and self.instability_rad_s == 0.0

    def covariance(self, windows_s: ArrayLike) -> Array:
        """Return the covariance (N, N) of the drift's means over windows (N, 2), relative to the mean over all time."""
        walk = self.walk_rad_s_sqrt_s**2 * walk_covariance(windows_s)
        drift: Array = walk + self.scatter_rad_s**2 * np.eye(len(walk))
        return drift if self.instability_rad_s == 0.0 else drift + _flicker(self.instability_rad_s, windows_s)

    def drift_std_rad_s(self, duration_s: float) -> float:
        """Return the standard deviation of the change of the bias in `duration_s`."""
        flickered_rad_s = FLICKER_CHANGE_RATIO * self.instability_rad_s
        return float(
            np.hypot(self.walk_rad_s_sqrt_s * np.sqrt(duration_s), np.hypot(self.scatter_rad_s, flickered_rad_s))
        )


def walk_covariance(windows_s: ArrayLike) -> Array:
    """Return the covariance (N, N) of a unit random walk's means over disjoint windows (N, 2) [start, end].

    The walk is counted from its mean over the whole time from the first start to the last end.
    """
    windows = np.asarray(windows_s, dtype=np.float64)
    start, end = (windows - windows.min()).T
    span = float(end.max())
    middle, length = (start + end) / 2, end - start
    products = np.minimum.outer(middle, middle)  # the earlier window ends before the later one begins
    np.fill_diagonal(products, start + length / 3)
    with_mean = middle - (start**2 + start * end + end**2) / (6 * span)
    covariance: Array = products - with_mean[:, None] - with_mean[None, :] + span / 3
    return covariance


def flicker_covariance(windows_s: ArrayLike) -> Array:
    """Return the covariance (N, N) of the means of flicker noise of Allan deviation 1 over windows (N, 2) [start, end].

    Noise of power B²/(2π f) has the Allan deviation B √(2 ln 2/π) (IEEE Std 952-1997, C.1.3), so values a time τ apart
    have the covariance −ln(τ)/(2 ln 2), plus an infinite constant. The constant cancels if values are taken relative to
    the mean over the whole time from the first start to the last end.
    """
    windows = np.asarray(windows_s, dtype=np.float64)
    means = _flicker_means(np.vstack([windows, [windows.min(), windows.max()]]))
    covariance: Array = means[:-1, :-1] - means[:-1, -1:] - means[-1:, :-1] + means[-1, -1]
    return covariance


@cache
def flicker_harmonic_covariance() -> Array:
    """Return the covariance (3, 3) of mean, cosine and sine of a revolution for flicker noise of Allan deviation 1.

    The covariance does not depend on the revolution's duration, except for the mean's variance, which is 0 here because
    `flicker_covariance` contains it.
    """
    ends = np.linspace(0, 1, REVOLUTION_PARTS + 1)
    angle_rad = np.pi * (ends[:-1] + ends[1:])
    waves = np.stack([np.ones(REVOLUTION_PARTS), 2 * np.cos(angle_rad), 2 * np.sin(angle_rad)]) / REVOLUTION_PARTS
    covariance: Array = waves @ _flicker_means(np.stack([ends[:-1], ends[1:]], axis=1)) @ waves.T
    covariance[0, 0] = 0.0
    return covariance


def _flicker_means(windows_s: Array) -> Array:
    """Return the covariance (N, N) of `flicker_covariance`, without the infinite constant."""
    start, end = windows_s.T
    between = (
        _twice_integrated_logarithm(end[:, None] - start)
        - _twice_integrated_logarithm(start[:, None] - start)
        - _twice_integrated_logarithm(end[:, None] - end)
        + _twice_integrated_logarithm(start[:, None] - end)
    )
    covariance: Array = -between / np.outer(end - start, end - start) / (2 * np.log(2))
    return covariance


def _twice_integrated_logarithm(x: Array) -> Array:
    """Return the second antiderivative of ln |x|: x² (2 ln |x| − 3) / 4."""
    squares = x**2
    logarithms = np.log(squares, out=np.zeros_like(squares), where=squares > 0)
    integrated: Array = squares * (logarithms - 3) / 4
    return integrated


def _flicker(instability_rad_s: float, windows_s: ArrayLike) -> Array:
    """Return the covariance (N, N) of means over windows (N, 2) of flicker noise with the given Allan deviation."""
    covariance: Array = instability_rad_s**2 * flicker_covariance(windows_s)
    return covariance


def average_posterior(sizes: Array, likelihood: Array) -> Array:
    """Return the root-mean-square (2,) of random walk q and scatter s over the posterior of their `sizes` (K, 2).

    The most likely sizes are not used, because by chance they, and with them every uncertainty, may be far too small or
    too large. The prior is spike-and-slab, log-uniform in the slab (Mitchell and Beauchamp, J. Am. Stat. Assoc. 83
    (1988) 1023).
    """
    return _root_mean_square(sizes, likelihood - np.log(GRID_POINTS) * np.count_nonzero(sizes, axis=1))


def average_walks(sizes: Array, likelihood: Array) -> Array:
    """Return the root-mean-square (2,) of random walk and scatter over their posterior, if the walk's prior is uniform.

    The scatter has the prior of `average_posterior`. These averages are for parameters over a long time, such as slopes
    over temperature, whose uncertainty may come mostly from a walk that the readings hardly show. So a walk is assumed
    to exist, with a uniform prior (Gelman, Bayesian Analysis 1 (2006) 515). The `sizes` (K, 2) are on a geometric grid,
    so a size's prior is proportional to the step to the next size, that is, to the size itself.
    """
    log_posterior = likelihood - np.log(GRID_POINTS) * np.count_nonzero(sizes[:, 1:], axis=1)
    return _root_mean_square(sizes, log_posterior, prior=sizes[:, 0])


def _root_mean_square(sizes: Array, log_posterior: Array, prior: Array | float = 1.0) -> Array:
    """Return the root-mean-square (2,) of the `sizes` (K, 2), with weights exp(`log_posterior`) times `prior` (K,)."""
    weights = prior * np.exp(log_posterior - log_posterior.max())
    return np.asarray(np.sqrt(weights @ sizes**2 / weights.sum()), dtype=np.float64)


def select_by_akaike(sizes: Array, likelihood: Array) -> Array:
    """Return the random walk and scatter (2,), of all pairs in `sizes` (K, 2), with the least Akaike criterion.

    Each size that is not zero increases the criterion. So both are zero if noise alone explains the averages.
    """
    return np.asarray(sizes[np.argmax(likelihood - PARAMETER_COST * np.count_nonzero(sizes, axis=1))], dtype=np.float64)


def bias_process(
    design: ArrayLike,
    means_rad_s: ArrayLike,
    variances_rad2_s2: ArrayLike,
    windows_s: ArrayLike,
    shared_rad2_s2: Array | None = None,
    *,
    instability_rad_s: float = 0.0,
    chosen: Chosen = average_posterior,
) -> BiasProcess:
    """Return the bias drift that explains mean readings (N, 3) = `design` (N, p) × parameters + drift + noise.

    `variances_rad2_s2` (N, 3) are the variances of the noise, `windows_s` (N, 2) the averaging windows. The three axes
    share one process, because the averages are too few to determine three. `shared_rad2_s2` (3, N, N) are covariances
    between the averages in addition to their noise, `instability_rad_s` is the data sheet's bias instability, zero if
    unknown. `chosen` selects random walk and scatter by their likelihood.
    """
    z, means, variances = (np.asarray(a, dtype=np.float64) for a in (design, means_rad_s, variances_rad2_s2))
    dof = 3 * (len(z) - z.shape[1])
    if dof < 3:
        return BiasProcess(dof=max(dof, 0), instability_rad_s=instability_rad_s)
    free = np.linalg.qr(z, mode="complete")[0][:, z.shape[1] :].T  # contrasts, free of the parameters
    unit = walk_covariance(windows_s)
    flicker = _flicker(instability_rad_s, windows_s) if instability_rad_s else np.zeros(unit.shape)
    typical = float(median(variances.ravel()))
    grid = np.concatenate([[0.0], typical * np.geomspace(GRID_RATIO**-0.5, GRID_RATIO, GRID_POINTS) ** 2])
    walks = grid / float(median(np.diag(unit)))
    squares = np.column_stack([np.repeat(walks, len(grid)), np.tile(grid, len(walks))])
    likelihood = np.zeros(len(squares))
    for axis in range(3):
        noise = np.diag(variances[:, axis]) + flicker
        noise = noise if shared_rad2_s2 is None else noise + shared_rad2_s2[axis]
        covariances = free @ noise @ free.T + walks[:, None, None] * (free @ unit @ free.T)
        likelihood += _likelihood(free @ means[:, axis], covariances, grid).ravel()
    walk, scatter = chosen(np.sqrt(squares), likelihood).tolist()
    return BiasProcess(walk, scatter, dof, instability_rad_s)


def _likelihood(contrasts: Array, noise: Array, scatters: Array) -> Array:
    """Return log-likelihoods (K, L) of contrasts (n,), up to a constant, for K noise covariances and L scatters s².

    `noise` is (K, n, n). A scatter adds s² to every eigenvalue, so each covariance is decomposed only once.
    """
    values, vectors = np.linalg.eigh(noise)
    squares = np.square(contrasts @ vectors)[:, None]
    sizes = values[:, None] + scatters[:, None]
    likelihood: Array = -0.5 * np.sum(np.log(sizes) + squares / sizes, axis=-1)
    return likelihood
