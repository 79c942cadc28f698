"""The rounding error of a mean of rounded readings, a part of which remains however many are averaged.

The mean of x + noise, rounded to multiples of q, has the error Σ (−1)ⁿ q/(πn) exp(−2(πnσ/q)²) sin(2πnx/q): the sawtooth
of the rounding error, each harmonic damped by the characteristic function of the noise that carries the reading across
steps (Widrow and Kollár, Quantization Noise, 2008). The error's mean square over x, Σ q²/(2π²n²) exp(−(2πnσ/q)²), is at
most q²/12 times the first exponential, because Σ q²/(2π²n²) = q²/12.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array

MIN_LEVELS = 3  # different readings of an axis that is not constant
MIN_OTHER_FRACTION = 0.01  # least share of readings beyond the two most frequent values that determines the noise
# Fewest occurrences of a repeated value; least fraction of readings with repeated values that shows steps.
MIN_REPEATS, MIN_REPEATED_FRACTION = 3, 0.25
LARGE_NOISE_STEPS = 4.0  # least noise, in steps, that averages out all rounding
MAX_READINGS = 20_000  # readings used to find the steps
SAME_VALUE_STEPS = 1e-3  # values closer than this are equal
HALF_STEP_TOLERANCE = 0.25  # in steps: whole and half-way values are half a step apart
MAX_UNIT_CHANGE = 0.2  # relative, by the source's scale factor
MIN_ZERO_VALUES = 8  # different values that determine which of them is zero
MIN_MEAN_LENGTH = 0.5  # of unit vectors that have one direction


@dataclass(frozen=True, slots=True)
class Steps:
    """The steps of rounded numbers: `unit` (3,) of each axis, or one number for all axes.

    If `cut`, numbers were truncated toward zero, then shifted to the middle of their interval. Zero represents all
    values within one unit in either direction, so the next values are one and a half units away from it. If the
    source added an offset afterwards, `zero` (3,) is the fraction of a unit by which zero has moved, NaN if unknown.
    """

    unit: Array | float
    cut: bool = False
    zero: Array | float = np.nan

    @property
    def units(self) -> Array:
        """The unit of each axis, (3,); one number for all axes is repeated."""
        unit = np.asarray(self.unit, dtype=np.float64)
        return unit if unit.ndim else np.broadcast_to(unit, 3)

    @property
    def variance(self) -> Array:
        """The variance (3,) of a reading due to rounding: a twelfth of the square of a step."""
        result: Array = self.units**2 / 12
        return result

    def widths(self, readings: Array) -> Array:
        """Return the widest interval (3,) of values that one of the readings (n, 3) may represent."""
        if not self.cut:
            return self.units
        wide = [bool(self.reads_zero(axis, readings[:, axis]).any()) for axis in range(len(self.units))]
        return np.where(wide, 2 * self.units, self.units)

    def reads_zero(self, axis: int, readings: Array) -> NDArray[np.bool_]:
        """Return a mask (n,) of the readings of an `axis` that were truncated to zero; all if `zero` is unknown."""
        zero = float(np.broadcast_to(self.zero, len(self.units))[axis])
        if not np.isfinite(zero):
            return np.ones(len(readings), dtype=np.bool_)
        beyond = readings / self.units[axis] - zero
        result: NDArray[np.bool_] = np.abs(beyond - np.rint(beyond)) < HALF_STEP_TOLERANCE
        return result


def cut_steps(readings: Array, unit: float) -> Steps:
    """Return the resolution steps of readings (n, 3) that the source has truncated toward zero to multiples of `unit`.

    The source may have applied an offset and a scale factor near one after truncation. Nonzero readings are in the
    middle of their intervals, so they differ from the reading that was zero by whole units and a half, which shows
    where zero is.
    """
    steps = find_steps(readings)
    units = np.where(np.abs(steps / unit - 1) < MAX_UNIT_CHANGE, steps, unit)
    zero = np.full(len(units), np.nan)
    for axis in range(len(units)):
        levels = np.unique(readings[:, axis]) / units[axis]
        if len(levels) >= MIN_ZERO_VALUES:
            halves = np.mean(np.exp(2j * np.pi * levels))
            zero[axis] = float(np.angle(halves) / (2 * np.pi)) + 0.5 if abs(halves) > MIN_MEAN_LENGTH else np.nan
    return Steps(units, cut=True, zero=zero)


def find_steps(readings: Array) -> Array:
    """Return the steps (3,) of readings (n, 3), zero for an axis without visible steps.

    If noise is much larger than a step, hardly any number repeats, so steps cannot be found, and they do not matter. A
    nearly constant axis has too few different numbers, so it gets the largest step of the other axes.
    """
    stride = max(len(readings) // MAX_READINGS, 1)
    units = np.array([_find_unit(axis) for axis in readings[::stride].T])
    still = np.array([len(np.unique(axis)) < MIN_LEVELS for axis in readings[::stride].T])
    return np.where(still, np.maximum(units, units.max()), units)


def bound_rounding_variance(readings: Array, steps: Steps, smooth: Array, scatter: Array) -> Array:
    """Return an upper bound of the variance (3,) that rounding adds to a mean of readings (n, 3).

    `smooth` (n, 3) is the readings' known variation across steps, such as the ripple of the arm; `scatter` (3,) is the
    remaining variance, due to noise and rounding (Sheppard). Readings with fewer than three different values do not
    determine their noise, which may be zero.
    """
    units = steps.units
    coarse, bounds = np.flatnonzero((units > 0) & (scatter <= (LARGE_NOISE_STEPS * units) ** 2)), np.zeros(len(units))
    widths = steps.widths(readings) if len(coarse) else units
    for axis in coarse.tolist():
        fractions = np.sort(_count_fractions(readings[:, axis], units[axis]))
        if fractions[:-2].sum() < MIN_OTHER_FRACTION:
            # Readings change from one value to the next half-way between them. A mean of p times one value and 1 - p
            # times the other errs by less than p - 1/2 of a step; if there is only one value, by at most half a step.
            half = 0.5 if widths[axis] > units[axis] else float(fractions[-1]) - 0.5
            bounds[axis] = (half * widths[axis]) ** 2 / 3
            continue
        angle = 2 * np.pi / units[axis]
        carried = float(np.abs(np.mean(np.exp(1j * angle * smooth[:, axis]))) ** 2)
        noise = max(float(scatter[axis]) - units[axis] ** 2 / 12, 0.0)
        bounds[axis] = units[axis] ** 2 / 12 * carried * np.exp(-(angle**2) * noise)
        if widths[axis] > units[axis]:
            bounds[axis] += (units[axis] * _bound_zero_error(steps, axis, readings[:, axis])) ** 2
    return bounds


def _find_unit(axis: Array) -> float:
    """Return the median step between neighbouring values that several readings (n,) have; zero if few values repeat."""
    values, often = np.unique(axis, return_counts=True)
    values, often = values[often >= MIN_REPEATS], often[often >= MIN_REPEATS]
    if len(values) < MIN_LEVELS or often.sum() < MIN_REPEATED_FRACTION * len(axis):
        return 0.0
    gaps, weights = np.diff(values), np.minimum(often[:-1], often[1:])
    order = np.argsort(gaps)
    total = np.cumsum(weights[order])
    return float(gaps[order][np.searchsorted(total, total[-1] / 2)])


def _count_fractions(axis: Array, unit: float) -> Array:
    """Return the fraction of an axis' readings (n,) at each value; differences far below a `unit` do not count."""
    values, often = np.unique(np.rint(axis / (SAME_VALUE_STEPS * unit)), return_counts=True)
    first = np.flatnonzero(np.diff(values, prepend=-np.inf) > 2)  # a record's rounding changes no value by more
    fractions: Array = np.add.reduceat(often, first) / len(axis)
    return fractions


def _bound_zero_error(steps: Steps, axis: int, readings: Array) -> float:
    """Return the standard uncertainty, in units, that zeros cause in a mean of one axis' truncated readings (n,).

    A truncated reading of zero is anywhere within a unit of zero. Let s be the slope of the logarithm of the density of
    readings, taken between zero's neighbours, which are three units apart. Then the mean of the readings that are cut
    to zero is s · 2²/12. If all readings are zero, no neighbour shows s, and the mean may be anywhere within a unit.
    """
    zeros = steps.reads_zero(axis, readings)
    if zeros.all():
        return float(3**-0.5)
    units = (readings - np.median(readings[zeros])) / steps.units[axis]
    lower, upper = (int(np.count_nonzero(np.abs(units - side * 1.5) < HALF_STEP_TOLERANCE)) for side in (-1, 1))
    slope = abs(float(np.log((upper + 0.5) / (lower + 0.5)))) / 3
    return float(np.mean(zeros)) * min(slope / 3, float(3**-0.5))
