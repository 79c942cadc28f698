"""What rounding leaves in a mean: readings come in steps, and a mean over many is as far off as a step may hide.

The mean of x + noise, rounded to multiples of q, is off by Σ (−1)ⁿ q/(πn) exp(−2(πnσ/q)²) sin(2πnx/q): the sawtooth of
the rounding error, each of its harmonics damped by the characteristic function of what carries the reading across steps
(Widrow and Kollár, Quantization Noise, 2008). Over all x its square is Σ q²/(2π²n²) exp(−(2πnσ/q)²), which the first
exponential bounds: Σ q²/(2π²n²) = q²/12.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array

FEWEST_LEVELS = 3  # numbers, of an axis that does not stand still
OCCUPIED = 0.01  # of the readings, that fall on other numbers than the two most frequent where they tell their noise
AGAIN, SHARE_AGAIN = 3, 0.25  # times that a number has come again, in a share of the readings that come in steps
LARGE_NOISE = 4.0  # steps: so much noise leaves nothing of the rounding in a mean
MOST_READINGS = 20_000  # of which the steps are found
SAME = 1e-3  # of a step, within which two numbers are one
A_QUARTER = 0.25  # of a step, as far as a number is off where it should be: less than half-way to another kind
NEAR = 0.2  # of a unit, by which a scale factor may change it
FEWEST_TO_TELL_ZERO = 8  # numbers of which at most one is zero
ALIKE = 0.5  # length of the mean of unit vectors that point alike


@dataclass(frozen=True, slots=True)
class Steps:
    """Steps in which numbers come: `unit` is that of each axis (3,), or of all.

    Numbers that were `cut` toward zero are the middles of what they stand for, and zero stands for all within a unit
    either way: its neighbours are a unit and a half away. `zero` (3,) is what zero has become, in units and but for
    whole ones, NaN where that is not known.
    """

    unit: Array | float
    cut: bool = False
    zero: Array | float = np.nan

    @property
    def units(self) -> Array:
        """(3,) the unit of each axis."""
        return np.broadcast_to(np.asarray(self.unit, dtype=np.float64), 3)

    @property
    def variance(self) -> Array:
        """(3,) variance of a reading by its rounding: a twelfth of the square of a step."""
        found: Array = self.units**2 / 12
        return found

    def widths(self, readings: Array) -> Array:
        """(3,) how much a number stands for in readings (n, 3), at most."""
        if not self.cut:
            return self.units
        wide = [bool(self.reads_zero(axis, readings[:, axis]).any()) for axis in range(3)]
        return np.where(wide, 2 * self.units, self.units)

    def reads_zero(self, axis: int, readings: Array) -> NDArray[np.bool_]:
        """Return which of readings (n,) of an axis are zero, (n,); all if it is not known what zero has become."""
        zero = float(np.broadcast_to(self.zero, 3)[axis])
        if not np.isfinite(zero):
            return np.ones(len(readings), dtype=np.bool_)
        beyond = readings / self.units[axis] - zero
        found: NDArray[np.bool_] = np.abs(beyond - np.rint(beyond)) < A_QUARTER
        return found


def cut_steps(readings: Array, unit: float) -> Steps:
    """Return the steps of all readings (n, 3) of a source that cuts numbers toward zero, in such a unit.

    Since then an offset may have been added, and a scale factor that is near one. All numbers but zero are whole ones
    and a half, which shows where zero is.
    """
    found = found_steps(readings)
    units = np.where(np.abs(found / unit - 1) < NEAR, found, unit)
    zero = np.full(3, np.nan)
    for axis in range(3):
        levels = np.unique(readings[:, axis]) / units[axis]
        if len(levels) >= FEWEST_TO_TELL_ZERO:
            halves = np.mean(np.exp(2j * np.pi * levels))
            zero[axis] = float(np.angle(halves) / (2 * np.pi)) + 0.5 if abs(halves) > ALIKE else np.nan
    return Steps(units, cut=True, zero=zero)


def found_steps(readings: Array) -> Array:
    """Return the steps (3,) in which readings (n, 3) come, zero of an axis that shows none.

    Noise that is much larger than a step falls on another number every time, so there is no step to find, and none that
    counts. An axis that stands still on few numbers has the steps of the others.
    """
    stride = max(len(readings) // MOST_READINGS, 1)
    units = np.array([_unit_of(axis) for axis in readings[::stride].T])
    still = np.array([len(np.unique(axis)) < FEWEST_LEVELS for axis in readings[::stride].T])
    return np.where(still, np.maximum(units, units.max()), units)


def rounding_left(readings: Array, steps: Steps, smooth: Array, scatter: Array) -> Array:
    """Return the variance (3,) that rounding leaves in a mean of readings (n, 3), at most.

    `smooth` (n, 3) is what comes and goes in them as far as it is known, such as the ripple of the arm, and carries
    them across steps; `scatter` (3,) is the variance of the rest, noise and rounding together (Sheppard). Readings on
    fewer than three numbers do not tell their noise, which may be none.
    """
    units = steps.units
    coarse, left = np.flatnonzero((units > 0) & (scatter <= (LARGE_NOISE * units) ** 2)), np.zeros(3)
    widths = steps.widths(readings) if len(coarse) else units
    for axis in coarse.tolist():
        shares = np.sort(_shares(readings[:, axis], units[axis]))
        if shares[:-2].sum() < OCCUPIED:
            # Between two numbers, half-way is where readings change from one to the other: a mean of p times one and
            # 1 - p times the other is off by less than p - 1/2 of a step, of one number alone by half of one.
            half = 0.5 if widths[axis] > units[axis] else float(shares[-1]) - 0.5
            left[axis] = (half * widths[axis]) ** 2 / 3
            continue
        turn = 2 * np.pi / units[axis]
        carried = float(np.abs(np.mean(np.exp(1j * turn * smooth[:, axis]))) ** 2)
        noise = max(float(scatter[axis]) - units[axis] ** 2 / 12, 0.0)
        left[axis] = units[axis] ** 2 / 12 * carried * np.exp(-(turn**2) * noise)
        if widths[axis] > units[axis]:
            left[axis] += (units[axis] * _missed_at_zero(steps, axis, readings[:, axis])) ** 2
    return left


def _unit_of(axis: Array) -> float:
    """The distance of neighbouring numbers in readings (n,), weighed by how often they come; zero if few come again."""
    values, often = np.unique(axis, return_counts=True)
    values, often = values[often >= AGAIN], often[often >= AGAIN]
    if len(values) < FEWEST_LEVELS or often.sum() < SHARE_AGAIN * len(axis):
        return 0.0
    gaps, weights = np.diff(values), np.minimum(often[:-1], often[1:])
    order = np.argsort(gaps)
    total = np.cumsum(weights[order])
    return float(gaps[order][np.searchsorted(total, total[-1] / 2)])


def _shares(axis: Array, unit: float) -> Array:
    """Shares of readings (n,) on each number that they fall on."""
    values, often = np.unique(np.rint(axis / (SAME * unit)), return_counts=True)
    first = np.flatnonzero(np.diff(values, prepend=-np.inf) > 2)  # what a recorded count is off is no other number
    shares: Array = np.add.reduceat(often, first) / len(axis)
    return shares


def _missed_at_zero(steps: Steps, axis: int, readings: Array) -> float:
    """Standard uncertainty, in units, of a mean of readings (n,) that were cut: of those that read zero.

    Within a unit either way of zero the density of readings falls as between zero's neighbours, three units apart: with
    the slope s of its logarithm their mean is s · 2²/12 off zero. If no neighbour shows s it is anywhere in between.
    """
    zeros = steps.reads_zero(axis, readings)
    if zeros.all():
        return float(3**-0.5)
    units = (readings - np.median(readings[zeros])) / steps.units[axis]
    lower, upper = (int(np.count_nonzero(np.abs(units - way * 1.5) < A_QUARTER)) for way in (-1, 1))
    slope = abs(float(np.log((upper + 0.5) / (lower + 0.5)))) / 3
    return float(np.mean(zeros)) * min(slope / 3, float(3**-0.5))
