"""A linear fit with variance components estimated from its residuals: restricted maximum likelihood of a mixed model.

    y = X θ + e,   cov e = C₀ + Σ σ_k² A_k

The standard deviations σ_k have the likelihood of y with θ integrated out (Patterson and Thompson, Biometrika 58 (1971)
545; Harville, J. Am. Stat. Assoc. 72 (1977) 320) and half-Cauchy priors (Gelman, Bayesian Analysis 1 (2006) 515). A few
residuals hardly determine them, so the uncertainty of θ is that over all σ_k, each as likely as the data make it: by
adaptive importance sampling (JCGM 101, 6.4.9).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array, bisect
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, PROBABILITY

DRAWS, ROUNDS, TAILS = 40, 3, 5.0  # samples of a round of importance sampling; dof of the t that proposes them
FLOOR, LEAST_POWER = 0.02, 0.05  # of the variance of a proposal; of the power that evens out weights
STEP = 0.1  # of ln σ, for the curvature at the maximum
LEAST_CURVATURE = 0.1  # of the negative log-posterior over (ln σ)²: the priors have about this themselves
RANGE = 30.0  # of ln σ about its prior scale, either way
TOLERANCE = 1e-3  # of the log-posterior
MOST_STEPS = 60


@dataclass(frozen=True, slots=True)
class Mixed:
    """`observed` (m,), `design` (m, p), C₀ `fixed` (m, m) and A_k `components` (k, m, m).

    `precision` (p,): the prior precision of each column's coefficient, 0 if none. `scales` (k,): the medians of the
    half-Cauchy priors of σ.
    """

    observed: Array
    design: Array
    fixed: Array
    components: Array
    precision: Array
    scales: Array


@dataclass(frozen=True, slots=True)
class MixedFit:
    """θ (p,) with its `covariance` (p, p), the log-likelihood, and `residuals` (m,)."""

    theta: Array
    covariance: Array
    likelihood: float
    residuals: Array


class MixedModel:
    """A `Mixed` with its likelihood."""

    def __init__(self, mixed: Mixed) -> None:
        self.mixed = mixed
        self._flat = mixed.components.reshape(len(mixed.components), -1)

    def covariance(self, std: Array) -> Array:
        """Return the covariance (m, m) of the errors for standard deviations (k,)."""
        total: Array = self.mixed.fixed + (np.square(std) @ self._flat).reshape(self.mixed.fixed.shape)
        return total

    def solve(self, std: Array) -> MixedFit:
        """Return θ for given standard deviations (k,). Raise LinAlgError if the equations are singular."""
        _, design, observed, information, likelihood = self._whiten(std)
        covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
        theta = covariance @ (design.T @ observed)
        return MixedFit(theta, covariance, likelihood, self.mixed.observed - self.mixed.design @ theta)

    def estimate(self, start: Array | None = None) -> Array:
        """Return the standard deviations (k,) of maximum posterior probability."""
        from scipy.optimize import minimize

        middle = np.log(self.mixed.scales)
        optimum = minimize(
            self._evaluate,
            middle if start is None else np.log(start),
            jac=True,
            method="L-BFGS-B",
            bounds=[(value - RANGE, value + RANGE) for value in middle],
            options={"ftol": 1e-7, "gtol": 1e-2, "maxiter": MOST_STEPS},
        )
        return np.asarray(np.exp(optimum.x), dtype=np.float64)

    def causes(self, std: Array, fit: MixedFit) -> list[Array]:
        """Return the parts (p, p) of θ's covariance by C₀, each component, and the prior of θ."""
        from scipy.linalg import cho_factor, cho_solve

        factor = cho_factor(self.covariance(std), lower=True)
        weights = cho_solve(factor, self.mixed.design) @ fit.covariance
        parts = [self.mixed.fixed, *(np.square(std)[:, None, None] * self.mixed.components)]
        return [
            *(weights.T @ part @ weights for part in parts),
            fit.covariance * self.mixed.precision @ fit.covariance,
        ]

    def expand(self, std: Array, wanted: Array) -> Array:
        """Return the half-widths (q,) of 95.45 % intervals of `wanted` (q, p) combinations of θ about their estimates.

        The estimates are those for `std` (k,), the intervals those over all standard deviations.
        """
        top = wanted @ self.solve(std).theta
        offsets, variances = [], []

        def evaluate(logarithms: Array) -> float:
            try:
                fit = self.solve(np.exp(logarithms))
            except np.linalg.LinAlgError:
                offsets.append(np.zeros_like(top))
                variances.append(np.ones_like(top))
                return -np.inf
            offsets.append(wanted @ fit.theta - top)
            variances.append(np.einsum("qi,ij,qj->q", wanted, fit.covariance, wanted))
            return fit.likelihood + self._log_prior(logarithms)

        middle = np.log(std)
        weights = sample_adaptively(evaluate, middle, self._curvature(middle))
        return _find_half_width(np.array(offsets), np.array(variances), weights)

    def _whiten(self, std: Array) -> tuple[Array, Array, Array, Array, float]:
        """Return L of the covariance L Lᵀ, the whitened design and observed, the information, the log-likelihood."""
        from scipy.linalg import solve_triangular

        mixed = self.mixed
        lower = np.asarray(np.linalg.cholesky(self.covariance(std)), dtype=np.float64)
        both = solve_triangular(lower, np.column_stack([mixed.design, mixed.observed]), lower=True, check_finite=False)
        design, observed = both[:, :-1], both[:, -1]
        information = design.T @ design + np.diag(mixed.precision)
        unit = 1 / np.sqrt(np.diag(information))
        small = np.linalg.cholesky(information * unit[:, None] * unit)
        projection = solve_triangular(small, unit * (design.T @ observed), lower=True, check_finite=False)
        determinant = 2 * float(np.sum(np.log(np.diag(lower)))) + 2 * float(np.sum(np.log(np.diag(small) / unit)))
        square = float(observed @ observed - projection @ projection)
        return lower, design, observed, information, -0.5 * (determinant + square)

    def _log_prior(self, logarithms: Array) -> float:
        """Return the log-density of ln σ for half-Cauchy σ, up to a constant."""
        relative = logarithms - np.log(self.mixed.scales)
        return float(np.sum(relative - np.logaddexp(0, 2 * relative)))

    def _evaluate(self, logarithms: Array) -> tuple[float, Array]:
        """Return the negative log-posterior of ln σ (k,) and its gradient."""
        from scipy.linalg import cho_solve

        std = np.exp(logarithms)
        try:
            lower, _, _, information, likelihood = self._whiten(std)
        except np.linalg.LinAlgError:  # ratios so large that rounding dominates
            return 1e30, np.zeros(len(std))
        inverse = cho_solve((lower, True), np.eye(len(lower)), check_finite=False)
        weighted = inverse @ self.mixed.design
        projected = inverse - weighted @ np.linalg.solve(information, weighted.T)
        innovation = projected @ self.mixed.observed
        change = projected - np.outer(innovation, innovation)
        relative = logarithms - np.log(self.mixed.scales)
        gradient = np.square(std) * (self._flat @ change.ravel()) - (1 - 2 / (1 + np.exp(-2 * relative)))
        return -likelihood - self._log_prior(logarithms), np.asarray(gradient, dtype=np.float64)

    def _curvature(self, logarithms: Array) -> Array:
        """Return the curvature (k, k) of the negative log-posterior."""
        steps = STEP * np.eye(len(logarithms))
        rows = [
            (self._evaluate(logarithms + step)[1] - self._evaluate(logarithms - step)[1]) / (2 * STEP) for step in steps
        ]
        return np.asarray((np.array(rows) + np.array(rows).T) / 2, dtype=np.float64)


