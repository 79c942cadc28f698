"""Errors of the axes about which a reference turns the body, such as an arm's joints with wrong zeros.

An inclination δ of such an axis always changes the stated rate ω by δ × ω. If the body turns about few axes, this looks
like a matrix F with other angles between its axes, and with other scale factors where the axes of motion are not
orthogonal. The residuals then do not show it. So F is estimated without δ, and its uncertainty includes the effect of δ
on the estimate (JCGM 100, F.2.4.5), averaged over the posterior distribution of the size of δ.
"""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array, rotation_vectors
from rig.estimation.external.attitude_drift import MATRIX, FixedAttitudes, Fixes, correlate_effects, matern
from rig.estimation.statistics.variance_components import MixedFit, MixedModel, find_half_width

PRIOR_MEDIAN_RAD = 5e-3  # of the half-Cauchy prior of the inclinations' standard deviation
CORRELATION_SINE = 0.5  # of the angle between two axes: those within about this angle are inclined alike
STD_RATIOS = np.geomspace(1e-6, 20, 120)  # grid, over the prior's median: no inclination exceeds 0.1 rad
MIN_RESPONSE_RATIO = 0.05  # to the largest response: smaller ones are the noise of the axes
MIN_INFORMATION_FRACTION = 0.05  # that the residuals keep: F imitates an inclination with less
MIN_ROTATION_RAD2 = 1e-14  # sum of a fix's squared rotations: less is rounding


@dataclass(frozen=True, slots=True)
class Inclinations:
    """Inclinations of a reference's axes of motion.

    - `response` (m, r): the change of the m components of all increments by r independent inclinations of 1 rad.
    - `prior_median_rad`: the prior median of the inclinations' standard deviation.
    """

    response: Array
    prior_median_rad: float

    def widen(self, model: MixedModel, std: Array, fit: MixedFit, wanted: Array, variances: Array) -> Array:
        """Return the covariance (q, q) that inclinations add to `wanted` (q, p) combinations of the parameters.

        Only inclinations that the residuals do not show are added; the others are part of the model's errors. The
        model's errors have standard deviations `std` (k,) and give the combinations the `variances` (q,). With the
        added variance, two standard deviations are the half-width of the 95.45 % interval.
        """
        from scipy.linalg import cho_factor, cho_solve

        factor, design = cho_factor(model.covariance(std), lower=True), model.mixed.design
        weighted = cho_solve(factor, self.response)
        onto_theta = fit.covariance @ (design.T @ weighted)
        unexplained = weighted - cho_solve(factor, design) @ onto_theta  # P H, with P of the restricted likelihood
        information = self.response.T @ unexplained
        values, directions = np.linalg.eigh((information + information.T) / 2)
        whole = np.einsum("ij,ik,kj->j", directions, self.response.T @ weighted, directions)
        identified = values > MIN_INFORMATION_FRACTION * whole
        scores = directions.T @ (unexplained.T @ model.mixed.observed)
        sizes_rad = self.prior_median_rad * STD_RATIOS
        probabilities = _weigh_sizes(sizes_rad, values[identified], scores[identified])
        response = wanted @ onto_theta @ directions[:, ~identified]
        added = np.sum(response**2, axis=1)
        mixture = variances + np.square(sizes_rad)[:, None] * added
        half_width = find_half_width(np.zeros_like(mixture), mixture, probabilities)
        size = np.sqrt(np.maximum(half_width**2 / 4 - variances, 0.0) / np.maximum(added, np.finfo(float).tiny))
        return np.asarray(size[:, None] * (response @ response.T) * size, dtype=np.float64)


def _weigh_sizes(sizes_rad: Array, values: Array, scores: Array) -> Array:
    """Return the probabilities (j,) of `sizes_rad`, standard deviations of the inclinations: prior times likelihood.

    The restricted likelihood is a product with one factor for each of r eigenvectors of the information about the
    inclinations. `values` (r,) are their eigenvalues, `scores` (r,) the likelihood's derivatives along them. All other
    errors keep their sizes.
    """
    variances = np.square(sizes_rad)[:, None]
    ratio = 1 + variances * values
    likelihood = 0.5 * np.sum(variances * scores**2 / ratio - np.log(ratio), axis=1)
    relative = np.log(STD_RATIOS)
    logarithms = likelihood + relative - np.logaddexp(0, 2 * relative)
    probabilities = np.exp(logarithms - logarithms.max())
    return np.asarray(probabilities / probabilities.sum(), dtype=np.float64)


def find_inclinations(averaged: FixedAttitudes, fixes: Fixes, matrix: Array) -> Inclinations:
    """Return the inclinations of the axes about which the body turned between fixes, for a gyroscope with `matrix`.

    Inclinations vary smoothly with the axis in body coordinates: their correlation is Matérn's function, ν = 3/2, of
    the distance between the axes.
    """
    joined = np.flatnonzero(fixes.joined)
    cross_products = np.array([np.cross(np.eye(3), -axis) for axis in np.eye(3)])
    changes = (matrix @ cross_products).reshape(3, 9)  # F changes so by an inclination δ = 1 about x, y, z: F (δ × ω)
    sensitivities = np.diff(averaged.sensitivities[..., MATRIX], axis=0)[joined]
    moments = _find_moments(fixes)
    between = moments[joined] + moments[joined + 1]
    axes = between / (between[:, ::4].sum(axis=1, keepdims=True) + MIN_ROTATION_RAD2)
    correlation = matern(np.linalg.norm(axes[:, None] - axes, axis=2) / np.sqrt(2), CORRELATION_SINE)
    values, vectors = np.linalg.eigh(correlate_effects(sensitivities @ changes.T, correlation))
    explained = values > MIN_RESPONSE_RATIO**2 * values[-1]
    stated_rad = fixes.stated_std_rad
    prior_median_rad = PRIOR_MEDIAN_RAD if stated_rad is None else min(PRIOR_MEDIAN_RAD, stated_rad)
    return Inclinations(vectors[:, explained] * np.sqrt(values[explained]), prior_median_rad)


def _find_moments(fixes: Fixes) -> Array:
    """Return for each fix the sum Σ v vᵀ (N, 9), a flattened (3, 3) matrix, over the fix's samples.

    v is the rotation vector, in body coordinates, from a sample to the next one.
    """
    turns = rotation_vectors(np.swapaxes(fixes.attitudes[:-1], -1, -2) @ fixes.attitudes[1:])
    turns = np.concatenate([turns, turns[-1:]])
    moments = np.zeros((len(fixes.placement), 9))
    np.add.at(moments, fixes.fix, (turns[:, :, None] * turns[:, None, :]).reshape(-1, 9))
    return moments
