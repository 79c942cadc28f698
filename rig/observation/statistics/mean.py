"""Means of readings in any unit, with the variance of the mean: where nothing passes, where the arm shakes."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import Quantity
from rig.estimation.arrays import Array
from rig.estimation.statistics.mean_weights import even_groups
from rig.estimation.statistics.rounding import Steps, rounding_left
from rig.observation.statistics.coloured_noise import left_of
from rig.observation.statistics.tapered_weights import flank_s, freedom_at_zero, noise_at_zero, vibrates, weights
from rig.observation.windows import Window


@dataclass(frozen=True, slots=True)
class Mean:
    """Mean of readings in any unit: mean (3,), variance (3,) of that, `noise` (3,) of one, and how many there were.

    `freedom` (3,) are the variance's degrees of freedom: fewer than samples where these are not independent. `cycles`
    (k,): how often lines come in the readings that were taken out of the mean. `rounding` (3,) is the part of the
    variance that rounding to steps leaves. `weights` (n,) are those of the readings, which make the mean of whatever
    else is averaged over the same samples; none where they are not kept.
    """

    mean: Array
    variance: Array
    noise: Array
    samples: int
    freedom: Array | float = np.inf
    cycles: Array = field(default_factory=partial(np.zeros, 0))
    rounding: Array | float = 0.0
    weights: Array = field(default_factory=partial(np.zeros, 0))


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise of single readings in any unit, by axis.

    `scatter` (3,) is the variance of one reading, `in_a_mean` (3,) what of it counts in a mean over long, `freedom`
    (3,) the degrees of freedom of that.
    """

    scatter: Array
    in_a_mean: Array
    freedom: Array | float


@dataclass(frozen=True, slots=True)
class Held:
    """A mean `reading` of what was held still: in a dwell of the procedure, by its `index`, or a placement of a file.

    `attitude` (3, 3) is the rotation from the arm's base frame into the flange's, or from the table's into the body's.
    """

    index: int
    name: str
    reading: Mean
    attitude: Array
    window: Window


@dataclass(frozen=True, slots=True)
class QuantityInDwell:
    """A `quantity` of a sensor in one dwell, by its `index`; its name is empty where nothing tells it."""

    sensor: str
    quantity: Quantity
    index: int
    dwell: str = field(compare=False)


@dataclass(frozen=True, slots=True)
class ReadAtRest:
    """The mean `reading` of a quantity in one dwell.

    `expected` is the size that it is known to have there, in SI units, None where that was not said.
    """

    of: QuantityInDwell
    reading: Mean
    expected: float | None


def by_axis(freedom: Iterable[Array | float]) -> Array:
    """(N, 3) degrees of freedom of N means' variances, of which some are known for all axes alike."""
    return np.array([np.broadcast_to(each, 3) for each in freedom])


def weighted_means(
    readings: Array, groups: Array, weights: Array, *, smooth: Array, noise: Noise, steps: Steps
) -> tuple[Mean, ...]:
    """Return the means of p groups of readings by their weights: one group is a whole window, several its segments.

    readings (n, 3): in any unit, recorded in `steps`. groups (n, p): above zero where a reading belongs to a group.
    weights (p, n): those of each group add up to one over its readings; those of others leave nothing of nuisance
    columns (`rig.estimation.statistics.mean_weights`). smooth (n, 3): the part of the readings that is no noise. What
    rounding leaves in a mean, however many readings it has, is part of its variance.
    """
    return tuple(
        _weighted_mean(readings, own > 0, row, smooth=smooth, noise=noise, steps=steps)
        for own, row in zip(groups.T, weights, strict=True)
    )


def _weighted_mean(
    readings: Array, own: NDArray[np.bool_], weights: Array, *, smooth: Array, noise: Noise, steps: Steps
) -> Mean:
    rounding = rounding_left(readings[own], steps, smooth[own], noise.scatter)
    return Mean(
        mean=weights @ readings,
        variance=noise.in_a_mean * float(weights @ weights) + rounding,
        noise=np.sqrt(noise.scatter),
        samples=int(np.count_nonzero(own)),
        freedom=noise.freedom,
        rounding=rounding,
        weights=weights,
    )


def whole(readings: Array) -> Array:
    """Return the groups (n, 1) of readings (n, 3) that are all of one mean."""
    return even_groups(np.zeros(len(readings), dtype=np.intp), 1)


def even_mean(readings: Array, steps: Steps) -> Mean:
    """The mean of readings (n, 3) in these steps in which nothing passes: all of them count alike.

    The noise is their scatter, and never below the rounding to steps; the variance of the mean allows for readings that
    are not white, which `left_of` tells of each axis. What rounding leaves in a mean however many samples there are is
    added.
    """
    variance = np.maximum(readings.var(axis=0, ddof=1), steps.variance)
    coloured = [left_of(axis) for axis in (readings - readings.mean(axis=0)).T]
    noise = Noise(
        scatter=variance,
        in_a_mean=variance * np.array([axis.factor for axis in coloured]),
        freedom=np.array([axis.freedom for axis in coloured]),
    )
    groups = whole(readings)
    still = np.zeros(readings.shape)
    (mean,) = weighted_means(readings, groups, groups.T / len(readings), smooth=still, noise=noise, steps=steps)
    return mean


def mean_at_rest(readings: Array, time_s: Array, window: Window, steps: Steps) -> tuple[Mean, Window]:
    """The mean of readings (n, 3) in these steps, at times (n,), and from when to when it is said to last.

    Where the arm vibrates weights come and go, see `tapered_mean`: 2 mg at 14 Hz leave 10 µg in an even mean of three
    seconds. Such a mean lasts from where the weights have come half-way to where they have gone half-way: so long an
    even one is as far from another, for a bias that walks, to a thousandth.
    """
    if vibrates(readings):
        half_s = flank_s(window.end_s - window.start_s) / 2
        lasting = Window(window.start_s + half_s, window.end_s - half_s)
        return tapered_mean(readings, time_s, window, steps), lasting
    return even_mean(readings, steps), window


def tapered_mean(readings: Array, time_s: Array, window: Window, steps: Steps) -> Mean:
    """The mean of readings (n, 3) in these steps, at times (n,): those in the middle of the window count most.

    The variance is that of the noise without the vibration, which the weights leave nothing of.
    """
    variance = np.maximum(np.var(readings, axis=0, ddof=1), steps.variance)
    at_zero = np.minimum(noise_at_zero(readings), variance)
    noise = Noise(scatter=variance, in_a_mean=at_zero, freedom=np.full(3, freedom_at_zero(len(readings))))
    tapered = weights(time_s, window.start_s, window.end_s)[None]
    still = np.zeros(readings.shape)
    (mean,) = weighted_means(readings, whole(readings), tapered, smooth=still, noise=noise, steps=steps)
    return mean
