"""The mean of readings over a turn or an arc, and the mean of what the arm turned meanwhile, by the same weights.

An even mean keeps of a vibration by how much its phase differs between both ends: 3 mrad/s at 8.5 Hz leave 20 µrad/s in
six seconds, more than the noise of a good gyroscope does. What the encoders see of it is in both means alike, and does
no harm. What they do not see is found in the readings as lines, and the weights leave nothing of these. The same
weights then make the mean of the arm's rate: whatever they do to a ripple they do to both (`mean_weights`).

What is left of the readings beside lines and rate is the noise, which is white more often than not.
"""

from dataclasses import dataclass, replace

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.statistics.mean_weights import mean_weights
from rig.estimation.statistics.rounding import Steps
from rig.observation.statistics.beside_lines import BRIEF, FEWEST, noise_of
from rig.observation.statistics.coloured_noise import MEMORIES
from rig.observation.statistics.lines import (
    NONE,
    LineSearch,
    find_lines,
    fitted,
    median_power,
    turning,
    unit_columns,
    waves,
    wide,
)
from rig.observation.statistics.mean import Mean, weighted_means, whole

SLOW = 8.0  # cycles in a turn: slower lines are told badly from what comes once and twice in it
UNSEEN = LineSearch(slowest=5.0)
SEEN = LineSearch(slowest=2.5, beats=0, most=5)


@dataclass(frozen=True, slots=True)
class SampledTurn:
    """A turn or an arc as a sensor's n samples see it.

    share (n,): which share of its time was over. rates_rad_s (n, 3): the flange's mean rate around each sample, as the
    encoders have it. uneven_rad_s (n,): of that what is along the axis, less its mean over the turn by both ends.
    passing (n, k): columns of what comes once, twice and so on in a turn, of an arc less their means. beats: those of
    its lines, see `Revolution`. encoders_true: whether the encoders tell the turning within a turn, and not over whole
    turns alone. closed: whether it is of whole turns. complete: whether samples follow each other closely, and none is
    missing for long.
    """

    share: Array
    rates_rad_s: Array
    uneven_rad_s: Array
    passing: Array
    beats: int
    encoders_true: bool
    closed: bool
    complete: bool


@dataclass(frozen=True, slots=True)
class Lines:
    """Lines that are taken out of a mean: `cycles` (k,) of each in the turn, the last `unseen` ones by no encoder.

    What the encoders see of a slow ripple needs no line: it is `seen` (n, m) as one column, beside how it changes and
    what else they tell, their noise above all. Columns (n, 0 to 2) of the `rate` are taken out. Of few samples, and of
    those with a gap between, it is the rate, for they do not meet a ripple evenly. Else it is how the slow ripple
    changes in a whole turn, which a sensor reads as well as it lags: even weights leave nothing of that, those that are
    free of slow lines do.
    """

    cycles: Array
    unseen: int
    seen: Array
    rate: Array


def turn_mean(readings: Array, steps: Steps, turn: SampledTurn) -> tuple[Mean, Array]:
    """Return the mean of readings (n, 3) in these steps and its weights (n,), which are to make that of what turned.

    A line slower than `SLOW` is told badly: what it changes in the mean counts as a standard deviation, or what one of
    its size does.
    """
    ones = whole(readings)
    steady = np.column_stack([ones, turn.passing])
    lines = _lines(readings, steady, turn)
    shaking = waves(lines.cycles, turn.share, turn.beats)
    weights = mean_weights(ones, np.column_stack([turn.passing, lines.rate, shaking]))
    columns = unit_columns(np.column_stack([steady, lines.rate, shaking, lines.seen]))
    coefficients, _, rank, _ = np.linalg.lstsq(columns, readings, rcond=1e-6)
    smooth = columns @ coefficients
    noise = noise_of(readings - smooth, int(rank), steps, BRIEF if lines.unseen else MEMORIES)
    (mean,) = weighted_means(readings, ones, weights, smooth=smooth, noise=noise, steps=steps)
    slow = np.repeat(lines.cycles < SLOW, wide(turn.beats))
    changed = np.zeros(3)
    if slow.any():
        beside = np.column_stack([turn.passing, lines.rate, shaking[:, ~slow]])
        without = mean_weights(ones, beside)
        even = _beside(np.column_stack([ones, turn.uneven_rad_s]), readings)
        left = _beside(np.column_stack([ones, beside, lines.seen]), readings)
        change = (weights - without)[0]
        changed = np.maximum((change @ even) ** 2, _by_size(shaking[:, slow], change, left))
    return replace(mean, variance=mean.variance + changed, cycles=lines.cycles), weights[0]


