"""Control charts of results that come one at a time: Shewhart's for a jump, EWMA for what is small and stays.

A chart needs the mean and the spread of a process in control. They are not known beforehand, and taken from a few first
runs they would make alarms many times as frequent as promised. So each result is held against those before it, by
Student's t (self-starting charts: Hawkins and Olwell, Cumulative Sum Charts, 1998, 7.1): in control the deviations are
independent and normal from the first on, and false alarms are as rare as designed however short the history is.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array

Alarms = NDArray[np.bool_]

FEWEST = 5  # results before which nothing is judged: of the spread of fewer, little is known
SMOOTHING = 0.15  # λ: weight of the newest deviation
EWMA_LIMIT = 2.8  # in standard deviations of the average; with the other an alarm in about 340 runs in control
SHEWHART_LIMIT = 4.0  # in standard deviations: 3 beside an EWMA would cost half the time between false alarms
SPREAD_MIN = 1e-12  # of a value's own size: what arithmetic leaves of equal values is no spread


@dataclass(frozen=True, slots=True)
class Chart:
    """A control chart, all (…, n). `deviation` is normal with std 1 in control, NaN of the first results; so is `ewma`.

    `limit` is that of `ewma`, `alarm` says that either was beyond its limit. What raised an alarm is no part of what
    later results are held against.
    """

    deviation: Array
    ewma: Array
    limit: Array
    alarm: Alarms

    @property
    def out_of_control(self) -> Alarms:
        """(…) whether the newest result raised an alarm."""
        newest: Alarms = self.alarm[..., -1]
        return newest


def chart(values: Array, std: Array) -> Chart:
    """Results (…, n) in the order of time, with the std that each states of itself."""
    shape = values.shape
    deviation, ewma, limit = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.nan)
    alarm = np.zeros(shape, dtype=bool)
    average = np.zeros(shape[:-1])
    for i in range(FEWEST - 1, shape[-1]):
        deviation[..., i] = _deviation(values[..., : i + 1], std[..., : i + 1], ~alarm[..., :i])
        average, limit[..., i] = step(average, deviation[..., i], i - FEWEST + 1)
        ewma[..., i] = average
        alarm[..., i] = beyond(deviation[..., i], average, limit[..., i])
    return Chart(deviation, ewma, limit, alarm)


def merged(deviations: Array) -> Chart:
    """The chart of deviations (n,) that others were standardised to: all check standards of one rig, in time."""
    ewma, limit, alarm = np.empty_like(deviations), np.empty_like(deviations), np.zeros(deviations.shape, dtype=bool)
    average = np.zeros(())
    for i, deviation in enumerate(deviations):
        average, limit[i] = step(average, deviation, i)
        ewma[i] = average
        alarm[i] = beyond(deviation, average, limit[i])
    return Chart(deviations, ewma, limit, alarm)


def step(average: Array, deviation: Array, before: int) -> tuple[Array, float]:
    """The EWMA with one more deviation, after so many `before` it, and its limit then.

    A single outlier is Shewhart's affair: it enters the average as no more than his limit.
    """
    smoothed = (1 - SMOOTHING) * average + SMOOTHING * np.clip(deviation, -SHEWHART_LIMIT, SHEWHART_LIMIT)
    settled = 1 - (1 - SMOOTHING) ** (2 * (before + 1))
    return smoothed, EWMA_LIMIT * float(np.sqrt(SMOOTHING / (2 - SMOOTHING) * settled))


def beyond(deviation: Array, average: Array, limit: float | Array) -> Alarms:
    """Whether one of the two charts raises an alarm."""
    return (np.abs(deviation) > SHEWHART_LIMIT) | (np.abs(average) > limit)


def _deviation(values: Array, std: Array, counted: Alarms) -> Array:
    """(…) deviation of the last result from those `counted` (…, i) before it, as the normal deviate as probable.

    With equal stds it is (x − x̄)/(s √(1 + 1/n)) whatever they are; else weights hold the variance between runs as well
    (as in `random_effects.fit`).
    """
    before, newest = values[..., :-1], values[..., -1]
    fixed = counted / std[..., :-1] ** 2
    total = fixed.sum(axis=-1)
    count = counted.sum(axis=-1)
    mean = (fixed * before).sum(axis=-1) / total
    beyond_own = (fixed * (before - mean[..., None]) ** 2).sum(axis=-1) - (count - 1)
    between = np.maximum(0.0, beyond_own / (total - (fixed**2).sum(axis=-1) / total))
    weights = counted / (std[..., :-1] ** 2 + between[..., None])
    total = weights.sum(axis=-1)
    mean = (weights * before).sum(axis=-1) / total
    scatter = (weights * (before - mean[..., None]) ** 2).sum(axis=-1) / (count - 1)
    spread = np.sqrt(scatter * (std[..., -1] ** 2 + between + 1 / total))
    student = (newest - mean) / np.maximum(spread, SPREAD_MIN * np.maximum(np.abs(mean), np.finfo(float).tiny))
    from scipy import special

    tail = np.maximum(special.stdtr(count - 1, -np.abs(student)), np.finfo(float).tiny)
    deviation: Array = -np.sign(student) * special.ndtri(tail)
    return deviation
