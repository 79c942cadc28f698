"""The mean of readings over a turn or an arc, and the mean rate of the arm with the same weights.

In an unweighted mean a vibration leaves a remainder that depends on its phase at both ends: 3 mrad/s at 8.5 Hz leave 20
µrad/s in six seconds, more than the noise of a good gyroscope. A vibration that the encoders measure affects both means
alike. Any other vibration shows in the readings as spectral lines, which the weights cancel (`mean_weights`).

The residuals of the readings, without lines and rate, are the noise, which is usually white.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array, median
from rig.estimation.statistics.mean_weights import mean_weights
from rig.estimation.statistics.rounding import Steps
from rig.observation.statistics.coloured_noise import ORDERS
from rig.observation.statistics.mean import Mean, compute_weighted_means, whole
from rig.observation.statistics.spectral_lines import (
    EMPTY,
    LineSearch,
    column_count,
    find_lines,
    fit_columns,
    fit_residuals,
    harmonics,
    median_power,
    unit_columns,
    waves,
)
from rig.observation.statistics.tapered_weights import MAIN_LOBE, apply_window
from rig.observation.statistics.vibration_noise import SHORT_ORDERS, estimate_noise

MIN_LINE_READINGS = 48  # fewest readings of a turn in which spectral lines are sought: enough for two lines
SLOW_CYCLES = 8.0  # per revolution: slower lines are hard to separate from waves once and twice per revolution
MIN_POWER_RATIO = 50.0  # of a slow ripple to the median of the encoders' noise, which by chance reaches 15
MAX_NOISE_GAIN = 3.0  # of the arm's angles, up to which weights remove slow spectral lines
SENSOR_SEARCH = LineSearch(slowest=5.0)
ENCODER_SEARCH = LineSearch(slowest=2.5, sidebands=0, most=5)


@dataclass(frozen=True, slots=True)
class SampledTurn:
    """A turn or an arc at a sensor's n samples.

    - `fraction` (n,): elapsed fraction of the turn's time.
    - `rates_rad_s` (n, 3): the flange's mean rate around each sample, from the encoders.
    - `uneven_rad_s` (n,): that rate along the axis minus the mean rate, which follows from the angles at the turn's
      ends.
    - `regressors` (n, k): columns of the turn's harmonics; for an arc, their means are subtracted.
    - `sidebands`: number of sidebands of spectral lines, see `Revolution`.
    - `encoders_true`: whether the encoders are right within a turn, not only over whole turns.
    - `closed`: whether the turn is a whole number of turns, not an arc.
    - `complete`: whether samples follow each other closely, and no long gap is among them.
    """

    fraction: Array
    rates_rad_s: Array
    uneven_rad_s: Array
    regressors: Array
    sidebands: int
    encoders_true: bool
    closed: bool
    complete: bool


@dataclass(frozen=True, slots=True)
class Lines:
    """Spectral lines, by their `cycles` (k,) in the turn; the encoders do not measure the last `not_encoded` of them.

    - `encoded` (n, m): columns to remove from the residuals: a slow ripple that the encoders measure, its changes, and
      the remainder of the encoders' rate, mostly noise.
    - `rate` (n, 0 to 2): columns that the weights cancel in addition to the lines. If the ripple is sampled unevenly,
      because samples are few or there is a gap, the column is the rate itself. Otherwise, for whole turns, the columns
      are the changes of the slow ripple, of which a lagging sensor reads a small part.
    """

    cycles: Array
    not_encoded: int
    encoded: Array
    rate: Array


def turn_mean(readings: Array, steps: Steps, turn: SampledTurn) -> tuple[Mean, Array]:
    """Return the mean of readings (n, 3) with resolution `steps`, and the weights (n,) of the readings in it.

    The arm's rates must be averaged with the same weights.
    """
    ones = whole(readings)
    steady = np.column_stack([ones, turn.regressors])
    lines = _find_turn_lines(readings, steady, turn)
    vibration = waves(lines.cycles, turn.fraction, turn.sidebands)
    weights = mean_weights(ones, np.column_stack([turn.regressors, lines.rate, vibration]))
    added = np.zeros(3)
    is_slow = slow_columns(lines.cycles, turn.sidebands)
    if is_slow.any():
        nuisance = np.column_stack([turn.regressors, lines.rate, vibration[:, ~is_slow]])
        without_slow = mean_weights(ones, nuisance)
        change, explained = (weights - without_slow)[0], np.column_stack([ones, nuisance, lines.encoded])
        added = _slow_line_variance(readings, turn, vibration[:, is_slow], change, explained)
        weights = without_slow if _gain(weights) > MAX_NOISE_GAIN else weights
    # The noise is the residual of a fit of all that is not noise.
    columns = unit_columns(np.column_stack([steady, lines.rate, vibration, lines.encoded]))
    coefficients, _, rank, _ = np.linalg.lstsq(columns, readings, rcond=1e-6)
    smooth = columns @ coefficients
    noise = estimate_noise(readings - smooth, int(rank), steps, SHORT_ORDERS if lines.not_encoded else ORDERS)
    (mean,) = compute_weighted_means(readings, ones, weights, smooth=smooth, noise=noise, steps=steps)
    return replace(mean, variance=mean.variance + added, slow_lines=added, cycles=lines.cycles), weights[0]


def _gain(weights: Array) -> float:
    """Return the noise that the angles cause in a mean rate with weights (1, n), divided by that in the plain mean."""
    return float(np.linalg.norm(np.diff(weights[0], prepend=0.0, append=0.0)) * weights.size / np.sqrt(2))


def _slow_line_variance(readings: Array, turn: SampledTurn, slow: Array, change: Array, explained: Array) -> Array:
    """Return the variance (3,) of the mean due to slow spectral lines, with columns `slow` (n, k).

    The readings determine these lines poorly. `change` (n,) are weights that cancel the lines minus weights that do
    not, so `change` gives the difference between two means. The result is the larger of two numbers: the square of this
    difference, and the variance that lines with the fitted amplitudes but random phases would add to the mean.
    `explained` (n, m) are the columns of everything else.
    """
    without_ripple = fit_residuals(np.column_stack([whole(readings), turn.uneven_rad_s]), readings)
    residuals = fit_residuals(explained, readings)
    return np.maximum((change @ without_ripple) ** 2, line_variance(fit_columns(slow, residuals), change @ slow))


def line_variance(sizes: Array, means: Array) -> Array:
    """Return the variance (3,) that spectral lines add to a mean, from the fitted `sizes` (k, 3) of their columns.

    `means` (k,) are the columns' means with the weights of that mean. Only the lines' amplitude is used, because with
    some phases even a large line hardly changes the mean.
    """
    powers = (sizes**2).reshape(-1, 2, 3).sum(axis=1)
    kept = (means**2).reshape(-1, 2).sum(axis=1)
    variance: Array = kept @ powers / 2
    return variance


def slow_columns(cycles: Array, sidebands: int) -> NDArray[np.bool_]:
    """Return a mask (k,) of those columns of `waves` that belong to spectral lines slower than `SLOW_CYCLES`."""
    return np.repeat(cycles < SLOW_CYCLES, column_count(sidebands))


def _find_turn_lines(readings: Array, steady: Array, turn: SampledTurn) -> Lines:
    """Return the spectral lines of readings (n, 3) in the part that the `steady` columns (n, k) do not explain.

    The encoders' rate is searched for spectral lines first, because its fast lines appear in the readings at the same
    frequency. The residuals of the readings, without these lines, are then searched for the other lines.
    """
    uneven = turn.uneven_rad_s[:, None]
    none = uneven[:, :0]
    if len(readings) < MIN_LINE_READINGS:
        return Lines(EMPTY, 0, none, uneven)
    if not turn.complete:
        fixed = np.column_stack([steady, uneven])
        cycles = find_lines(
            readings - fixed @ fit_columns(fixed, readings),
            LineSearch(sidebands=turn.sidebands),
            fraction=turn.fraction,
        )
        return Lines(cycles, len(cycles), none, uneven)
    ripple_rate, residuals = (values - steady @ fit_columns(steady, values) for values in (uneven, readings))
    if not turn.encoders_true:
        cycles = find_lines(residuals, LineSearch(sidebands=turn.sidebands), fraction=turn.fraction)
        return Lines(cycles, len(cycles), ripple_rate, none)
    search = replace(ENCODER_SEARCH, floor=median_power(residuals))
    ripple = find_lines(ripple_rate, search, fraction=turn.fraction)
    columns = waves(ripple, turn.fraction, ENCODER_SEARCH.sidebands)
    sizes = fit_columns(columns, ripple_rate)
    fast = ~slow_columns(ripple, ENCODER_SEARCH.sidebands)  # mask of the columns of fast lines
    slow = ripple_rate - columns[:, fast] @ sizes[fast]  # the ripple without its fast lines
    slow_part = _fit_slow_part(slow, turn.fraction)
    smooth = slow_part if _has_slow_ripple(slow) else none
    late = _changes(smooth) if turn.closed else none  # over an arc it resembles encoder errors
    encoded = np.column_stack([smooth, late, slow - slow_part])
    explained = np.column_stack([steady, encoded, columns[:, fast]])
    residuals = fit_residuals(explained, readings)
    encoded_lines = ripple[ripple >= SLOW_CYCLES]
    cycles = find_lines(residuals, SENSOR_SEARCH, encoded_lines, turn.fraction)
    return Lines(cycles, len(cycles) - len(encoded_lines), encoded, late)


def lag_columns(rate: Array, columns: Array, fraction: Array) -> Array:
    """Return columns (n, 2) by which a lagging sensor misreads a rate's slow ripple, or (n, 0) without slow ripple.

    The ripple is sought in the part of the `rate` (n,) that `columns` (n, k) do not explain.
    """
    residuals = rate[:, None] - columns @ fit_columns(columns, rate[:, None])
    return _changes(_fit_slow_part(residuals, fraction) if _has_slow_ripple(residuals) else residuals[:, :0])


def _changes(slow: Array) -> Array:
    """Return the first and second differences (n, 2 k) of a rate (n, k): the effects of a sensor's lag and filter."""
    change = np.gradient(slow, axis=0)
    return np.column_stack([change, np.gradient(change, axis=0)])


def _has_slow_ripple(rate: Array) -> bool:
    """Return whether the part of a rate (n, 1) with less than `SLOW_CYCLES` per turn is more than noise.

    The test uses the angle, the sum of the rate, because the encoders' noise is white in the angle.
    """
    powers = np.abs(np.fft.rfft(apply_window(np.cumsum(rate, axis=0))[:, 0])) ** 2
    slow_bins = int(SLOW_CYCLES) + MAIN_LOBE
    noise = median(powers[slow_bins:])
    return bool(powers[1:slow_bins].max() > MIN_POWER_RATIO * noise)


def _fit_slow_part(rate: Array, fraction: Array) -> Array:
    """Return the part of a rate (n, 1) with less than `SLOW_CYCLES` cycles per turn.

    The part is fitted by harmonics of a wave that takes two turns, because a vibration is not periodic in one turn.
    """
    halves = harmonics(np.pi * fraction, int(2 * SLOW_CYCLES))
    slow: Array = halves @ fit_columns(halves, rate)
    return slow
