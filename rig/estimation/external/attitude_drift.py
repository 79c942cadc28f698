"""The drift of a gyroscope's attitude from a reference's, as a linear model of its causes.

    E(t) = R(t + τ) C(t)ᵀ          R: body → table by the reference, C: body → first reading by the gyroscope

is constant if both are exact: it maps the first reading's coordinates to the table's. It changes by

    E(t₁)ᵀ E(t₂) = exp(ΔS δθ + Δ(C ω) τ − Eᵀ ω_E Δt + e)

with S the sensitivity of the integrated attitude to F and b (`increments`), τ the offset of the reference's clock, ω_E
the Earth's rate in table coordinates. A fix is the mean of E over a window: it uses every sample of the reference and
is robust to coloured errors within a window. Each e contains the errors of two fixes, which neighbours share, and the
integrated white noise of the gyroscope.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array, rotation_vectors
from rig.estimation.earth import EARTH_RATE_RAD_S
from rig.estimation.gyroscope.increments import course
from rig.estimation.statistics.bias_process import walk_covariance
from rig.estimation.statistics.variance_components import Mixed

MATRIX, BIAS, CLOCK, EARTH, COMMON = slice(0, 9), slice(9, 12), 12, slice(13, 16), 16
CLOCK_STD_S = 0.05  # prior std of the offset of a common clock: cameras' exposure, a sensor's filter
EARTH_PRECISION = 3 / EARTH_RATE_RAD_S**2  # its norm is known, its direction is not
INTERVALS, FEWEST_OF_INTERVAL = 6, 5  # intervals of a recording; increments in one
OUTLYING, FEWEST_SAMPLES = 6.0, 10  # times a fix's median error: an outlier; fewest samples to judge by
LEAST = 1e-3  # of the usual std: the least of a sample stated to be exact


@dataclass(frozen=True, slots=True)
class Fixes:
    """A reference's attitudes: k samples, grouped into N fixes.

    - `at_s` (k,): increasing times; `attitudes` (k, 3, 3): body to table; `fix` (k,): the fix of each sample.
    - `placement` (N,): fixes with one number share one error: the body lay still.
    - `joined` (N − 1,): True if the gyroscope's readings are complete from one fix to the next.
    - `std_rad` (k,): the stated standard deviation of each sample, None if none is stated.
    """

    at_s: Array
    attitudes: Array
    fix: NDArray[np.intp]
    placement: NDArray[np.intp]
    joined: NDArray[np.bool_]
    std_rad: Array | None = None


@dataclass(frozen=True, slots=True)
class AttitudeSamples:
    """The recording, and the samples (k,) of the reference that are used."""

    time_s: Array
    readings: Array
    fixes: Fixes
    kept: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class DriftState:
    """An iterate of F (3, 3), b (3,), τ."""

    matrix: Array
    bias: Array
    clock_s: float

    def after_step(self, theta: Array) -> "DriftState":
        """Return the state after a step θ."""
        matrix = self.matrix + theta[MATRIX].reshape(3, 3)
        return DriftState(matrix, self.bias + theta[BIAS], self.clock_s + float(theta[CLOCK]))


@dataclass(frozen=True, slots=True)
class FixedAttitudes:
    """N fixes: E (N, 3, 3), S (N, 3, 12), C ω (N, 3), middle times (N,), windows (N, 2); E (k, 3, 3) of all samples."""

    attitudes: Array
    sensitivities: Array
    turning: Array
    middles_s: Array
    windows_s: Array
    samples: Array


def average_fixes(recorded: AttitudeSamples, state: DriftState) -> FixedAttitudes:
    """Return the fixes by the gyroscope's integration with the parameters of a state."""
    fixes, time_s = recorded.fixes, recorded.time_s
    at_s = np.clip(fixes.at_s + state.clock_s, time_s[0], time_s[-1])
    integrated = course(time_s, recorded.readings, state.matrix, state.bias, at_s)
    samples = fixes.attitudes @ np.swapaxes(integrated.attitudes, -1, -2)
    turning = (integrated.attitudes @ integrated.rates_rad_s[..., None])[..., 0]
    count = len(fixes.placement)
    relative_weights = recorded.kept / _relative(fixes) ** 2
    weights = relative_weights / np.bincount(fixes.fix, weights=relative_weights, minlength=count)[fixes.fix]

    def mean(values: Array) -> Array:
        total = np.zeros((count, *values.shape[1:]))
        np.add.at(total, fixes.fix, values * weights.reshape(-1, *[1] * (values.ndim - 1)))
        return total

    left_vectors, _, right_vectors = np.linalg.svd(mean(samples))
    left_vectors[..., -1] *= np.linalg.det(left_vectors @ right_vectors)[:, None]
    first, last = (np.searchsorted(fixes.fix, np.arange(count), side=side) for side in ("left", "right"))
    return FixedAttitudes(
        left_vectors @ right_vectors,
        mean(integrated.sensitivities),
        mean(turning),
        mean(fixes.at_s),
        np.column_stack([fixes.at_s[first], fixes.at_s[last - 1]]),
        samples,
    )


