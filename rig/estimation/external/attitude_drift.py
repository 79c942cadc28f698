"""The drift of a gyroscope's attitude from a reference's, as a linear model of its causes.

    E(t) = R(t + τ) C(t)ᵀ

is constant if R and C are exact. R maps body coordinates to table coordinates, as the reference states; C maps them to
body coordinates at the first reading, as integrated from the gyroscope. If R and C have errors, E changes by

    E(t₁)ᵀ E(t₂) = exp(ΔS δθ + Δ(C ω) τ − Eᵀ ω_E Δt + e)

with S the sensitivity of C to errors δθ of F and b (`increments`), τ the offset of the reference's clock, ω_E the
Earth's rate in table coordinates, and e the remaining errors. A fix is the mean of E over a window: it uses every
sample of the reference and is robust to coloured errors within a window. Each e contains the errors of two fixes, which
neighbours share, and the integrated white noise of the gyroscope.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array, rotation_vectors
from rig.estimation.earth import EARTH_RATE_RAD_S
from rig.estimation.gyroscope.increments import integrate_attitudes
from rig.estimation.statistics.bias_process import walk_covariance
from rig.estimation.statistics.variance_components import Mixed

MATRIX, BIAS, CLOCK, EARTH, COMMON_PARAMETERS = slice(0, 9), slice(9, 12), 12, slice(13, 16), 16
CLOCK_STD_S = 0.1  # prior of the offset, if one clock stamps both: delays of a controller, of cameras
MATRIX_PRECISION = 1.0  # prior of F's elements: keeps elements finite that no turn determines
EARTH_PRECISION = 3 / EARTH_RATE_RAD_S**2  # its norm is known, its direction is unknown
BIAS_INTERVALS = 6  # of a recording, within which the bias is correlated
ATTITUDE_ERROR, VISIT_ERROR = "error with attitude", "error with attitude, of each visit"
REST_ERROR, MOTION_ERROR = "error of each rest", "error of each fix in motion"
JITTER, LOST_TIMES = "jitter of the stamps", "times between the readings"
MATRIX_CHANGES, BIAS_CHANGES, RANDOM_WALK = "changes of F", "changes of b", "random walk"
PRIOR_MEDIANS = {  # medians of the half-Cauchy priors: rad, s, 1, rad/s, rad/√s
    ATTITUDE_ERROR: 5e-3,
    VISIT_ERROR: 1e-3,
    REST_ERROR: 1e-3,
    MOTION_ERROR: 3e-3,
    JITTER: 3e-3,
    LOST_TIMES: 1e-3,
    MATRIX_CHANGES: 5e-4,
    BIAS_CHANGES: 5e-5,
    RANDOM_WALK: 3e-4,
}
CORRELATION_RAD = 1.5  # correlation length of an error that depends on the attitude
MIN_REST_TIME_S = 0.5  # total duration of the rests whose mean is the bias
VISIT_CORRELATION_S = 5.0  # of errors that depend on more than the attitude: an arm's elbow, its load
COMMON_JITTER_FRACTION = 0.1  # of its variance, which the samples of one fix have in common
AVERAGING_FRACTIONS = np.array([0.0, 0.34, 0.67])  # of a fix's samples, for its attitude-dependent error
MIN_ERROR_RAD = 1e-7  # of an increment: rounding
OUTLIER_RATIO, MIN_FIX_SAMPLES = 6.0, 10  # ratio of an outlier to the fix's median error; fewest samples to decide
MIN_STD_RATIO = 1e-3  # to the usual std, for a sample that is stated to be exact


@dataclass(frozen=True, slots=True)
class Fixes:
    """A reference's attitudes: k samples, grouped into N fixes.

    - `at_s` (k,): the samples' increasing times; `attitudes` (k, 3, 3): body to table.
    - `fix` (k,): the index of the fix to which each sample belongs.
    - `placement` (N,): a number for each fix. Fixes in one rest have the same negative number, because the body lay
      still and they share one error. In motion each fix has a different number, at least 0.
    - `joined` (N − 1,): True if the gyroscope's readings are complete from one fix to the next.
    - `std_rad` (k,): the stated standard deviation of each sample, None if none is stated.
    - `blind_rad` (N − 1,): standard deviation of the rotation that missing readings hide, None if none are missing.
    - `walk`: sum of squares in rad²/s, and dof, of the gyroscope's random walk at rest; zeros without rests.
    - `hides_losses`: True if a single lost reading leaves no gap in the readings' time stamps.
    """

    at_s: Array
    attitudes: Array
    fix: NDArray[np.intp]
    placement: NDArray[np.intp]
    joined: NDArray[np.bool_]
    std_rad: Array | None = None
    blind_rad: Array | None = None
    walk: tuple[float, float] = (0.0, 0.0)
    hides_losses: bool = False

    @property
    def stated_std_rad(self) -> float | None:
        """The median of the stated standard deviations above zero; None without any."""
        if self.std_rad is None or not self.std_rad.any():
            return None
        return float(np.median(self.std_rad[self.std_rad > 0]))


@dataclass(frozen=True, slots=True)
class AttitudeSamples:
    """A gyroscope's readings, the reference's `fixes`, and a mask `kept` (k,), false for attitude samples left out."""

    time_s: Array
    readings: Array
    fixes: Fixes
    kept: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class DriftState:
    """One iterate of the fit: the matrix F (3, 3), the bias b (3,) and the clock's offset τ."""

    matrix: Array
    bias: Array
    clock_s: float

    def after_step(self, theta: Array) -> "DriftState":
        """Return the state after a step `theta` of all parameters."""
        matrix = self.matrix + theta[MATRIX].reshape(3, 3)
        return DriftState(matrix, self.bias + theta[BIAS], self.clock_s + float(theta[CLOCK]))


