"""Errors of the motion that is stated of sweeps, found from what the sweeps contradict each other by.

    m_j = F ω_j + c + F (ω̂_j ω̂_jᵀ ε_j + (1 − ω̂_j ω̂_jᵀ) η_j) ‖ω_j‖ + noise,   ε_j ~ N(0, ρ²), η_j ~ N(0, α² 1₃)

ρ is by how much of its rate a sweep may be off, α the angle by which its axis leans: random effects of unknown size.
Few sweeps determine a size badly. The likeliest is often zero, and U by it holds the true value 60 to 85 times in 100.
So every pair of sizes counts by its restricted likelihood (Harville, J. Am. Stat. Assoc. 72 (1977) 320) and a stated
prior: log-uniform from a tenth of the noise, below which a size changes nothing, to `PRIOR_KNEE`; beyond, it falls as
1/size. If the sweeps tell the size, U becomes that of Student's t for the sweeps that are more than the solution takes
(Box and Tiao, Bayesian Inference in Statistical Analysis, 1973, 5.2; Gelman, Bayesian Analysis 1 (2006) 515).
"""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array, perpendicular_unit_vectors
from rig.estimation.statistics.coverage import PROBABILITY

SMALLEST_OF_NOISE = 0.1  # of a sweep's noise: a smaller size adds half a percent to it
PRIOR_KNEE, LARGEST = 1e-2, 0.1  # of the rate, and rad: no table is farther off
SIZES = 20  # of each kind
BISECTIONS = 30


@dataclass(frozen=True, slots=True)
class StatedMotion:
    """Mean readings of sweeps and rests, and the motion that is stated of them.

    `residuals_rad_s` (N, 3): readings less the model's; `rates_rad_s` (N, 3), zero for a rest; `variances_rad2_s2`
    (N, 3) of the noise of each mean. `rate_patterns` (N, 3): the errors of the readings by a rate that is off by its
    whole size; `axis_patterns` (2, N, 3): by axes that lean by 1 rad about either direction across them.
    """

    residuals_rad_s: Array
    rates_rad_s: Array
    variances_rad2_s2: Array
    rate_patterns: Array
    axis_patterns: Array

    @staticmethod
    def of(residuals_rad_s: Array, rates_rad_s: Array, variances_rad2_s2: Array, matrix: Array) -> "StatedMotion":
        """Return the motion with the patterns of its errors in a gyroscope of that `matrix` F (3, 3)."""
        speeds = np.linalg.norm(rates_rad_s, axis=1)
        leaning = np.zeros((2, *rates_rad_s.shape))
        for row in np.flatnonzero(speeds):
            leaning[:, row] = speeds[row] * perpendicular_unit_vectors(rates_rad_s[row] / speeds[row])
        return StatedMotion(residuals_rad_s, rates_rad_s, variances_rad2_s2, rates_rad_s @ matrix.T, leaning @ matrix.T)

    @property
    def relative_noise(self) -> float:
        """The noise of a sweep's mean as a fraction of its rate, the median of all sweeps."""
        turned = np.linalg.norm(self.rate_patterns, axis=1)
        swept = turned > 0
        noise = np.sqrt(self.variances_rad2_s2.mean(axis=1))
        return float(np.median(noise[swept] / turned[swept]))


@dataclass(frozen=True, slots=True)
class MotionErrors:
    """The sizes that errors of the stated motion may have.

    `rate` and `axis_rad` (G,) are pairs of sizes, `weights` (G,) how likely each pair is; they add up to 1.
    """

    rate: Array
    axis_rad: Array
    weights: Array

    @property
    def median_variances(self) -> tuple[float, float]:
        """The squares of either size that are as likely exceeded as not."""
        return _median(self.rate**2, self.weights), _median(self.axis_rad**2, self.weights)

    def expanded(self, known: Array, of_rate: Array, of_axis: Array) -> Array:
        """Return the U (q,) of values whose errors are normal for each pair of sizes, at 95.45 %.

        `known` (q,) are the variances that depend on no size, `of_rate` and `of_axis` (q,) those per unit of a size.
        """
        from scipy.special import ndtr

        likely = self.weights > 1e-5 * self.weights.max()
        weights = self.weights[likely] / self.weights[likely].sum()
        sizes = np.column_stack([np.ones(likely.sum()), self.rate[likely] ** 2, self.axis_rad[likely] ** 2])
        std = np.sqrt(sizes @ np.array([known, of_rate, of_axis]))
        low, high = np.zeros(len(known)), 10 * std.max(axis=0)
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            outside = weights @ (2 * ndtr(-middle / std))
            low, high = (
                np.where(outside > 1 - PROBABILITY, middle, low),
                np.where(outside > 1 - PROBABILITY, high, middle),
            )
        expanded: Array = high
        return expanded


