"""Control charts of single results: Shewhart's for a jump, EWMA (a weighted moving average) for a small shift.

A chart needs the mean and the standard deviation of a process in control. Estimates of these from a few first runs
would give far more alarms than designed. So each result is compared with all earlier ones by Student's t (self-starting
charts: Hawkins and Olwell, Cumulative Sum Charts, 1998, 7.1). In control, all deviations are independent and normal,
and false alarms are as rare as designed for any length of the history.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array

Alarms = NDArray[np.bool_]

MIN_RESULTS = 5  # before the first judgement: fewer do not determine the scatter
SMOOTHING = 0.15  # λ: weight of the newest deviation
EWMA_LIMIT = 2.8  # standard deviations; together with the other limit, an alarm in about 340 runs in control
SHEWHART_LIMIT = 4.0  # standard deviations: 3 together with an EWMA would halve the time between false alarms
MIN_SCATTER = 1e-12  # relative to a value: the rounding of equal values is not scatter


@dataclass(frozen=True, slots=True)
class Chart:
    """A control chart of n results: arrays (…, n).

    `deviation` is a result's deviation from the earlier ones: standard normal if the process is in control, NaN for the
    first results. `ewma` is its moving average, and `limit` the limit of `ewma`. `alarm` is true if `deviation` exceeds
    Shewhart's limit or `ewma` exceeds `limit`. Results with an alarm are not used to judge later ones.
    """

    deviation: Array
    ewma: Array
    limit: Array
    alarm: Alarms

    @property
    def out_of_control(self) -> Alarms:
        """Whether the newest result of each chart raised an alarm."""
        newest: Alarms = self.alarm[..., -1]
        return newest


def chart(values: Array, std: Array) -> Chart:
    """Return the chart of results (…, n), in the order of time, with their stated standard deviations."""
    shape = values.shape
    deviation, ewma, limit = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.nan)
    alarm = np.zeros(shape, dtype=bool)
    average = np.zeros(shape[:-1])
    for i in range(MIN_RESULTS - 1, shape[-1]):
        deviation[..., i] = _deviation(values[..., : i + 1], std[..., : i + 1], ~alarm[..., :i])
        average, limit[..., i] = step(average, deviation[..., i], i - MIN_RESULTS + 1)
        ewma[..., i] = average
        alarm[..., i] = raise_alarms(deviation[..., i], average, limit[..., i])
    return Chart(deviation, ewma, limit, alarm)


def merge_charts(deviations: Array) -> Chart:
    """Return the chart of standardised deviations (n,) of all check standards of one rig, in the order of time."""
    ewma, limit, alarm = np.empty_like(deviations), np.empty_like(deviations), np.zeros(deviations.shape, dtype=bool)
    average = np.zeros(())
    for i, deviation in enumerate(deviations):
        average, limit[i] = step(average, deviation, i)
        ewma[i] = average
        alarm[i] = raise_alarms(deviation, average, limit[i])
    return Chart(deviations, ewma, limit, alarm)


def step(average: Array, deviation: Array, before: int) -> tuple[Array, float]:
    """Return the moving `average` (EWMA) after one more deviation, and the limit of this average.

    `before` is the number of earlier deviations, from which the limit follows. Shewhart's chart detects single
    outliers, so deviations are clipped to its limit before they enter the average.
    """
    smoothed = (1 - SMOOTHING) * average + SMOOTHING * np.clip(deviation, -SHEWHART_LIMIT, SHEWHART_LIMIT)
    settled = 1 - (1 - SMOOTHING) ** (2 * (before + 1))
    return smoothed, EWMA_LIMIT * float(np.sqrt(SMOOTHING / (2 - SMOOTHING) * settled))


def raise_alarms(deviation: Array, average: Array, limit: float | Array) -> Alarms:
    """Return whether each deviation exceeds Shewhart's limit, or its EWMA `average` exceeds the `limit`."""
    return (np.abs(deviation) > SHEWHART_LIMIT) | (np.abs(average) > limit)


def _deviation(values: Array, std: Array, counted: Alarms) -> Array:
    """Return the deviation (…) of the last of results (…, i + 1) from the others, as a standard normal deviate.

    Only the other results marked in `counted` are used. If all `std` are equal, Student's t = (x − x̄)/(s √(1 + 1/n)) is
    converted to the normal deviate of equal probability; x is the last result, x̄ and s are the mean and the standard
    deviation of the n others. Otherwise the mean is weighted, and the weights include the variance between runs (as in
    `random_effects.fit`).
    """
    before, newest = values[..., :-1], values[..., -1]
    # First a mean with fixed weights, from which the variance between runs follows; then one with both variances.
    fixed = counted / std[..., :-1] ** 2
    total = fixed.sum(axis=-1)
    count = counted.sum(axis=-1)
    mean = (fixed * before).sum(axis=-1) / total
    excess = (fixed * (before - mean[..., None]) ** 2).sum(axis=-1) - (count - 1)
    between = np.maximum(0.0, excess / (total - (fixed**2).sum(axis=-1) / total))
    weights = counted / (std[..., :-1] ** 2 + between[..., None])
    total = weights.sum(axis=-1)
    mean = (weights * before).sum(axis=-1) / total
    scatter = (weights * (before - mean[..., None]) ** 2).sum(axis=-1) / (count - 1)
    prediction_std = np.sqrt(scatter * (std[..., -1] ** 2 + between + 1 / total))
    student = (newest - mean) / np.maximum(prediction_std, MIN_SCATTER * np.maximum(np.abs(mean), np.finfo(float).tiny))
    from scipy import special

    tail = np.maximum(special.stdtr(count - 1, -np.abs(student)), np.finfo(float).tiny)
    deviation: Array = -np.sign(student) * special.ndtri(tail)
    return deviation
