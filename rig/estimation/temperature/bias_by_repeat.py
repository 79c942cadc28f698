"""A bias repeat by repeat, from the same attitudes each time, and at which repeat it moved: TRIAX, Figs. 4 and 6.

Scale, axes and reference are held: what they are wrong by, and what the arm's attitudes are wrong by, is the same in
every repeat of an attitude and leaves the differences between repeats alone.

The bias is said to have moved before a repeat where the mean of the repeats from there on differs from that of those
before, axis by axis, by more than noise makes it in all places and axes together twice in a hundred steady runs
(Bonferroni's inequality); then either side is looked at again for itself (binary segmentation: Scott and Knott 1974).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.refusals import check_count, check_finite, check_variances, require_shape
from rig.estimation.statistics.coverage import rate_of_each

FALSE_ALARM = 0.02  # of a run whose bias is steady


@dataclass(frozen=True, slots=True)
class Move:
    """A move of the bias before repeat `repeat`, counted from 0, by `change` (3,), known to `std` (3,)."""

    repeat: int
    change: Array
    std: Array

    @property
    def axis(self) -> int:
        """Index of the axis along which the move stands out most."""
        return int(np.argmax(np.abs(self.change) / self.std))


@dataclass(frozen=True, slots=True)
class BiasByRepeat:
    """`bias` (R, 3), what differs between repeats known to `std` (R, 3); when it `moved`.

    `freedom` (3,) of these: those of the excess where there is one, else infinite.

    `excess` (3,) is the standard deviation of a mean in an attitude over what its variance says, where it is larger: an
    arm that comes back differently, a bias that moves within a repeat. `std` has it in it.
    """

    bias: Array
    std: Array
    excess: Array
    moves: tuple[Move, ...]
    freedom: Array

    @property
    def largest_change(self) -> Array:
        """(3,) largest change of the bias between any two repeats."""
        change: Array = np.ptp(self.bias, axis=0)
        return change

    @property
    def largest_change_std(self) -> Array:
        """(3,) standard deviations of the largest change: what the two repeats it lies between are known to."""
        return largest_change_std(self.bias, self.std)


def largest_change_std(bias: Array, std: Array) -> Array:
    """(3,) standard deviations of the largest change of biases (R, 3): what the two it lies between are known to."""
    ends = np.stack([bias.argmin(axis=0), bias.argmax(axis=0)])
    found: Array = np.hypot(*np.take_along_axis(std, ends, axis=0))
    return found


def bias_by_repeat(readings: Array, variances: Array, modelled: Array, bias: Array | None = None) -> BiasByRepeat:
    """The bias from mean readings (R, N, 3) of N attitudes in R ≥ 2 repeats, the variances of these means, and what the
    model without a bias makes of each.

    `bias` (3,) is that of the first repeat where a fit has found it; the others' then stand relative to it.
    Raises Fault `too_few_observations`, `not_finite`, `bad_variance`; ValueError for a wrong shape.
    """
    repeats, attitudes = readings.shape[:2]
    require_shape("readings", readings, (repeats, attitudes, 3))
    require_shape("variances", variances, readings.shape)
    require_shape("modelled", modelled, readings.shape)
    check_count(repeats, 2, 3)
    check_finite(readings=readings, variances=variances, modelled=modelled)
    check_variances(variances)
    off = readings - modelled
    found = off.mean(axis=1)
    excess = _excess(off, variances)
    std = np.sqrt(variances.mean(axis=1) / attitudes) * excess
    moves = tuple(sorted(_moves(found, std, 0, len(found), len(found) - 1), key=lambda move: move.repeat))
    return BiasByRepeat(
        found if bias is None else bias + found - found[0],
        std,
        excess,
        moves,
        np.where(excess > 1.0, _left_over(off), np.inf),
    )


def _left_over(off: Array) -> int:
    """Degrees of freedom of what is left of (R, N, 3) when each attitude has an error and each repeat a bias."""
    repeats, attitudes = off.shape[:2]
    return int((repeats - 1) * (attitudes - 1))


def _excess(off: Array, variances: Array) -> Array:
    """(3,) factors by what is left when each attitude has an error of its own and each repeat a bias; 1 at least."""
    left = off - off.mean(axis=0) - off.mean(axis=1, keepdims=True) + off.mean(axis=(0, 1))
    freedom = _left_over(off)
    if freedom == 0:
        return np.ones(3)
    scatter = np.sum(left**2, axis=(0, 1)) / freedom
    excess: Array = np.sqrt(np.maximum(scatter / variances.mean(axis=(0, 1)), 1.0))
    return excess


def _moves(bias: Array, std: Array, start: int, end: int, places: int) -> Iterator[Move]:
    """Moves of the bias from `start` to `end`, in a run that has so many `places` where it could have moved."""
    from scipy.special import ndtri

    sure = -float(ndtri(rate_of_each(FALSE_ALARM, 2 * 3 * places)))
    best, largest = None, sure
    for place in range(start + 1, end):
        before, after = _mean(bias[start:place], std[start:place]), _mean(bias[place:end], std[place:end])
        move = Move(place, after[0] - before[0], np.hypot(before[1], after[1]))
        stands_out = float(np.max(np.abs(move.change) / move.std))
        if stands_out > largest:
            best, largest = move, stands_out
    if best is not None:
        yield from _moves(bias, std, start, best.repeat, places)
        yield best
        yield from _moves(bias, std, best.repeat, end, places)


def _mean(bias: Array, std: Array) -> tuple[Array, Array]:
    """Weighted, (3,), and its standard deviation (3,)."""
    weights = std**-2
    return np.sum(weights * bias, axis=0) / weights.sum(axis=0), weights.sum(axis=0) ** -0.5
