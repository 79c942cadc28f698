"""Means of readings in any unit, with the variance of the mean: where nothing passes, where the arm shakes."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from rig.data.quantity import Quantity
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.rounding import Steps, rounding_left
from rig.observation.coloured_noise import Left, left_of
from rig.observation.tapered_weights import flank_s, freedom_at_zero, noise_at_zero, vibrates, weights
from rig.observation.windows import Window


@dataclass(frozen=True, slots=True)
class Mean:
    """Mean of readings in any unit: mean (3,), variance (3,) of that, `noise` (3,) of one, and how many there were.

    `freedom` (3,) are the variance's degrees of freedom: fewer than samples where these are not independent. `cycles`
    (k,): how often lines come in the readings that were taken out of the mean. `rounding` (3,) is the part of the
    variance that rounding to steps leaves.
    """

    mean: Array
    variance: Array
    noise: Array
    samples: int
    freedom: Array | float = np.inf
    cycles: Array = field(default_factory=partial(np.zeros, 0))
    rounding: Array | float = 0.0


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
class ReadAtRest:
    """What was read of a `quantity` in one dwell, by its `index` and name, or the Fault for which there is no mean.

    `expected` is the size that it is known to have there, in SI units, None where that was not said.
    """

    sensor: str
    quantity: Quantity
    index: int
    dwell: str
    reading: Mean | Fault
    expected: float | None


def by_axis(freedom: Iterable[Array | float]) -> Array:
    """(N, 3) degrees of freedom of N means' variances, of which some are known for all axes alike."""
    return np.array([np.broadcast_to(each, 3) for each in freedom])


def even_mean(readings: Array, steps: Steps, left: Callable[[Array], Left] = left_of) -> Mean:
    """The mean of readings (n, 3) in these steps in which nothing passes: all of them count alike.

    The noise is their scatter, and never below the rounding to steps; the variance of the mean allows for readings that
    are not white, which `left` tells of each axis. What rounding leaves in a mean however many samples there are is
    added.
    """
    variance = np.maximum(readings.var(axis=0, ddof=1), steps.variance)
    rounding = rounding_left(readings, steps, np.zeros(readings.shape), variance)
    coloured = [left(axis) for axis in (readings - readings.mean(axis=0)).T]
    factor = np.array([each.factor for each in coloured])
    return Mean(
        mean=readings.mean(axis=0),
        variance=variance * factor / len(readings) + rounding,
        noise=np.sqrt(variance),
        samples=len(readings),
        freedom=np.array([each.freedom for each in coloured]),
        rounding=rounding,
    )


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
    shares = weights(time_s, window.start_s, window.end_s)
    variance = np.maximum(np.var(readings, axis=0, ddof=1), steps.variance)
    at_zero = np.minimum(noise_at_zero(readings), variance)
    rounding = rounding_left(readings, steps, np.zeros(readings.shape), variance)
    return Mean(
        mean=shares @ readings,
        variance=at_zero * float(shares @ shares) + rounding,
        noise=np.sqrt(variance),
        samples=len(readings),
        freedom=np.full(3, freedom_at_zero(len(readings))),
        rounding=rounding,
    )
