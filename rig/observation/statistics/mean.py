"""Means of readings in any unit, with the variance of the mean, at rest and while the arm vibrates."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import Quantity
from rig.estimation.arrays import Array
from rig.estimation.statistics.mean_weights import even_groups
from rig.estimation.statistics.rounding import Steps, bound_rounding_variance
from rig.observation.statistics.coloured_noise import fit_autoregression
from rig.observation.statistics.tapered_weights import dof_at_zero, flank_s, noise_at_zero, vibrates, weights
from rig.observation.windows import Window


@dataclass(frozen=True, slots=True)
class Mean:
    """The mean of readings in any unit.

    - `mean` (3,), its `variance` (3,), the `noise` (3,) of one reading, and the number of `samples`.
    - `dof` (3,): degrees of freedom of the variance, fewer than the samples if these are not independent.
    - `cycles` (k,): for each spectral line removed from the mean, its number of cycles in the window.
    - `rounding`, `slow_lines` (3,): parts of the variance due to rounding, and to spectral lines too slow to remove.
    - `weights` (n,): weights of the readings, for averages of other data of the same samples; empty if not stored.
    """

    mean: Array
    variance: Array
    noise: Array
    samples: int
    dof: Array | float = np.inf
    cycles: Array = field(default_factory=partial(np.zeros, 0))
    rounding: Array | float = 0.0
    slow_lines: Array | float = 0.0
    weights: Array = field(default_factory=partial(np.zeros, 0))


@dataclass(frozen=True, slots=True)
class MeanNoise:
    """Noise of single readings in any unit, by axis.

    `scatter` (3,) is the variance of one reading. `in_a_mean` (3,) is the variance of a long mean times its number of
    readings, with `dof` (3,) degrees of freedom; it differs from `scatter` if readings are correlated.
    """

    scatter: Array
    in_a_mean: Array
    dof: Array | float


@dataclass(frozen=True, slots=True)
class StaticReading:
    """A mean `reading` at rest: in the procedure's dwell of this `index`, or in a placement of a file.

    `attitude` (3, 3) is the rotation from the arm's base frame into the flange's, or from the table's into the body's.
    """

    index: int
    name: str
    reading: Mean
    attitude: Array
    window: Window


@dataclass(frozen=True, slots=True)
class QuantityInDwell:
    """A `quantity` of a sensor in one dwell, with the dwell's `index` and its name `dwell`, "" if not known."""

    sensor: str
    quantity: Quantity
    index: int
    dwell: str = field(compare=False)


@dataclass(frozen=True, slots=True)
class ReadAtRest:
    """The mean `reading` of a quantity in one dwell, and the stated norm `expected` there, in SI units, or None."""

    subject: QuantityInDwell
    reading: Mean
    expected: float | None


def dof_by_axis(dofs: Iterable[Array | float]) -> Array:
    """Return degrees of freedom (N, 3) from N items, each of which is one number for all axes or an array (3,)."""
    return np.array([np.broadcast_to(dof, 3) for dof in dofs])


def compute_weighted_means(
    readings: Array, groups: Array, weights: Array, *, smooth: Array, noise: MeanNoise, steps: Steps
) -> tuple[Mean, ...]:
    """Return the weighted means of p groups of readings, such as the segments of a window, or one for the whole window.

    - readings (n, 3): in any unit, recorded in `steps`.
    - groups (n, p): above zero if a reading belongs to a group.
    - weights (p, n): add up to one over each group's readings and cancel nuisance columns
      (`rig.estimation.statistics.mean_weights`).
    - smooth (n, 3): the readings without noise.

    The variance includes the part of the rounding that remains in a mean of any length.
    """
    return tuple(
        _average_group(readings, group > 0, row, smooth=smooth, noise=noise, steps=steps)
        for group, row in zip(groups.T, weights, strict=True)
    )


def _average_group(
    readings: Array, group: NDArray[np.bool_], weights: Array, *, smooth: Array, noise: MeanNoise, steps: Steps
) -> Mean:
    """Return the mean of one group by its weights, with the variance due to noise and rounding."""
    rounding = bound_rounding_variance(readings[group], steps, smooth[group], noise.scatter)
    return Mean(
        mean=weights @ readings,
        variance=noise.in_a_mean * float(weights @ weights) + rounding,
        noise=np.sqrt(noise.scatter),
        samples=int(np.count_nonzero(group)),
        dof=noise.dof,
        rounding=rounding,
        weights=weights,
    )


def whole(readings: Array) -> Array:
    """Return groups (n, 1) that take all readings (n, 3) into one mean."""
    return even_groups(np.zeros(len(readings), dtype=np.intp), 1)


def even_mean(readings: Array, steps: Steps) -> Mean:
    """Return the unweighted mean of readings (n, 3) with resolution `steps`, without vibration.

    The noise is the readings' scatter, and at least the rounding to steps. The variance of the mean includes their
    correlation, by `fit_autoregression` of each axis, and the part of rounding that does not average out.
    """
    variance = np.maximum(readings.var(axis=0, ddof=1), steps.variance)
    coloured = [fit_autoregression(axis) for axis in (readings - readings.mean(axis=0)).T]
    noise = MeanNoise(
        scatter=variance,
        in_a_mean=variance * np.array([axis.factor for axis in coloured]),
        dof=np.array([axis.dof for axis in coloured]),
    )
    groups = whole(readings)
    still = np.zeros(readings.shape)
    (mean,) = compute_weighted_means(readings, groups, groups.T / len(readings), smooth=still, noise=noise, steps=steps)
    return mean


def mean_at_rest(readings: Array, time_s: Array, window: Window, steps: Steps) -> tuple[Mean, Window]:
    """Return the mean of readings (n, 3) with resolution `steps`, at times (n,), and the window that it represents.

    If the arm vibrates, weights are tapered (`average_tapered`), because 2 mg at 14 Hz leave 10 µg in an unweighted
    mean of three seconds. The window then reaches from half-way up the first flank to half-way down the last, because
    an unweighted mean over this window would have the same variance due to a random walk of the bias, within a
    thousandth.
    """
    if vibrates(readings):
        half_s = flank_s(window.end_s - window.start_s) / 2
        averaged_window = Window(window.start_s + half_s, window.end_s - half_s)
        return average_tapered(readings, time_s, window, steps), averaged_window
    return even_mean(readings, steps), window


def average_tapered(readings: Array, time_s: Array, window: Window, steps: Steps) -> Mean:
    """Return the mean of readings (n, 3) with resolution `steps` at times (n,), weighted most in the middle.

    The variance contains the noise but not the vibration, which the weights cancel.
    """
    variance = np.maximum(np.var(readings, axis=0, ddof=1), steps.variance)
    at_zero = np.minimum(noise_at_zero(readings), variance)
    noise = MeanNoise(scatter=variance, in_a_mean=at_zero, dof=np.full(3, dof_at_zero(len(readings))))
    tapered = weights(time_s, window.start_s, window.end_s)[None]
    still = np.zeros(readings.shape)
    (mean,) = compute_weighted_means(readings, whole(readings), tapered, smooth=still, noise=noise, steps=steps)
    return mean