def sample_adaptively(log_density: Callable[[Array], float], middle: Array, curvature: Array) -> Array:
    """Return the weights (s,) of the samples at which a log-density of k variables is called, in the order of calls.

    Adaptive multiple importance sampling (Cornuet et al., Scand. J. Stat. 39 (2012) 798): each round draws from
    Student's t with the mean and covariance of all earlier samples. The first round uses the maximum and the curvature
    there.
    """
    rng = np.random.default_rng(0)
    values, directions = np.linalg.eigh(curvature)
    root, size = directions / np.sqrt(np.maximum(values, LEAST_CURVATURE)), len(middle)
    proposals: list[tuple[Array, Array]] = []
    points, logs = np.zeros((0, size)), np.zeros(0)
    for _ in range(ROUNDS):
        proposals.append((middle, root))
        normal = rng.standard_normal((DRAWS // 2, size)) * np.sqrt(TAILS / rng.chisquare(TAILS, size=(DRAWS // 2, 1)))
        drawn = middle + np.concatenate([normal, -normal]) @ root.T
        points = np.concatenate([points, drawn])
        logs = np.concatenate([logs, [log_density(point) for point in drawn]])
        weights = _find_weights(points, logs, proposals)
        tempered = _temper(weights, 2 * size)
        middle = tempered @ points
        deviations = points - middle
        spread = (deviations * tempered[:, None]).T @ deviations + FLOOR * np.eye(size)
        root = np.linalg.cholesky(spread)
    return _temper(weights, size)


def _find_weights(points: Array, logs: Array, proposals: Sequence[tuple[Array, Array]]) -> Array:
    """Return the normalised weights (s,) of samples (s, k), each drawn by one of the proposals."""
    densities = []
    for middle, root in proposals:
        standard = np.linalg.solve(root, (points - middle).T)
        squares = np.sum(standard**2, axis=0)
        tail = (TAILS + len(middle)) / 2
        densities.append(-np.linalg.slogdet(root)[1] - tail * np.log1p(squares / TAILS))
    weights = logs - np.logaddexp.reduce(densities, axis=0)
    weights = np.exp(weights - weights.max())
    return np.asarray(weights / weights.sum(), dtype=np.float64)


def _temper(weights: Array, fewest: float) -> Array:
    """Return the weights (s,) raised to a power ≤ 1 that makes the effective number of samples at least `fewest`."""
    power = 1.0
    tempered = weights
    while 1 / float(np.sum(tempered**2)) < fewest and power > LEAST_POWER:
        power *= 0.8
        tempered = weights**power / np.sum(weights**power)
    return tempered


def _find_half_width(offsets: Array, variances: Array, weights: Array) -> Array:
    """Return h (q,) so that a mixture of normals (s, q) with `weights` (s,) is within ± h with 95.45 % probability."""
    from scipy.special import ndtr

    std = np.sqrt(variances)

    def is_too_small(half: Array) -> NDArray[np.bool_]:
        within = ndtr((half - offsets) / std) - ndtr((-half - offsets) / std)
        return np.asarray(weights @ within < PROBABILITY)

    return bisect(is_too_small, COVERAGE_FACTOR * 20 * (std + np.abs(offsets)).max(axis=0))
