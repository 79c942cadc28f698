"""A linear fit whose errors' sizes are found from what it leaves: restricted maximum likelihood of a mixed model.

    y = X θ + e,   cov e = (δ² A + σ² B) ⊗ 1₃,   θ_g ~ N(0, ψ_g²) for groups g of the columns

y are n vectors in space, A and B are what two causes of error do from one to the next, each alike in all directions.
The sizes δ, σ, ψ are those that make y likeliest, with θ integrated out (Patterson and Thompson, Biometrika 58 (1971)
545; Harville, J. Am. Stat. Assoc. 72 (1977) 320). One transformation makes A and B diagonal together, so that a trial
of other sizes costs but a weighting of the rows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, coverage_factors

SPREAD = 4.0  # of ln size before the data are seen: a factor of 50 either way
STEP = 0.25  # of ln size, for differences
TRIALS = 300
FEWEST_FREEDOM = 3.0  # below, Student's t hardly has a variance


@dataclass(frozen=True, slots=True)
class Mixed:
    """`observed` (n, 3), `design` (n, 3, p), A `scattered` and B `walked` (n, n), B positive definite.

    `precision` (p,) of what is known of each column's size before, 0 where nothing is; `groups` of columns whose sizes
    are drawn from one distribution of unknown width.
    """

    observed: Array
    design: Array
    scattered: Array
    walked: Array
    precision: Array
    groups: tuple[NDArray[np.intp], ...]


@dataclass(frozen=True, slots=True)
class Sizes:
    """δ, σ, and ψ of every group."""

    scattered: float
    walked: float
    groups: tuple[float, ...]

    def logarithms(self) -> Array:
        """(2 + groups,) logarithms of the sizes."""
        return np.asarray(np.log([self.scattered, self.walked, *self.groups]), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Solved:
    """θ (p,) with its `covariance` (p, p), the logarithm of the likelihood, and `residuals` (n, 3)."""

    theta: Array
    covariance: Array
    likelihood: float
    residuals: Array


class MixedModel:
    """A `Mixed` with A and B made diagonal."""

    def __init__(self, mixed: Mixed) -> None:
        from scipy.linalg import eigh

        self.mixed = mixed
        spread, rotation = eigh(mixed.scattered, mixed.walked)
        self._spread = np.maximum(spread, 0.0)  # of A, where B is one
        count, _, columns = mixed.design.shape
        self._design = (rotation.T @ mixed.design.reshape(count, -1)).reshape(count, 3, columns)
        self._observed = rotation.T @ mixed.observed

    def solve(self, sizes: Sizes) -> Solved:
        """θ for given sizes."""
        theta, covariance, likelihood = self._fit(sizes)
        return Solved(theta, covariance, likelihood, self.mixed.observed - self.mixed.design @ theta)

    def causes(self, sizes: Sizes, covariance: Array) -> tuple[Array, Array]:
        """What δ and what σ make of θ's `covariance` (p, p); the rest of it is what was known of θ before."""
        variances = sizes.scattered**2 * self._spread + sizes.walked**2
        columns = self._design.shape[2]

        def of(part: Array) -> Array:
            design = (self._design * (np.sqrt(part) / variances)[:, None, None]).reshape(-1, columns)
            effect = covariance @ design.T
            return np.asarray(effect @ effect.T, dtype=np.float64)

        return of(sizes.scattered**2 * self._spread), of(np.full_like(variances, sizes.walked**2))

    def freedom(self, sizes: Sizes, wanted: Array) -> Array:
        """Degrees of freedom (q,) of the variances of `wanted` (q, p) combinations of θ.

        ½ (u/Δu)² of JCGM 100, G.4.2, with Δu from the curvature of the likelihood about its maximum, as Satterthwaite
        has it: sizes found from few residuals are themselves uncertain.
        """
        middle = sizes.logarithms()
        steps = STEP * np.eye(len(middle))

        def at(logarithms: Array) -> tuple[float, Array]:
            _, covariance, likelihood = self._fit(_sizes(logarithms))
            return likelihood, np.log(np.einsum("qi,ij,qj->q", wanted, covariance, wanted))

        beside = [[at(middle + way * step) for way in (1, -1)] for step in steps]
        slopes = np.array([(up[1] - down[1]) / (2 * STEP) for up, down in beside])
        curvature = np.eye(len(middle)) / SPREAD**2
        top = at(middle)[0]
        for i, (up, down) in enumerate(beside):
            curvature[i, i] -= (up[0] + down[0] - 2 * top) / STEP**2
            for j in range(i):
                corners = [at(middle + a * steps[i] + b * steps[j])[0] * a * b for a in (1, -1) for b in (1, -1)]
                curvature[i, j] = curvature[j, i] = curvature[i, j] - sum(corners) / (4 * STEP**2)
        values, directions = np.linalg.eigh(curvature)
        spread = (directions.T @ slopes) ** 2 / np.maximum(values, SPREAD**-2)[:, None]
        freedom: Array = 2 / np.maximum(spread.sum(axis=0), 1e-9)
        return freedom

    def likeliest(self, expected: Sizes, spread: Array | float = SPREAD, start: Sizes | None = None) -> Sizes:
        """The likeliest sizes, by some of about the right order, from which nothing strays farther than the data ask.

        `spread` of their logarithms is how well they are known before; `start` where the search begins, if not there.
        """
        from scipy.optimize import minimize

        middle = expected.logarithms()
        begin, reach = (middle, 1.5) if start is None else (start.logarithms(), 0.3)

        def lost(logarithms: Array) -> float:
            strayed = float(np.sum(((logarithms - middle) / spread) ** 2)) / 2
            try:
                return strayed - self._factored(_sizes(logarithms))[2]
            except np.linalg.LinAlgError:  # sizes so far apart that rounding is all there is
                return float("inf")

        simplex = np.vstack([begin, begin + reach * np.eye(len(begin)) * np.where(np.arange(len(begin)) % 2, 1, -1)])
        found = minimize(
            lost,
            begin,
            method="Nelder-Mead",
            options={"maxfev": TRIALS, "xatol": 0.05, "fatol": 0.02, "initial_simplex": simplex},
        )
        return _sizes(np.asarray(found.x, dtype=np.float64))

    def _fit(self, sizes: Sizes) -> tuple[Array, Array, float]:
        lower, told, likelihood = self._factored(sizes)
        inverse = np.linalg.inv(lower)
        return inverse.T @ told, inverse.T @ inverse, likelihood

    def _factored(self, sizes: Sizes) -> tuple[Array, Array, float]:
        """L (p, p) of the information L Lᵀ, and L⁻¹ Xᵀ y (p,), both of white rows, and the likelihood's logarithm."""
        from scipy.linalg import solve_triangular

        columns = self._design.shape[2]
        variances = sizes.scattered**2 * self._spread + sizes.walked**2
        weights = 1 / np.sqrt(variances)[:, None]
        design = (self._design * weights[..., None]).reshape(-1, columns)
        observed = (self._observed * weights).reshape(-1)
        precision = self.mixed.precision.copy()
        known = 0.0
        for group, size in zip(self.mixed.groups, sizes.groups, strict=True):
            precision[group] = size**-2.0
            known -= 2 * len(group) * np.log(size)
        information = design.T @ design + np.diag(precision)
        unit = 1 / np.sqrt(np.diag(information))
        lower = np.linalg.cholesky(information * unit[:, None] * unit) / unit[:, None]
        told = solve_triangular(lower, observed @ design, lower=True, check_finite=False)
        left = float(observed @ observed - told @ told)
        determinant = 2 * float(np.sum(np.log(np.diag(lower))))
        return lower, told, -0.5 * (3 * float(np.sum(np.log(variances))) + determinant - known + left)


def widened(covariance: Array, freedom: Array) -> Array:
    """A covariance (q, q) as wide as Student's t of so much freedom (q,): twice its root is then t's 95 %.

    The variance of t is ν/(ν − 2), and none below ν = 2: then it is t's coverage factor that counts (JCGM 100, G.3).
    """
    several = np.maximum(freedom, FEWEST_FREEDOM)
    by_coverage = coverage_factors(np.clip(freedom, 1.0, FEWEST_FREEDOM)) / COVERAGE_FACTOR
    wider = np.where(freedom >= FEWEST_FREEDOM, np.sqrt(several / (several - 2)), by_coverage)
    found: Array = covariance * wider[:, None] * wider
    return found


def _sizes(logarithms: Sequence[float] | Array) -> Sizes:
    first, second, *groups = np.exp(np.clip(logarithms, -60, 30)).tolist()
    return Sizes(first, second, tuple(groups))
