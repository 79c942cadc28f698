"""The bias in every repeat of the same attitudes, and its steps between repeats: Figs. 4 and 6 of the paper TRIAX.

Scale, axes and reference are fixed, because their errors, and those of the arm's attitudes, are the same in every
repeat of an attitude and cancel in the differences between repeats.

The bias stepped before a repeat if the mean over all earlier repeats and the mean over all others differ significantly.
A steady bias seems to step in at most 2 % of runs, over all repeats and axes together (Bonferroni's inequality). The
repeats before a step and those after it are then tested again (binary segmentation: Scott and Knott 1974).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.refusals import check_count, check_finite, check_variances, require_shape
from rig.estimation.statistics.coverage import false_alarm_of_each

FALSE_ALARM_PROBABILITY = 0.02  # for a run whose bias is steady


@dataclass(frozen=True, slots=True)
class BiasStep:
    """A step of the bias before repeat `repeat`, counted from 0, by `change` (3,) with the standard deviation `std`."""

    repeat: int
    change: Array
    std: Array

    @property
    def axis(self) -> int:
        """The index of the axis with the most significant step."""
        return int(np.argmax(np.abs(self.change) / self.std))


@dataclass(frozen=True, slots=True)
class BiasByRepeat:
    """The bias of every repeat.

    - `bias` (R, 3); `std` (R, 3): the biases' standard deviations in differences between repeats; `moves`: the steps of
      the bias.
    - `excess` (3,): the ratio of the scatter of means in an attitude to their standard deviation, at least 1 (Birge
      ratio). It is due to inexact repeats of attitudes, or to bias drift within a repeat, and is included in `std`.
    - `dof` (3,): degrees of freedom of the excess if there is one, else infinite.
    """

    bias: Array
    std: Array
    excess: Array
    moves: tuple[BiasStep, ...]
    dof: Array

    @property
    def largest_change(self) -> Array:
        """The largest change (3,) of the bias between any two repeats."""
        change: Array = np.ptp(self.bias, axis=0)
        return change

    @property
    def largest_change_std(self) -> Array:
        """The standard deviation (3,) of the largest change between two repeats."""
        return largest_change_std(self.bias, self.std)


def largest_change_std(bias: Array, std: Array) -> Array:
    """Return the standard deviation (3,) of the largest change between two of the biases (R, 3) with `std` (R, 3)."""
    ends = np.stack([bias.argmin(axis=0), bias.argmax(axis=0)])
    change_std: Array = np.hypot(*np.take_along_axis(std, ends, axis=0))
    return change_std


def bias_by_repeat(readings: Array, variances: Array, modelled: Array, bias: Array | None = None) -> BiasByRepeat:
    """Return the bias in each of R ≥ 2 repeats of N attitudes.

    `readings` (R, N, 3) are mean readings, `variances` their variances, `modelled` the model's readings without a bias.
    If a fit gives the `bias` (3,) of the first repeat, all biases are shifted so that the first is equal to it.
    Raise Fault `too_few_observations`, `not_finite`, `bad_variance`; ValueError for a wrong shape.
    """
    repeats, attitudes = readings.shape[:2]
    require_shape("readings", readings, (repeats, attitudes, 3))
    require_shape("variances", variances, readings.shape)
    require_shape("modelled", modelled, readings.shape)
    check_count(repeats, 2, 3)
    check_finite(readings=readings, variances=variances, modelled=modelled)
    check_variances(variances)
    errors = readings - modelled
    biases = errors.mean(axis=1)
    excess = _excess(errors, variances)
    std = np.sqrt(variances.mean(axis=1) / attitudes) * excess
    moves = tuple(sorted(_find_steps(biases, std, 0, len(biases), len(biases) - 1), key=lambda move: move.repeat))
    return BiasByRepeat(
        biases if bias is None else bias + biases - biases[0],
        std,
        excess,
        moves,
        np.where(excess > 1.0, _residual_dof(errors), np.inf),
    )


def _residual_dof(errors: Array) -> int:
    """Return the dof of residuals (R, N, 3) after a fit of an error per attitude and a bias per repeat."""
    repeats, attitudes = errors.shape[:2]
    return int((repeats - 1) * (attitudes - 1))


def _excess(errors: Array, variances: Array) -> Array:
    """Return the Birge ratio (3,), at least 1, after a fit of one error per attitude and one bias per repeat."""
    residuals = errors - errors.mean(axis=0) - errors.mean(axis=1, keepdims=True) + errors.mean(axis=(0, 1))
    dof = _residual_dof(errors)
    if dof == 0:
        return np.ones(3)
    scatter = np.sum(residuals**2, axis=(0, 1)) / dof
    excess: Array = np.sqrt(np.maximum(scatter / variances.mean(axis=(0, 1)), 1.0))
    return excess


def _find_steps(bias: Array, std: Array, start: int, end: int, candidates: int) -> Iterator[BiasStep]:
    """Yield the significant steps of the bias between repeats `start` and `end` of a run.

    `candidates` is the number of possible steps in the run; the more there are, the larger a significant step is.
    """
    from scipy.special import ndtri

    sure = -float(ndtri(false_alarm_of_each(FALSE_ALARM_PROBABILITY, 2 * 3 * candidates)))
    best, largest = None, sure
    for first in range(start + 1, end):
        before, after = _mean(bias[start:first], std[start:first]), _mean(bias[first:end], std[first:end])
        move = BiasStep(first, after[0] - before[0], np.hypot(before[1], after[1]))
        stands_out = float(np.max(np.abs(move.change) / move.std))
        if stands_out > largest:
            best, largest = move, stands_out
    if best is not None:
        yield from _find_steps(bias, std, start, best.repeat, candidates)
        yield best
        yield from _find_steps(bias, std, best.repeat, end, candidates)


def _mean(bias: Array, std: Array) -> tuple[Array, Array]:
    """Return the weighted mean (3,) and its standard deviation (3,)."""
    weights = std**-2
    return np.sum(weights * bias, axis=0) / weights.sum(axis=0), weights.sum(axis=0) ** -0.5