def _by_size(slow: Array, weights: Array, left: Array) -> Array:
    """Return (3,) the variance that slow columns (n, k) in what is left of readings (n, 3) make by weights (n,).

    By their size alone: a line may come with any phase, and that of one turn may change a mean by little where the line
    is large.
    """
    powers = (fitted(slow, left) ** 2).reshape(-1, 2, 3).sum(axis=1)
    kept = ((weights @ slow) ** 2).reshape(-1, 2).sum(axis=1)
    variance: Array = kept @ powers / 2
    return variance


def _beside(columns: Array, values: Array) -> Array:
    """Return what columns (n, k) of any size leave of values (n, m)."""
    unit = unit_columns(columns)
    left: Array = values - unit @ fitted(unit, values)
    return left


def _lines(readings: Array, steady: Array, turn: SampledTurn) -> Lines:
    """Find what vibrates in readings (n, 3) beside steady columns (n, k) and what the encoders see.

    Fast lines of the arm's rate are known to be in the readings, at the same frequency. What is left tells the others.
    """
    uneven = turn.uneven_rad_s[:, None]
    none = uneven[:, :0]
    if len(readings) < FEWEST:
        return Lines(NONE, 0, none, uneven)
    if not turn.complete:
        known = np.column_stack([steady, uneven])
        cycles = find_lines(readings - known @ fitted(known, readings), LineSearch(beats=turn.beats), share=turn.share)
        return Lines(cycles, len(cycles), none, uneven)
    along, left = (each - steady @ fitted(steady, each) for each in (uneven, readings))
    if not turn.encoders_true:
        cycles = find_lines(left, LineSearch(beats=turn.beats), share=turn.share)
        return Lines(cycles, len(cycles), along, none)
    heard = LineSearch(SEEN.stands_out, SEEN.slowest, SEEN.beats, SEEN.most, floor=median_power(left))
    ripple = find_lines(along, heard, share=turn.share)
    columns = waves(ripple, turn.share, SEEN.beats)
    sizes = fitted(columns, along)
    fast = np.repeat(ripple >= SLOW, wide(SEEN.beats))
    slow = along - columns[:, fast] @ sizes[fast]
    smooth = slow_part(slow, turn.share)
    late = _changes(smooth) if turn.closed else none  # over an arc it looks like what encoders err
    seen = np.column_stack([smooth, late, slow - smooth])
    left = _beside(np.column_stack([steady, seen, columns[:, fast]]), readings)
    heard_too = ripple[ripple >= SLOW]
    cycles = find_lines(left, UNSEEN, heard_too, turn.share)
    return Lines(cycles, len(cycles) - len(heard_too), seen, late)


def lagging(along: Array, columns: Array, share: Array) -> Array:
    """Return (n, 2) what a sensor that lags reads of the slow part of a rate `along` (n,), beside columns (n, k)."""
    beside = along[:, None] - columns @ fitted(columns, along[:, None])
    return _changes(slow_part(beside, share))


def _changes(slow: Array) -> Array:
    """(n, 2) how a rate (n, 1) changes, which a lag shows, and how that does, which a filter shows."""
    change = np.gradient(slow, axis=0)
    return np.column_stack([change, np.gradient(change, axis=0)])


def slow_part(rates: Array, share: Array) -> Array:
    """Return what of rates (n, m) comes less often than `SLOW` times in a turn, of which a share (n,) was over.

    Waves of half a turn tell it, for a vibration does not end with the turn.
    """
    halves = turning(np.pi * share, int(2 * SLOW))
    slow: Array = halves @ fitted(halves, rates)
    return slow
