"""A linear fit with variance components estimated from its residuals: restricted maximum likelihood of a mixed model.

    y = X θ + e,   cov e = C₀ + Σ σ_k² A_k

The standard deviations σ_k have the likelihood of y with θ integrated out (Patterson and Thompson, Biometrika 58 (1971)
545; Harville, J. Am. Stat. Assoc. 72 (1977) 320) and half-Cauchy priors (Gelman, Bayesian Analysis 1 (2006) 515). A few
residuals hardly determine them, so the uncertainty of θ is integrated over all σ_k, weighted by their posterior. This
is done by adaptive importance sampling (JCGM 101, 6.4.9).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array, bisect
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, PROBABILITY

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

# Samples of a round of importance sampling, rounds, and degrees of freedom of the proposal, a t distribution.
SAMPLES, SAMPLING_ROUNDS, T_DOF = 40, 3, 5.0
MIN_PROPOSAL_VARIANCE, MIN_WEIGHT_POWER = 0.02, 0.05  # power of the tempered weights
CURVATURE_STEP = 0.1  # of ln σ, at the maximum
MIN_CURVATURE = 0.1  # of the negative log-posterior over ln σ: about that of the priors
GRADIENT_TOLERANCE, MAX_NEWTON_STEPS = 1e-2, 100  # of the log-posterior at a maximum
MAX_STEP = 4.0  # of ln σ
RISE, DROP = 3.5, 2.0  # starting points of ln σ: one cause above the median of its prior, all others below theirs
SINGLE_MAXIMUM_RESIDUALS = 240  # with more of them there is only one maximum
# Least distance of two maxima in ln σ; a maximum lower than the greatest by more than this is ignored.
MIN_MAXIMUM_DISTANCE, NEGLIGIBLE_DROP = 1.0, 5.0
# A search ends near a point of an earlier one's ridge, whose points are lower than its maximum by at most this.
RIDGE_DISTANCE, RIDGE_DROP = 0.5, 1.0
FIRST_STEPS = 6  # Newton steps from each starting point: only the likely ones are continued
FAILED_LOG_POSTERIOR = 1e30  # negative, if it cannot be computed


@dataclass(frozen=True, slots=True)
class Mixed:
    """The model of observations, `observed` (m,) = `design` (m, p) × coefficients + errors.

    - `precision` (p,): the prior precision of each coefficient, 0 if none.
    - `fixed` (m, m): the known part of the errors' covariance; `components` (k, m, m): the covariance for each of k
      causes of errors with the standard deviation 1.
    - `scales` (k,): the medians of the half-Cauchy priors of the causes' standard deviations.
    - `alone` (k, 2): sum of squares and dof of each cause's errors in a separate measurement; 0 if not measured.
    """

    observed: Array
    design: Array
    fixed: Array
    components: Array
    precision: Array
    scales: Array
    alone: Array


@dataclass(frozen=True, slots=True)
class MixedFit:
    """The fitted coefficients `theta` (p,), their covariance (p, p), the log-likelihood, and the residuals (m,)."""

    theta: Array
    covariance: Array
    likelihood: float
    residuals: Array


@dataclass(frozen=True, slots=True)
class _Ascent:
    """A search for a maximum of the posterior of the logarithms (k,) of standard deviations.

    - point (k,): the end of the search; value: the negative log-posterior there.
    - ridge: the visited points at which the log-posterior is below that of `point` by at most `RIDGE_DROP`.
    - joins: whether the search was ended because it came near the ridge of an earlier search, whose maximum it would
      have reached too.
    """

    point: Array
    value: float
    ridge: list[Array]
    joins: bool

    def passes(self, logarithms: Array) -> bool:
        """Return whether a point of the ridge is near `logarithms` (k,)."""
        return any(np.abs(logarithms - point).max() < RIDGE_DISTANCE for point in self.ridge)


class MixedModel:
    """The likelihood, the posterior and the solutions of a `Mixed` model."""

    def __init__(self, mixed: Mixed) -> None:
        self.mixed = mixed
        self._flat = mixed.components.reshape(len(mixed.components), -1)
        self._last: tuple[Array, tuple[float, Array, Array]] | None = None  # a step's value, before its curvature

    def covariance(self, std: Array) -> Array:
        """Return the covariance (m, m) of the errors for standard deviations (k,)."""
        total: Array = self.mixed.fixed + (np.square(std) @ self._flat).reshape(self.mixed.fixed.shape)
        return total

    def solve(self, std: Array) -> MixedFit:
        """Return the fit for given standard deviations (k,). Raise LinAlgError if the equations are singular."""
        _, design, observed, information, likelihood = self._whiten(std)
        covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
        theta = covariance @ (design.T @ observed)
        return MixedFit(theta, covariance, likelihood, self.mixed.observed - self.mixed.design @ theta)

    def evaluate_posterior(self, std: Array) -> float:
        """Return the log-posterior density of the logarithms of standard deviations `std` (k,).

        The density lacks an additive constant. It does not change if columns with prior precision 1 are added to the
        design, so models of the same observations that differ only in such columns can be compared.
        """
        return self._whiten(std)[-1] + self._log_prior(np.log(std))

    def restrict(self, std: Array) -> tuple[Array, Array]:
        """Return P (m, m) of the restricted likelihood, and P y (m,) for the observations y.

        P is the inverse of the errors' covariance without the part that the design explains.
        """
        lower, _, _, information, _ = self._whiten(std)
        return self._project(lower, information)

    def find_maxima(self, start: Array | None = None) -> Array:
        """Return standard deviations (n, k) of the k causes at the n maxima of their posterior, most probable first.

        With few residuals there may be several maxima, at which different causes explain the largest residuals. Without
        a `start` the search begins at the priors' medians and at points where one cause exceeds all others. Maxima less
        probable than the first by more than `NEGLIGIBLE_DROP` are left out.
        """
        if start is not None:
            return np.exp([self._climb(np.log(start)).point])
        middle = np.log(self.mixed.scales)
        if len(self.mixed.observed) > SINGLE_MAXIMUM_RESIDUALS:
            return np.exp([self._climb(middle).point])
        ascents = [self._climb(middle)]
        starts = middle - DROP + (RISE + DROP) * np.eye(len(middle))
        begun = [self._climb(point, ascents, FIRST_STEPS) for point in starts]
        likely = min(begin.value for begin in begun) + 2 * NEGLIGIBLE_DROP  # most of them are nearly at a maximum
        for begin in sorted(begun, key=lambda begin: begin.value):
            if begin.value < likely and not begin.joins:
                ascent = self._climb(begin.point, ascents)
                if not ascent.joins:
                    ascents.append(ascent)
        ascents.sort(key=lambda ascent: ascent.value)
        distinct: list[Array] = []
        for ascent in ascents:
            is_new = all(np.abs(ascent.point - other).max() > MIN_MAXIMUM_DISTANCE for other in distinct)
            if is_new and ascent.value < ascents[0].value + NEGLIGIBLE_DROP:
                distinct.append(ascent.point)
        return np.exp(distinct)

    def _climb(self, logarithms: Array, earlier: Sequence[_Ascent] = (), most_steps: int = MAX_NEWTON_STEPS) -> _Ascent:
        """Return a search that climbs from `logarithms` (k,) of the standard deviations to a maximum of the posterior.

        The search ends early if it joins an `earlier` ascent. The method is Newton's in a trust region, and the
        curvature is the average information (Gilmour, Thompson and Cullis, Biometrics 51 (1995) 1440). A step to
        standard deviations so different that rounding dominates is undone and repeated in a smaller trust region.
        """
        from scipy.optimize import minimize

        newton: Any = {  # SciPy's types do not allow these options if `fun` returns the gradient too
            "fun": lambda point: self._evaluate(point)[:2],
            "method": "trust-exact",
            "jac": True,
            "hess": lambda point: self._evaluate(point)[2],
            "options": {"gtol": GRADIENT_TOLERANCE, "maxiter": most_steps, "max_trust_radius": MAX_STEP},
        }
        path: list[tuple[Array, float]] = []

        def joins(point: Array) -> bool:
            return any(ascent.passes(point) for ascent in earlier)

        def follow(intermediate_result: "OptimizeResult") -> None:
            path.append((intermediate_result.x.copy(), float(intermediate_result.fun)))
            if joins(intermediate_result.x):
                raise StopIteration

        reached: OptimizeResult = minimize(x0=logarithms, callback=follow, **newton)
        ridge = [point for point, value in path if value < reached.fun + RIDGE_DROP]
        return _Ascent(reached.x, float(reached.fun), ridge, joins(reached.x))

    def causes(self, std: Array, fit: MixedFit) -> list[Array]:
        """Return the parts (p, p) of a fit's covariance due to the fixed errors, each component, and the prior."""
        from scipy.linalg import cho_factor, cho_solve

        factor = cho_factor(self.covariance(std), lower=True)
        weights = cho_solve(factor, self.mixed.design) @ fit.covariance
        parts = [self.mixed.fixed, *(np.square(std)[:, None, None] * self.mixed.components)]
        return [*(weights.T @ part @ weights for part in parts), fit.covariance * self.mixed.precision @ fit.covariance]

    def expand(self, maxima: Array, wanted: Array) -> Array:
        """Return the half-widths (q,) of the 95.45 % intervals of combinations `wanted` (q, p) of the coefficients.

        The intervals are centred on the estimates at the first of `maxima` (n, k). They contain 95.45 % of the
        distribution averaged over all standard deviations.
        """
        top = wanted @ self.solve(maxima[0]).theta
        offsets = []
        variances = []

        def evaluate(logarithms: Array) -> float:
            """Return the log-posterior of standard deviations, and keep the estimates and variances that they give."""
            try:
                fit = self.solve(np.exp(logarithms))
            except np.linalg.LinAlgError:
                offsets.append(np.zeros_like(top))
                variances.append(np.ones_like(top))
                return -np.inf
            offsets.append(wanted @ fit.theta - top)
            variances.append(np.einsum("qi,ij,qj->q", wanted, fit.covariance, wanted))
            return fit.likelihood + self._log_prior(logarithms)

        begins = [(middle, self._curvature(middle)) for middle in np.log(maxima)]
        weights = sample_adaptively(evaluate, begins)
        return find_half_width(np.array(offsets), np.array(variances), weights)

    def _whiten(self, std: Array) -> tuple[Array, Array, Array, Array, float]:
        """Return the Cholesky factor, whitened design, whitened observations, information and log-likelihood."""
        from scipy.linalg.lapack import dpotrf, dtrtrs  # without the checks of `solve_triangular`, which take longer

        mixed = self.mixed
        lower, failed = dpotrf(self.covariance(std).T, lower=1, overwrite_a=1)
        if failed:
            raise np.linalg.LinAlgError("the covariance is not positive definite")
        both = dtrtrs(lower, np.column_stack([mixed.design, mixed.observed]), lower=1)[0]
        design, observed = both[:, :-1], both[:, -1]
        information = design.T @ design + np.diag(mixed.precision)
        unit = 1 / np.sqrt(np.diag(information))
        small = np.linalg.cholesky(information * unit[:, None] * unit)
        projection = dtrtrs(small, unit * (design.T @ observed), lower=1)[0]
        determinant = 2 * float(np.sum(np.log(np.diag(lower)))) + 2 * float(np.sum(np.log(np.diag(small) / unit)))
        square = float(observed @ observed - projection @ projection)
        return lower, design, observed, information, -0.5 * (determinant + square)

    def _project(self, lower: Array, information: Array) -> tuple[Array, Array]:
        """Return the result of `restrict`, from the Cholesky factor (m, m) and the information (p, p) of `_whiten`."""
        from scipy.linalg.lapack import dpotri

        half = dpotri(lower, lower=1)[0]
        inverse = half + half.T
        np.fill_diagonal(inverse, np.diag(half))
        weighted = inverse @ self.mixed.design
        projected = inverse - weighted @ np.linalg.solve(information, weighted.T)
        return projected, projected @ self.mixed.observed

    def _log_prior(self, logarithms: Array) -> float:
        """Return the log-density of `logarithms` (k,), up to a constant: half-Cauchy priors × likelihood of `alone`."""
        relative = logarithms - np.log(self.mixed.scales)
        squares, dof = self.mixed.alone.T
        measured = dof * logarithms + squares / 2 * np.exp(-2 * logarithms)
        return float(np.sum(relative - np.logaddexp(0, 2 * relative) - measured))

    def _evaluate(self, logarithms: Array) -> tuple[float, Array, Array]:
        """Return the negative log-posterior of `logarithms` (k,), its gradient and its average information (k, k)."""
        if self._last is not None and np.array_equal(self._last[0], logarithms):
            return self._last[1]
        try:
            lower, _, _, information, likelihood = self._whiten(np.exp(logarithms))
        except np.linalg.LinAlgError:  # ratios so large that rounding dominates
            return FAILED_LOG_POSTERIOR, np.zeros(len(logarithms)), np.eye(len(logarithms))
        projected, innovation = self._project(lower, information)
        squares = np.exp(2 * logarithms)
        shape = np.tanh(logarithms - np.log(self.mixed.scales))
        parts = squares[:, None] * (self.mixed.components @ innovation)
        alone, dof = self.mixed.alone.T
        fit_gradient = squares * (self._flat @ projected.ravel()) - parts @ innovation
        gradient = fit_gradient + shape + dof - alone / squares
        # Over ln σ the curvature contains twice the gradient: at a maximum the slope of the prior, which is at most 1.
        # Far from a maximum a larger term would shorten the steps towards a small σ.
        of_logarithm = 2 * np.clip(fit_gradient, 0.0, 1.0)
        curvature = 2 * parts @ projected @ parts.T + np.diag(of_logarithm + 1 - shape**2 + 2 * alone / squares)
        evaluated = (-likelihood - self._log_prior(logarithms), gradient, curvature)
        self._last = (logarithms.copy(), evaluated)
        return evaluated

    def _curvature(self, logarithms: Array) -> Array:
        """Return the curvature (k, k) of the negative log-posterior."""
        steps = CURVATURE_STEP * np.eye(len(logarithms))
        rows = [
            (self._evaluate(logarithms + step)[1] - self._evaluate(logarithms - step)[1]) / (2 * CURVATURE_STEP)
            for step in steps
        ]
        return np.asarray((np.array(rows) + np.array(rows).T) / 2, dtype=np.float64)


