"""Random errors of the stated motion of sweeps, estimated from their residuals.

    m_j = F ω_j + c + F (ω̂_j ε_j + (I − ω̂_j ω̂_jᵀ) η_j) ‖ω_j‖ + noise,   ε_j ~ N(0, ρ²), η_j ~ N(0, α² I)

ω_j is the stated rate of sweep j and ω̂_j its unit vector. ε_j is the relative error of the rate and η_j the tilt of
the axis; their standard deviations ρ and α are unknown. Few sweeps determine a variance badly: the restricted maximum
likelihood estimate is often zero, and a U computed from it covers the true value in only 60 to 85 of 100 cases. So the
result averages over all pairs (ρ, α), weighted by the restricted likelihood (Harville, J. Am. Stat. Assoc. 72 (1977)
320) and a prior. The prior is log-uniform from a tenth of the noise, below which ρ and α change nothing, to
`PRIOR_KNEE_ERROR`; above this, its density over ln ρ falls as 1/ρ, and that over ln α as 1/α. If the sweeps determine ρ
and α, U approaches that of Student's t with the dof of the redundant sweeps (Box and Tiao, Bayesian Inference in
Statistical Analysis, 1973, 5.2; Gelman, Bayesian Analysis 1 (2006) 515).
"""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array, bisect, perpendicular_unit_vectors
from rig.estimation.statistics.coverage import PROBABILITY

MIN_NOISE_RATIO = 0.1  # of an error to a sweep's noise, which it increases by half a percent
PRIOR_KNEE_ERROR, MAX_ERROR = 1e-2, 0.1  # of the rate (relative) or axis (rad): no rate table is worse than the second
GRID_POINTS = 20  # for each kind of error


@dataclass(frozen=True, slots=True)
class StatedMotion:
    """Mean readings of sweeps and rests, and their stated motion.

    - `residuals_rad_s` (N, 3): readings minus those of the model.
    - `rates_rad_s` (N, 3): the stated rates, zero for a rest.
    - `variances_rad2_s2` (N, 3): the variances of the means due to noise.
    - `rate_patterns` (N, 3): the effects on the readings of a relative rate error of 1.
    - `axis_patterns` (2, N, 3): the effects on the readings of an axis that is tilted by 1 rad, about each of two
      directions perpendicular to the axis.
    """

    residuals_rad_s: Array
    rates_rad_s: Array
    variances_rad2_s2: Array
    rate_patterns: Array
    axis_patterns: Array

    @staticmethod
    def from_residuals(
        residuals_rad_s: Array, rates_rad_s: Array, variances_rad2_s2: Array, matrix: Array
    ) -> "StatedMotion":
        """Return the stated motion, with the effects of its errors on a gyroscope that has this `matrix` (3, 3)."""
        speeds = np.linalg.norm(rates_rad_s, axis=1)
        tilts = np.zeros((2, *rates_rad_s.shape))
        for row in np.flatnonzero(speeds):
            tilts[:, row] = speeds[row] * perpendicular_unit_vectors(rates_rad_s[row] / speeds[row])
        return StatedMotion(residuals_rad_s, rates_rad_s, variances_rad2_s2, rates_rad_s @ matrix.T, tilts @ matrix.T)

    @property
    def relative_noise(self) -> float:
        """The noise of a sweep's mean as a fraction of the sweep's rate, median over all sweeps."""
        sizes = np.linalg.norm(self.rate_patterns, axis=1)
        swept = sizes > 0
        noise = np.sqrt(self.variances_rad2_s2.mean(axis=1))
        return float(np.median(noise[swept] / sizes[swept]))


@dataclass(frozen=True, slots=True)
class MotionErrors:
    """The posterior distribution of the standard deviations of two errors of the stated motion.

    `rate` (G,), the relative error of rates, and `axis_rad` (G,), the tilt of axes, are pairs of standard deviations;
    `weights` (G,) are the posterior probabilities of the pairs.
    """

    rate: Array
    axis_rad: Array
    weights: Array

    @property
    def median_variances(self) -> tuple[float, float]:
        """The squares of the posterior medians of `rate` and `axis_rad`."""
        return _median(self.rate**2, self.weights), _median(self.axis_rad**2, self.weights)

    def expanded(self, fixed: Array, of_rate: Array, of_axis: Array) -> Array:
        """Return the expanded uncertainties U (q,), at 95.45 %, of q values with normal distributions.

        The probability is averaged over the pairs of standard deviations with their `weights`. `fixed` (q,) are the
        variances that do not depend on the pair, `of_rate` and `of_axis` (q,) those for `rate` = 1 and `axis_rad` = 1.
        """
        from scipy.special import ndtr

        likely = self.weights > 1e-5 * self.weights.max()
        weights = self.weights[likely] / self.weights[likely].sum()
        sizes = np.column_stack([np.ones(likely.sum()), self.rate[likely] ** 2, self.axis_rad[likely] ** 2])
        std = np.sqrt(sizes @ np.array([fixed, of_rate, of_axis]))

        def is_too_small(expanded: Array) -> Array:
            outside: Array = weights @ (2 * ndtr(-expanded / std)) > 1 - PROBABILITY
            return outside

        return bisect(is_too_small, 10 * std.max(axis=0))