def motion_errors(seen: StatedMotion) -> MotionErrors:
    """Return the sizes of the errors that the stated motion may have, by the residuals of sweeps and rests."""
    smallest = min(SMALLEST_OF_NOISE * seen.relative_noise, LARGEST / 10)
    sizes = np.geomspace(smallest, LARGEST, SIZES)
    prior = -np.log(np.maximum(sizes / PRIOR_KNEE, 1.0))
    logarithms = prior[:, None] + prior + np.array([_likelihoods(seen, axis_rad, sizes) for axis_rad in sizes])
    weights = np.exp(logarithms - logarithms.max())
    return MotionErrors(
        rate=np.tile(sizes, SIZES), axis_rad=np.repeat(sizes, SIZES), weights=weights.ravel() / weights.sum()
    )


def _likelihoods(seen: StatedMotion, axis_rad: float, rates: Array) -> Array:
    """Return the logarithms (k,) of the restricted likelihood for one size of axis errors and several `rates` (k,).

    An error of the rate changes the covariance of a sweep by one dyad, so each inverse is that without it and a dyad
    more (Sherman and Morrison).
    """
    leaning = np.moveaxis(seen.axis_patterns, 0, 2)  # (N, 3, 2)
    precision = np.linalg.inv(
        seen.variances_rad2_s2[:, :, None] * np.eye(3) + axis_rad**2 * leaning @ np.swapaxes(leaning, 1, 2)
    )
    design = np.column_stack([seen.rates_rad_s, np.ones(len(seen.rates_rad_s))])
    design = design / np.linalg.norm(design, axis=0)
    count, columns = design.shape
    parameters = 3 * columns
    weighted = (precision @ seen.rate_patterns[..., None])[..., 0]
    of_rate = np.sum(seen.rate_patterns * weighted, axis=1)  # of a sweep: the square of its rate's error over its noise
    gains = (weighted[:, :, None] * design[:, None, :]).reshape(count, parameters)
    products = (design[:, :, None] * design[:, None, :]).reshape(count, -1)
    blocks = (precision.reshape(count, 9).T @ products).reshape(3, 3, columns, columns)
    information = np.swapaxes(blocks, 1, 2).reshape(parameters, parameters)
    whitened = (precision @ seen.residuals_rad_s[..., None])[..., 0]
    observed = (whitened.T @ design).ravel()
    misfit = np.sum(seen.residuals_rad_s * whitened)
    along = np.sum(weighted * seen.residuals_rad_s, axis=1)

    variances = rates[:, None] ** 2 * np.ones(count)  # (k, N)
    taken = variances / (1 + variances * of_rate)
    dyads = (gains[:, :, None] * gains[:, None, :]).reshape(count, -1)
    informations = information - (taken @ dyads).reshape(-1, parameters, parameters)
    observations = observed - (taken * along) @ gains
    misfits = misfit - taken @ along**2
    unit = 1 / np.sqrt(np.einsum("kaa->ka", informations))
    scaled = unit[:, :, None] * informations * unit[:, None, :]
    fitted = np.linalg.solve(scaled, (unit * observations)[..., None])[..., 0]
    explained = np.einsum("ka,ka->k", unit * observations, fitted)
    determinants = -np.linalg.slogdet(precision)[1].sum() + np.log1p(variances * of_rate).sum(axis=1)
    of_design = np.linalg.slogdet(scaled)[1] - 2 * np.log(unit).sum(axis=1)
    likelihoods: Array = -0.5 * (determinants + of_design + misfits - explained)
    return likelihoods


def _median(values: Array, weights: Array) -> float:
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(weights[order]), 0.5)])
