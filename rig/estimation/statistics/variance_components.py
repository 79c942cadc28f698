"""A linear fit with variance components estimated from its residuals: restricted maximum likelihood of a mixed model.

    y = X θ + e,   cov e = (δ² A + σ² B) ⊗ 1₃,   θ_g ~ N(0, ψ_g²) for groups g of the columns

y are n vectors in space, A and B the covariances by two causes of error, isotropic each. The standard deviations δ, σ,
ψ maximise the likelihood of y with θ integrated out (Patterson and Thompson, Biometrika 58 (1971) 545; Harville, J. Am.
Stat. Assoc. 72 (1977) 320). One generalised eigendecomposition diagonalises A and B together, so that a trial of other
values only weights the rows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, coverage_factors

SPREAD = 4.0  # prior std of ln size: a factor of 50 either way
STEP = 0.25  # of ln size, for numerical derivatives
TRIALS = 300
FEWEST_FREEDOM = 3.0  # below, Student's t hardly has a variance


@dataclass(frozen=True, slots=True)
class Mixed:
    """`observed` (n, 3), `design` (n, 3, p), A `scattered` and B `walked` (n, n), B positive definite.

    `precision` (p,): the prior precision of each column's coefficient, 0 if none; `groups` of columns whose
    coefficients have a common prior of unknown variance.
    """

    observed: Array
    design: Array
    scattered: Array
    walked: Array
    precision: Array
    groups: tuple[NDArray[np.intp], ...]


@dataclass(frozen=True, slots=True)
class VarianceComponents:
    """The standard deviations δ, σ, and ψ of every group."""

    scattered: float
    walked: float
    groups: tuple[float, ...]

    def logarithms(self) -> Array:
        """Return the logarithms (2 + groups,) of the standard deviations."""
        return np.asarray(np.log([self.scattered, self.walked, *self.groups]), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class MixedFit:
    """θ (p,) with its `covariance` (p, p), the log-likelihood, and `residuals` (n, 3)."""

    theta: Array
    covariance: Array
    likelihood: float
    residuals: Array


class MixedModel:
    """A `Mixed` with A and B diagonalised."""

    def __init__(self, mixed: Mixed) -> None:
        from scipy.linalg import eigh

        self.mixed = mixed
        spread, rotation = eigh(mixed.scattered, mixed.walked)
        self._spread = np.maximum(spread, 0.0)  # of A, if B is the identity
        count, _, columns = mixed.design.shape
        self._design = (rotation.T @ mixed.design.reshape(count, -1)).reshape(count, 3, columns)
        self._observed = rotation.T @ mixed.observed

    def solve(self, sizes: VarianceComponents) -> MixedFit:
        """Return θ for given variance components."""
        theta, covariance, likelihood = self._fit(sizes)
        return MixedFit(theta, covariance, likelihood, self.mixed.observed - self.mixed.design @ theta)

    def causes(self, sizes: VarianceComponents, covariance: Array) -> tuple[Array, Array]:
        """Return the parts of θ's `covariance` (p, p) by δ and by σ; the remainder is due to the prior of θ."""
        variances = sizes.scattered**2 * self._spread + sizes.walked**2
        columns = self._design.shape[2]

        def propagate(part: Array) -> Array:
            design = (self._design * (np.sqrt(part) / variances)[:, None, None]).reshape(-1, columns)
            effect = covariance @ design.T
            return np.asarray(effect @ effect.T, dtype=np.float64)

        return propagate(sizes.scattered**2 * self._spread), propagate(np.full_like(variances, sizes.walked**2))

    def dof(self, sizes: VarianceComponents, wanted: Array) -> Array:
        """Return the degrees of freedom (q,) of the variances of `wanted` (q, p) combinations of θ.

        ½ (u/Δu)² of JCGM 100, G.4.2, with Δu from the curvature of the log-likelihood at its maximum (Satterthwaite):
        variance components by few residuals are themselves uncertain.
        """
        middle = sizes.logarithms()
        steps = STEP * np.eye(len(middle))

        def evaluate(logarithms: Array) -> tuple[float, Array]:
            _, covariance, likelihood = self._fit(_sizes(logarithms))
            return likelihood, np.log(np.einsum("qi,ij,qj->q", wanted, covariance, wanted))

        neighbours = [[evaluate(middle + sign * step) for sign in (1, -1)] for step in steps]
        slopes = np.array([(up[1] - down[1]) / (2 * STEP) for up, down in neighbours])
        curvature = np.eye(len(middle)) / SPREAD**2
        top = evaluate(middle)[0]
        for i, (up, down) in enumerate(neighbours):
            curvature[i, i] -= (up[0] + down[0] - 2 * top) / STEP**2
            for j in range(i):
                corners = [evaluate(middle + a * steps[i] + b * steps[j])[0] * a * b for a in (1, -1) for b in (1, -1)]
                curvature[i, j] = curvature[j, i] = curvature[i, j] - sum(corners) / (4 * STEP**2)
        values, directions = np.linalg.eigh(curvature)
        variances = (directions.T @ slopes) ** 2 / np.maximum(values, SPREAD**-2)[:, None]
        dof: Array = 2 / np.maximum(variances.sum(axis=0), 1e-9)
        return dof

    def estimate_components(
        self, expected: VarianceComponents, spread: Array | float = SPREAD, start: VarianceComponents | None = None
    ) -> VarianceComponents:
        """Return the variance components of maximum posterior probability, with log-normal priors about `expected`.

        `spread` is the prior standard deviation of their logarithms; `start` is the first iterate, if not `expected`.
        """
        from scipy.optimize import minimize

        middle = expected.logarithms()
        begin, reach = (middle, 1.5) if start is None else (start.logarithms(), 0.3)

        def negative_log_posterior(logarithms: Array) -> float:
            penalty = float(np.sum(((logarithms - middle) / spread) ** 2)) / 2
            try:
                return penalty - self._factorise(_sizes(logarithms))[2]
            except np.linalg.LinAlgError:  # ratios so large that rounding dominates
                return float("inf")

        simplex = np.vstack([begin, begin + reach * np.eye(len(begin)) * np.where(np.arange(len(begin)) % 2, 1, -1)])
        optimum = minimize(
            negative_log_posterior,
            begin,
            method="Nelder-Mead",
            options={"maxfev": TRIALS, "xatol": 0.05, "fatol": 0.02, "initial_simplex": simplex},
        )
        return _sizes(np.asarray(optimum.x, dtype=np.float64))

    def _fit(self, sizes: VarianceComponents) -> tuple[Array, Array, float]:
        """Return θ (p,), its covariance (p, p) and the log-likelihood."""
        lower, projection, likelihood = self._factorise(sizes)
        inverse = np.linalg.inv(lower)
        return inverse.T @ projection, inverse.T @ inverse, likelihood

    def _factorise(self, sizes: VarianceComponents) -> tuple[Array, Array, float]:
        """Return L (p, p) of the information L Lᵀ, L⁻¹ Xᵀ y (p,), both of whitened rows, and the log-likelihood."""
        from scipy.linalg import solve_triangular

        columns = self._design.shape[2]
        variances = sizes.scattered**2 * self._spread + sizes.walked**2
        weights = 1 / np.sqrt(variances)[:, None]
        design = (self._design * weights[..., None]).reshape(-1, columns)
        observed = (self._observed * weights).reshape(-1)
        precision = self.mixed.precision.copy()
        log_prior = 0.0
        for group, size in zip(self.mixed.groups, sizes.groups, strict=True):
            precision[group] = size**-2.0
            log_prior -= 2 * len(group) * np.log(size)
        information = design.T @ design + np.diag(precision)
        unit = 1 / np.sqrt(np.diag(information))
        lower = np.linalg.cholesky(information * unit[:, None] * unit) / unit[:, None]
        projection = solve_triangular(lower, observed @ design, lower=True, check_finite=False)
        square = float(observed @ observed - projection @ projection)
        determinant = 2 * float(np.sum(np.log(np.diag(lower))))
        return (
            lower,
            projection,
            -0.5 * (3 * float(np.sum(np.log(variances))) + determinant - log_prior + square),
        )


def inflate_to_student(covariance: Array, dof: Array) -> Array:
    """Return a covariance (q, q) inflated to that of Student's t of `dof` (q,), so that two stds contain 95 %.

    The variance of t is ν/(ν − 2), and infinite below ν = 2: there t's coverage factor is used (JCGM 100, G.3).
    """
    bounded = np.maximum(dof, FEWEST_FREEDOM)
    by_coverage = coverage_factors(np.clip(dof, 1.0, FEWEST_FREEDOM)) / COVERAGE_FACTOR
    ratio = np.where(dof >= FEWEST_FREEDOM, np.sqrt(bounded / (bounded - 2)), by_coverage)
    inflated: Array = covariance * ratio[:, None] * ratio
    return inflated


def _sizes(logarithms: Sequence[float] | Array) -> VarianceComponents:
    """Return the variance components by their logarithms."""
    first, second, *groups = np.exp(np.clip(logarithms, -60, 30)).tolist()
    return VarianceComponents(first, second, tuple(groups))