def motion_errors(motion: StatedMotion) -> MotionErrors:
    """Return the posterior distribution of the stds ρ and α, from the residuals of sweeps and rests."""
    smallest = min(MIN_NOISE_RATIO * motion.relative_noise, MAX_ERROR / 10)
    sizes = np.geomspace(smallest, MAX_ERROR, GRID_POINTS)
    prior = -np.log(np.maximum(sizes / PRIOR_KNEE_ERROR, 1.0))
    logarithms = prior[:, None] + prior + np.array([_likelihoods(motion, axis_rad, sizes) for axis_rad in sizes])
    weights = np.exp(logarithms - logarithms.max())
    return MotionErrors(
        rate=np.tile(sizes, GRID_POINTS),
        axis_rad=np.repeat(sizes, GRID_POINTS),
        weights=weights.ravel() / weights.sum(),
    )


def _likelihoods(motion: StatedMotion, axis_rad: float, rates: Array) -> Array:
    """Return restricted log-likelihoods (k,) if rate errors have stds `rates` (k,), and axis errors the std `axis_rad`.

    A rate error changes the covariance of a sweep by one dyad, so each inverse has a rank-one update (Sherman and
    Morrison, Ann. Math. Stat. 21 (1950) 124).
    """
    tilts = np.moveaxis(motion.axis_patterns, 0, 2)  # (N, 3, 2)
    precision = np.linalg.inv(
        motion.variances_rad2_s2[:, :, None] * np.eye(3) + axis_rad**2 * tilts @ np.swapaxes(tilts, 1, 2)
    )
    design = np.column_stack([motion.rates_rad_s, np.ones(len(motion.rates_rad_s))])
    design = design / np.linalg.norm(design, axis=0)
    count, columns = design.shape
    parameters = 3 * columns
    weighted = (precision @ motion.rate_patterns[..., None])[..., 0]  # V⁻¹ d, d being the effect of a rate error
    of_rate = np.sum(motion.rate_patterns * weighted, axis=1)  # for each sweep: its squared rate error over its noise
    gains = (weighted[:, :, None] * design[:, None, :]).reshape(count, parameters)  # XᵀV⁻¹ d of each sweep
    products = (design[:, :, None] * design[:, None, :]).reshape(count, -1)
    blocks = (precision.reshape(count, 9).T @ products).reshape(3, 3, columns, columns)
    information = np.swapaxes(blocks, 1, 2).reshape(parameters, parameters)  # XᵀV⁻¹ X
    whitened = (precision @ motion.residuals_rad_s[..., None])[..., 0]
    observed = (whitened.T @ design).ravel()  # XᵀV⁻¹ r of the residuals r
    misfit = np.sum(motion.residuals_rad_s * whitened)  # rᵀV⁻¹ r
    projected = np.sum(weighted * motion.residuals_rad_s, axis=1)  # dᵀV⁻¹ r of each sweep

    variances = rates[:, None] ** 2 * np.ones(count)  # (k, N)
    updates = variances / (1 + variances * of_rate)  # (V + ρ² d dᵀ)⁻¹ = V⁻¹ − update · V⁻¹ d dᵀ V⁻¹
    dyads = (gains[:, :, None] * gains[:, None, :]).reshape(count, -1)
    informations = information - (updates @ dyads).reshape(-1, parameters, parameters)
    observations = observed - (updates * projected) @ gains
    misfits = misfit - updates @ projected**2
    unit = 1 / np.sqrt(np.einsum("kaa->ka", informations))  # scaled to a unit diagonal against rounding
    scaled = unit[:, :, None] * informations * unit[:, None, :]
    fitted = np.linalg.solve(scaled, (unit * observations)[..., None])[..., 0]
    explained = np.einsum("ka,ka->k", unit * observations, fitted)
    determinants = -np.linalg.slogdet(precision)[1].sum() + np.log1p(variances * of_rate).sum(axis=1)
    of_design = np.linalg.slogdet(scaled)[1] - 2 * np.log(unit).sum(axis=1)
    likelihoods: Array = -0.5 * (determinants + of_design + misfits - explained)
    return likelihoods


def _median(values: Array, weights: Array) -> float:
    """Return the weighted median of values (G,)."""
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(weights[order]), 0.5)])