def _relative(fixes: Fixes) -> Array:
    """Return the stated standard deviation (k,) of each sample over the median one."""
    if fixes.std_rad is None or not fixes.std_rad.any():
        return np.ones(len(fixes.at_s))
    usual = float(np.median(fixes.std_rad[fixes.std_rad > 0]))
    return np.maximum(fixes.std_rad / usual, LEAST)


def find_inliers(recorded: AttitudeSamples, fixes: FixedAttitudes) -> NDArray[np.bool_]:
    """Return the samples (k,) near the median of their fix, without outliers such as a mistaken marker."""
    fix = recorded.fixes.fix
    deviations = np.linalg.norm(rotation_vectors(np.swapaxes(fixes.attitudes[fix], -1, -2) @ fixes.samples), axis=1)
    order = np.lexsort((deviations, fix))
    count = np.bincount(fix)
    first = np.cumsum(count) - count
    middle = deviations[order][first + count // 2]
    kept: NDArray[np.bool_] = (count[fix] < FEWEST_SAMPLES) | (deviations <= OUTLYING * middle[fix])
    return kept


def drift_model(averaged: FixedAttitudes, fixes: Fixes) -> Mixed:
    """Return the mixed linear model of the increments between fixes."""
    joined = np.flatnonzero(fixes.joined)
    count, increments = len(fixes.placement), len(joined)
    step = np.zeros((increments, count))
    step[np.arange(increments), joined], step[np.arange(increments), joined + 1] = -1.0, 1.0
    inverse = np.swapaxes(averaged.attitudes[joined], -1, -2)
    observed = rotation_vectors(inverse @ averaged.attitudes[joined + 1])
    sensitivities, turning = (np.tensordot(step, values, 1) for values in (averaged.sensitivities, averaged.turning))
    earth = -inverse * (step @ averaged.middles_s)[:, None, None]
    intervals = increments // FEWEST_OF_INTERVAL if increments < INTERVALS * FEWEST_OF_INTERVAL else INTERVALS
    interval_of = np.arange(increments) * intervals // increments if intervals > 1 else np.zeros(increments)
    by_interval = [sensitivities * (interval_of == i)[:, None, None] for i in range(intervals if intervals > 1 else 0)]
    design = np.concatenate([sensitivities, turning[..., None], earth, *by_interval], axis=2)
    precision = np.zeros(design.shape[2])
    precision[CLOCK] = CLOCK_STD_S**-2.0
    precision[EARTH] = EARTH_PRECISION
    columns = np.arange(COMMON, design.shape[2]).reshape(-1, 12)
    groups = (columns[:, MATRIX].ravel(), columns[:, BIAS].ravel()) if by_interval else ()
    first = np.searchsorted(fixes.fix, np.arange(count))
    ratio = _relative(fixes)[first]
    same = (fixes.placement[:, None] == fixes.placement) * ratio[:, None] * ratio
    walk = walk_covariance(averaged.windows_s)
    return Mixed(observed, design, step @ same @ step.T, step @ walk @ step.T, precision, groups)