@dataclass(frozen=True, slots=True)
class FixedAttitudes:
    """The terms of the module's equation at N fixes and at k samples.

    - `attitudes` (N, 3, 3), `samples` (k, 3, 3): the reference's attitude E relative to the gyroscope's.
    - `sensitivities` (N, 3, 12): derivatives S of the gyroscope's attitude with respect to its matrix and bias.
    - `turning` (N, 3), `rates` (k, 3): the rate C ω at the fixes, and at the samples.
    - `middles_s` (N,), `windows_s` (N, 2): middle, and start and end, of each fix.
    """

    attitudes: Array
    sensitivities: Array
    turning: Array
    middles_s: Array
    windows_s: Array
    samples: Array
    rates: Array


def average_fixes(recorded: AttitudeSamples, state: DriftState) -> FixedAttitudes:
    """Return the terms of the module's equation, with C integrated from the readings with the parameters `state`."""
    fixes, time_s = recorded.fixes, recorded.time_s
    at_s = np.clip(fixes.at_s + state.clock_s, time_s[0], time_s[-1])
    integrated = integrate_attitudes(time_s, recorded.readings, state.matrix, state.bias, at_s)
    samples = fixes.attitudes @ np.swapaxes(integrated.attitudes, -1, -2)
    turning = (integrated.attitudes @ integrated.rates_rad_s[..., None])[..., 0]
    count = len(fixes.placement)
    relative_weights = recorded.kept / _relative(fixes) ** 2
    weights = relative_weights / np.bincount(fixes.fix, weights=relative_weights, minlength=count)[fixes.fix]

    def mean(values: Array) -> Array:
        total = np.zeros((count, *values.shape[1:]))
        np.add.at(total, fixes.fix, values * weights.reshape(-1, *[1] * (values.ndim - 1)))
        return total

    left_vectors, _, right_vectors = np.linalg.svd(mean(samples))  # for the rotation nearest to each mean
    left_vectors[..., -1] *= np.linalg.det(left_vectors @ right_vectors)[:, None]
    first, last = (np.searchsorted(fixes.fix, np.arange(count), side=side) for side in ("left", "right"))
    return FixedAttitudes(
        left_vectors @ right_vectors,
        mean(integrated.sensitivities),
        mean(turning),
        mean(fixes.at_s),
        np.column_stack([fixes.at_s[first], fixes.at_s[last - 1]]),
        samples,
        turning,
    )