def sample_adaptively(log_density: Callable[[Array], float], begins: Sequence[tuple[Array, Array]]) -> Array:
    """Return the weights (s,) of s samples of k variables, in the order in which `log_density` is called for them.

    Adaptive multiple importance sampling (Cornuet et al., Scand. J. Stat. 39 (2012) 798) begins at each maximum (k,) of
    `begins` with the curvature (k, k) there; each further round draws from Student's t with the mean and covariance of
    the samples around the maximum. The weights are normalised over all samples.
    """
    rng = np.random.default_rng(0)
    size = len(begins[0][0])
    proposals: list[tuple[Array, Array]] = []
    points, logs = np.zeros((0, size)), np.zeros(0)
    for middle, curvature in begins:
        first_sample, first_proposal = len(points), len(proposals)
        values, directions = np.linalg.eigh(curvature)
        proposal = (middle, directions / np.sqrt(np.maximum(values, MIN_CURVATURE)))
        for _ in range(SAMPLING_ROUNDS):
            proposals.append(proposal)
            normal = rng.standard_normal((SAMPLES // 2, size)) * np.sqrt(
                T_DOF / rng.chisquare(T_DOF, (SAMPLES // 2, 1))
            )
            drawn = proposal[0] + np.concatenate([normal, -normal]) @ proposal[1].T
            points = np.concatenate([points, drawn])
            logs = np.concatenate([logs, [log_density(point) for point in drawn]])
            proposal = _adapt(points[first_sample:], logs[first_sample:], proposals[first_proposal:])
    return _temper(_find_weights(points, logs, proposals), size)


def _adapt(points: Array, logs: Array, proposals: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return the mean (k,) and a root (k, k) of the covariance of `points` (s, k), with weights by `_find_weights`."""
    tempered = _temper(_find_weights(points, logs, proposals), 2 * points.shape[1])
    mean = tempered @ points
    deviations = points - mean
    spread = (deviations * tempered[:, None]).T @ deviations + MIN_PROPOSAL_VARIANCE * np.eye(len(mean))
    return mean, np.asarray(np.linalg.cholesky(spread), dtype=np.float64)


def _find_weights(points: Array, logs: Array, proposals: Sequence[tuple[Array, Array]]) -> Array:
    """Return normalised weights (s,) of the samples `points` (s, k), each drawn from one of `proposals`.

    `logs` (s,): the logarithms of the density; a proposal: the middle, and a square root of the scale matrix."""
    densities = []
    for middle, root in proposals:
        standard = np.linalg.solve(root, (points - middle).T)
        squares = np.sum(standard**2, axis=0)
        tail = (T_DOF + len(middle)) / 2
        densities.append(-np.linalg.slogdet(root)[1] - tail * np.log1p(squares / T_DOF))
    weights = logs - np.logaddexp.reduce(densities, axis=0)
    weights = np.exp(weights - weights.max())
    return np.asarray(weights / weights.sum(), dtype=np.float64)


def _temper(weights: Array, fewest: float) -> Array:
    """Return the weights (s,) raised to a power ≤ 1 that makes the effective number of samples at least `fewest`."""
    power = 1.0
    tempered = weights
    while 1 / float(np.sum(tempered**2)) < fewest and power > MIN_WEIGHT_POWER:
        power *= 0.8
        tempered = weights**power / np.sum(weights**power)
    return tempered


def find_half_width(offsets: Array, variances: Array, weights: Array) -> Array:
    """Return the half-widths h (q,): 95.45 % of each of q mixtures of normal distributions lie between −h and h.

    The s distributions of a mixture have means `offsets` and `variances` (s, q), with weights (s,).
    """
    from scipy.special import ndtr

    std = np.sqrt(variances)

    def is_too_small(half: Array) -> NDArray[np.bool_]:
        within = ndtr((half - offsets) / std) - ndtr((-half - offsets) / std)
        return np.asarray(weights @ within < PROBABILITY)

    return bisect(is_too_small, COVERAGE_FACTOR * 20 * (std + np.abs(offsets)).max(axis=0))