def _relative(fixes: Fixes) -> Array:
    """Return each sample's stated standard deviation (k,) divided by the median of all."""
    if fixes.std_rad is None or fixes.stated_std_rad is None:
        return np.ones(len(fixes.at_s))
    return np.maximum(fixes.std_rad / fixes.stated_std_rad, MIN_STD_RATIO)


def find_inliers(recorded: AttitudeSamples, fixes: FixedAttitudes) -> NDArray[np.bool_]:
    """Return a mask (k,) of the samples near the mean of their fix; it excludes outliers such as a mistaken marker."""
    fix = recorded.fixes.fix
    deviations = np.linalg.norm(rotation_vectors(np.swapaxes(fixes.attitudes[fix], -1, -2) @ fixes.samples), axis=1)
    order = np.lexsort((deviations, fix))
    count = np.bincount(fix)
    first = np.cumsum(count) - count
    middle = deviations[order][first + count // 2]
    kept: NDArray[np.bool_] = (count[fix] < MIN_FIX_SAMPLES) | (deviations <= OUTLIER_RATIO * middle[fix])
    return kept


@dataclass(frozen=True, slots=True)
class DriftModel:
    """The mixed linear model of the increments between fixes, with the names of the k `causes` of its errors."""

    mixed: Mixed
    causes: tuple[str, ...]

    def std_of(self, cause: str, std: Array) -> float:
        """Return the standard deviation of a cause out of `std` (k,); 0 if the model has no such cause."""
        return float(std[self.causes.index(cause)]) if cause in self.causes else 0.0


def drift_model(averaged: FixedAttitudes, fixes: Fixes) -> DriftModel:
    """Return the mixed linear model of the increments between fixes."""
    joined = np.flatnonzero(fixes.joined)
    count, increments = len(fixes.placement), len(joined)
    step = np.zeros((increments, count))
    step[np.arange(increments), joined], step[np.arange(increments), joined + 1] = -1.0, 1.0
    inverse = np.swapaxes(averaged.attitudes[joined], -1, -2)
    observed = rotation_vectors(inverse @ averaged.attitudes[joined + 1])
    sensitivities, turning = (np.tensordot(step, values, 1) for values in (averaged.sensitivities, averaged.turning))
    earth = -inverse * (step @ averaged.middles_s)[:, None, None]
    design = np.concatenate([sensitivities, turning[..., None], earth], axis=2)  # by δθ, τ and ω_E
    precision = np.zeros(COMMON_PARAMETERS)
    precision[MATRIX] = MATRIX_PRECISION
    precision[CLOCK] = CLOCK_STD_S**-2.0
    precision[EARTH] = EARTH_PRECISION
    correlation = _correlate(fixes)
    between = np.abs(step) / 2  # the mean of the fixes at both ends
    nearby = between @ correlation @ between.T
    errors = {
        **_list_errors(averaged, fixes, correlation, step),
        MATRIX_CHANGES: _find_matrix_changes(sensitivities, nearby),
        BIAS_CHANGES: _find_bias_changes(
            sensitivities, nearby, between @ averaged.middles_s, _weigh_bias(averaged, fixes)
        ),
        RANDOM_WALK: _expand_axes(step @ walk_covariance(averaged.windows_s) @ step.T),
    }
    causes = tuple(name for name in PRIOR_MEDIANS if name in errors and errors[name].any())
    scales = np.array([PRIOR_MEDIANS[name] for name in causes])
    if (stated_rad := fixes.stated_std_rad) is not None:
        scales = np.where(np.isin(causes, (REST_ERROR, MOTION_ERROR)), stated_rad, scales)
    blind = np.zeros(increments) if fixes.blind_rad is None else fixes.blind_rad[joined]
    alone = np.array([fixes.walk if cause == RANDOM_WALK else (0.0, 0.0) for cause in causes])
    mixed = Mixed(
        observed.reshape(-1),
        design.reshape(-1, COMMON_PARAMETERS),
        np.diag(np.repeat(np.square(blind) + MIN_ERROR_RAD**2, 3)),
        np.array([errors[name] for name in causes]),
        precision,
        scales,
        alone,
    )
    return DriftModel(mixed, causes)


def _list_errors(averaged: FixedAttitudes, fixes: Fixes, correlation: Array, step: Array) -> dict[str, Array]:
    """Return the covariances (3n, 3n) of n increments due to unit errors of reference and times, by the errors' names.

    The reference's errors vary with attitude, or are new in each visit to an attitude, each rest, or each fix in
    motion. The errors of the times are jitter of the reference's stamps and, if lost readings are hidden, an error of
    the time that passes from fix to fix. `correlation` (N, N) is that of `_correlate`; `step` (n, N) maps the errors of
    N fixes to the increments.
    """
    count = len(fixes.placement)
    first = np.searchsorted(fixes.fix, np.arange(count))
    ratio = _relative(fixes)[first]
    same_placement = (fixes.placement[:, None] == fixes.placement) * ratio[:, None] * ratio
    at_rest = fixes.placement < 0
    jitter_blocks = np.zeros((count, 3, 3))
    np.add.at(jitter_blocks, fixes.fix, averaged.rates[:, :, None] * averaged.rates[:, None, :])
    jitter_blocks /= np.bincount(fixes.fix).astype(np.float64)[:, None, None]
    elapsed_s = (step @ averaged.middles_s)[:, None, None]
    lost_time_blocks = elapsed_s * np.tensordot(np.abs(step) / 2, jitter_blocks, 1)
    jitter_blocks /= np.bincount(fixes.fix).astype(np.float64)[:, None, None]
    _, rest = np.unique(fixes.placement, return_inverse=True)  # the error does not change while the body lies still
    at_s = (np.bincount(rest, weights=averaged.middles_s) / np.bincount(rest))[rest]
    same_visit = matern(np.abs(at_s[:, None] - at_s), VISIT_CORRELATION_S)
    common_blocks = averaged.turning[:, :, None] * averaged.turning[:, None, :]
    return {
        ATTITUDE_ERROR: _expand_axes(step @ correlation @ step.T),
        VISIT_ERROR: _expand_axes(step @ (correlation * same_visit) @ step.T),
        REST_ERROR: _expand_axes(step @ (same_placement * at_rest * at_rest[:, None]) @ step.T),
        MOTION_ERROR: _expand_axes(step @ (same_placement * ~at_rest * ~at_rest[:, None]) @ step.T),
        JITTER: _combine_blocks(step, jitter_blocks + COMMON_JITTER_FRACTION * common_blocks),
        LOST_TIMES: fixes.hides_losses * _combine_blocks(np.eye(len(step)), lost_time_blocks),
    }


def _correlate(fixes: Fixes) -> Array:
    """Return the correlation (N, N), from fix to fix, of an error that varies smoothly with attitude.

    The error is averaged in each fix. At two attitudes R and R′ its correlation is Matérn's function, ν = 3/2, of the
    chordal distance ‖R − R′‖/√2, nearly the angle between them if this is small. The function is positive definite on
    SO(3) (Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), 4.2).
    """
    counts = np.bincount(fixes.fix)
    begins = np.cumsum(counts) - counts
    looks = np.unique(begins[:, None] + (counts[:, None] * AVERAGING_FRACTIONS).astype(np.intp))
    flat = fixes.attitudes[looks].reshape(-1, 9)
    distances = np.sqrt(np.maximum(3 - flat @ flat.T, 0.0))
    mean = np.zeros((len(counts), len(looks)))
    mean[fixes.fix[looks], np.arange(len(looks))] = 1.0
    mean /= mean.sum(axis=1, keepdims=True)
    return np.asarray(mean @ matern(distances, CORRELATION_RAD) @ mean.T, dtype=np.float64)


def matern(distances: Array, reach: float) -> Array:
    """Return Matérn's correlation, ν = 3/2, at distances of any shape with a correlation length of `reach`."""
    scaled = np.sqrt(3) * distances / reach
    return np.asarray((1 + scaled) * np.exp(-scaled), dtype=np.float64)


def correlate_effects(effects: Array, correlation: Array) -> Array:
    """Return the covariance (3n, 3n) of n increments, from the effects (n, 3, p) of p unit causes on them.

    `correlation` (n, n): the correlation of one cause's size in two increments; the causes are independent.
    """
    flat = effects.reshape(-1, effects.shape[-1])
    return np.asarray((flat @ flat.T) * np.kron(correlation, np.ones((3, 3))), dtype=np.float64)


def _find_matrix_changes(sensitivities: Array, nearby: Array) -> Array:
    """Return the covariance (3n, 3n) of n increments if each element of F varies with attitude, with unit variance.

    `nearby` (n, n) is the correlation between the increments. Causes of such a variation are the sensor's nonlinearity,
    its sensitivity to gravity, and gears in the reference.
    """
    return correlate_effects(sensitivities[..., MATRIX], nearby)


def _weigh_bias(averaged: FixedAttitudes, fixes: Fixes) -> Array:
    """Return the weights (n,) of the increments in the mean bias: in proportion to their durations, with the sum 1.

    A gyroscope's bias is its reading at rest, so increments in motion have weights only if there is too little rest.
    """
    joined = np.flatnonzero(fixes.joined)
    lasts_s = np.diff(averaged.middles_s)[joined]
    resting = fixes.placement[joined] == fixes.placement[joined + 1]
    if lasts_s[resting].sum() >= MIN_REST_TIME_S:
        lasts_s = lasts_s * resting
    return np.asarray(lasts_s / lasts_s.sum(), dtype=np.float64)


def _find_bias_changes(sensitivities: Array, nearby: Array, middles_s: Array, weights: Array) -> Array:
    """Return the covariance (3n, 3n) of n increments due to changes of the bias, of unit std, with attitude and time.

    `sensitivities` (n, 3, 12) are derivatives of the increments with respect to matrix and bias, `nearby` (n, n) is the
    correlation due to similar attitudes, `middles_s` (n,) are the middle times. Changes are relative to the mean bias
    with `weights` (n,).
    """
    apart = np.abs(middles_s[:, None] - middles_s) / (np.ptp(middles_s) / BIAS_INTERVALS + 1e-9)
    from_mean = np.eye(len(weights)) - weights
    changes = from_mean @ (nearby + np.exp(-apart)) @ from_mean.T / 2
    return correlate_effects(sensitivities[..., BIAS], changes)


def _expand_axes(covariance: Array) -> Array:
    """Return the covariance (3n, 3n) of n vectors; x, y and z are independent, and each has `covariance` (n, n)."""
    return np.asarray(np.kron(covariance, np.eye(3)), dtype=np.float64)


def _combine_blocks(step: Array, blocks: Array) -> Array:
    """Return the covariance (3n, 3n) of increments from the covariances `blocks` (N, 3, 3) of N vectors.

    `step` (n, N) maps the vectors to the increments.
    """
    spread = np.einsum("ik,kab,jk->iajb", step, blocks, step, optimize=True)
    return np.asarray(spread.reshape(3 * len(step), -1), dtype=np.float64)
