"""The sampling interval of a log and its missing readings, from time stamps that may be bad.

Loggers round their stamps (8, 9, 8, 9 ms at 119 Hz) or stamp readings on arrival (five at once every 50 ms). So two
neighbouring stamps show neither the interval nor a loss. But errors of stamps do not accumulate, while every lost
reading shifts all later stamps. So the stamps are compared with an even series of the interval T,

    lateness of stamp k = t[k] − T (k + readings missing before it)

A reading is never stamped before it is taken. So the least lateness among `width` readings after a step, minus the
least among those before it, is the time of the readings missing in between. The width is the smallest for which these
differences are whole multiples of the interval: 1 if stamps are good to a quarter of an interval.

If stamps are worse, random losses of readings cannot be counted one by one. But the losses make the lateness a random
walk, whose Allan variance (IEEE 952, annex C) gives the number of missing readings.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from rig.observation.time_stamps.moving_values import find_least_ahead, find_least_around, find_least_behind

WIDTHS = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512)  # readings over which the interval is tried
MEDIAN, LOW_QUANTILE = 0.5, 0.1  # quantiles of the interval with which the search begins: for few losses, and for many
LONG_WIDTHS = (64, 512)  # over which the interval is estimated first: more than a burst, less than between two gaps
LONG_STEP_INTERVALS = 6.0  # a longer step is a gap; among uneven stamps, a reading with a longer delay was buffered
PACKET_S = 0.5  # readings that follow each other evenly for longer have not arrived at once
MULTIPLE_TOLERANCE, MIN_FIT = 0.25, 0.8  # in intervals; fraction of differences that must be whole multiples
MIN_LOSS_INTERVALS = 0.6  # least difference of delays that shows a lost reading
COARSE_RATIO = 1 / 3  # resolution in intervals, above which the stamps are worse than `MULTIPLE_TOLERANCE`
# Fraction of the interval; if this fraction of steps is shorter, readings are stamped on arrival.
SHORT_STEP, MIN_SHORT_FRACTION = 0.6, 0.05
MAX_SHORT_RATIO = 0.1  # of short steps to long ones, above which readings were late and not lost
MAX_ROUNDING_RATIO = 1.5  # to the resolution, above which stamps are not only rounded
# Quantile of squared normal deviates; mean of those below it, relative to the mean of all.
TRIMMED_QUANTILE, TRIMMED_MEAN_RATIO = 0.85, 0.5204
MAX_ITERATIONS, CONVERGED = 6, 1e-9
MAX_DECIMALS, MAX_BITS = 7, 16  # and binary digits, of a second to which stamps may be rounded
MAX_COUNTED_LOSS = 50  # missing readings: the number in a longer gap is too uncertain to improve the interval
MIN_SEGMENTS, MAX_SEGMENT = 24, 1024  # of a log that shows a random walk; readings of a segment
WALK_GROWTH = (2.5, 12.0)  # range of the factor by which a random walk's variance grows over four segments
MAX_BURST = 16  # readings in a row, of which at least one must be on time
MIN_POLLED_FRACTION = 0.045  # of steps that are one polling period longer
WHOLE_TOLERANCE = 0.01  # of an interval that is a whole multiple of a coarse resolution
# Ratio of variance to mean of missing readings; expected ones in a block; fewest blocks.
MAX_DISPERSION, BLOCK_LOSSES, MIN_BLOCKS = 0.35, 8, 20


@dataclass(frozen=True, slots=True)
class Sampling:
    """The sampling of n readings: how often a reading was taken, and which readings are missing.

    - `interval_s`: mean time from one reading to the next.
    - `missing` (n − 1,): number of readings missing between each reading and the next.
    - `scattered`: fraction of readings that are missing at unknown positions.
    - `width`: number of stamps to compare together; 1 if every stamp is good.
    - `on_arrival`: whether readings were stamped when they arrived, several at once.
    - `late` (n,): mask of readings that waited in a buffer, stamped much later than the next ones; None unless stamps
      are too bad to count missing readings.
    """

    interval_s: float
    missing: NDArray[np.intp]
    scattered: float
    width: int
    on_arrival: bool
    late: NDArray[np.bool_] | None = None

    @property
    def hides_losses(self) -> bool:
        """Whether single lost readings do not show, because the stamps are bad or are smoothed arrival times."""
        return self.on_arrival or self.late is not None

    def gaps(self, time_s: Array, fewest: int = 1) -> NDArray[np.bool_]:
        """Return a mask (n − 1,) of steps between readings at times (n,) with at least `fewest` readings missing.

        With late readings the missing ones cannot be counted. Then the mask has the steps that last as long as such a
        gap, and those from or to a late reading.
        """
        if self.late is None:
            return np.asarray(self.missing >= fewest)
        long = np.diff(time_s) > max(fewest + 1, LONG_STEP_INTERVALS) * self.interval_s
        return np.asarray(long | self.late[1:] | self.late[:-1])

    @classmethod
    def even(cls, count: int) -> "Sampling":
        """Return even sampling for `count` readings, which are too few to show gaps."""
        return cls(0.0, np.zeros(max(count - 1, 0), dtype=np.intp), 0.0, 1, on_arrival=False)

    @property
    def numbers(self) -> NDArray[np.intp]:
        """The readings' numbers (n,), from 0, with missing readings counted."""
        return np.concatenate([[0], np.cumsum(1 + self.missing)])

    def count_expected(self, time_s: Array, windows_s: Array) -> Array:
        """Return the number (k,) of readings in each of `windows_s` (k, 2) if none were missing.

        The readings were taken at times (n,). They are assumed to continue before and after these times.
        """
        beyond_s = np.minimum(windows_s - time_s[0], 0.0) + np.maximum(windows_s - time_s[-1], 0.0)
        numbers = np.interp(windows_s, time_s, self.numbers) + beyond_s / self.interval_s
        return np.asarray(numbers[:, 1] - numbers[:, 0], dtype=np.float64)


@dataclass(frozen=True, slots=True)
class _PeriodCandidate:
    """The interval and missing readings (n − 1,) if `width` stamps are compared together.

    `fit`: the fraction of the differences of lateness that are whole multiples of the interval.
    """

    width: int
    interval_s: float
    missing: NDArray[np.intp]
    fit: float

    @property
    def gap_count(self) -> int:
        """The number of steps with missing readings."""
        return int(np.count_nonzero(self.missing))

    def median_run_s(self, time_s: Array) -> float:
        """Return the median time from one gap to the next, of readings at times (n,)."""
        gaps = np.flatnonzero(self.missing)
        starts, ends = np.append(0, gaps + 1), np.append(gaps, len(time_s) - 1)
        return float(np.median(time_s[ends] - time_s[starts]))


def find_sampling(time_s: Array) -> Sampling:
    """Return the sampling of readings at rising times (n ≥ 2,), by the first of three methods that succeeds.

    1. If the stamps are good, each step between two readings shows the readings missing in it (`width` 1).
    2. If stamps are coarse, or readings arrived several at once, groups of `width` stamps are compared; the narrowest
       suitable width is used.
    3. Otherwise only the fraction of missing readings is estimated (`scattered`), not where they are missing.
    """
    typical_s, rounded_s = find_typical_interval_s(time_s), find_resolution_s(time_s)
    is_uneven = float(np.quantile(np.diff(time_s), MIN_SHORT_FRACTION)) < SHORT_STEP * typical_s
    single = _count_missing(time_s, 1, MEDIAN)
    is_credible = not (_is_misleading(time_s, typical_s, rounded_s) or _lost_regularly(single.missing))
    is_good = is_credible and single.fit >= MIN_FIT and not _has_late(time_s, single)
    if is_good and (not is_uneven or single.median_run_s(time_s) > PACKET_S):
        return Sampling(single.interval_s, single.missing, 0.0, 1, on_arrival=False)
    best = _select_candidate([*([single] if is_credible else []), *_list_wider(time_s)], typical_s)
    if best is None:
        return _estimate_unlocated_losses(time_s)
    sampling = Sampling(best.interval_s, best.missing, 0.0, best.width, on_arrival=False)
    return replace(sampling, on_arrival=is_uneven and _exceeds_rounding(time_s, sampling, rounded_s))


def _is_misleading(time_s: Array, interval_s: float, resolution_s: float) -> bool:
    """Return whether all steps are whole multiples of a wrong interval because of coarse resolution."""
    # Equal steps are as coarse as their resolution, and good.
    is_coarse = resolution_s > COARSE_RATIO * interval_s and float(np.ptp(np.diff(time_s))) > CONVERGED * interval_s
    return is_coarse and abs(interval_s / resolution_s - round(interval_s / resolution_s)) > WHOLE_TOLERANCE


def _has_late(time_s: Array, single: _PeriodCandidate) -> bool:
    """Return whether readings were late rather than lost.

    A late reading makes a gap before it and short steps after it, whereas a lost one makes only a gap.
    """
    return bool(np.count_nonzero(np.diff(time_s) < SHORT_STEP * single.interval_s) > MAX_SHORT_RATIO * single.gap_count)


def _list_wider(time_s: Array) -> list[_PeriodCandidate]:
    """Return the candidates of width above 1, narrowest first, except those with regular losses (`_lost_regularly`)."""
    widths = takewhile(lambda width: 4 * width <= len(time_s), WIDTHS[1:])
    wider = (_count_missing(time_s, width, quantile) for width in widths for quantile in (MEDIAN, LOW_QUANTILE))
    return [candidate for candidate in wider if not _lost_regularly(candidate.missing)]


def _select_candidate(candidates: Sequence[_PeriodCandidate], typical_s: float) -> _PeriodCandidate | None:
    """Return the narrowest of the `candidates` that fits with few gaps, or None.

    The candidates are sorted by width, narrowest first. `typical_s` is the typical interval between readings.
    """
    # A much shorter interval is one inside a burst; with it the time between bursts would look like a gap.
    fitting = [
        candidate for candidate in candidates if candidate.fit >= MIN_FIT and candidate.interval_s > typical_s / 2
    ]
    fewest = min((candidate.gap_count for candidate in fitting), default=0)
    return next((candidate for candidate in fitting if candidate.gap_count <= 2 * fewest + 1), None)


def _exceeds_rounding(time_s: Array, sampling: Sampling, resolution_s: float) -> bool:
    """Return whether some stamps (n,) are later than rounding to `resolution_s` explains."""
    late_s = time_s - sampling.interval_s * sampling.numbers
    allowed_s = max(resolution_s, MULTIPLE_TOLERANCE * sampling.interval_s)
    return float(np.max(late_s - find_least_around(late_s, sampling.width))) > MAX_ROUNDING_RATIO * allowed_s


def find_typical_interval_s(time_s: Array) -> float:
    """Return the typical interval between readings at increasing times (n ≥ 2,); some may be missing or late.

    If most stamps are equal, it is the mean interval.
    """
    intervals_s = [_interval_quantile(time_s, apart) for apart in LONG_WIDTHS]
    mean_s = float(np.ptp(time_s)) / (len(time_s) - 1)
    return min((interval_s for interval_s in intervals_s if interval_s > 0), default=mean_s)


def _count_missing(time_s: Array, width: int, quantile: float) -> _PeriodCandidate:
    """Return the interval, and the number of readings missing in each step, if readings arrive in packets of `width`.

    The search for the interval starts at this `quantile` of its estimates from a few packets each.
    """
    steps_s, numbers = np.diff(time_s), np.arange(len(time_s))
    interval_s, last_s = _interval_quantile(time_s, max(8, 4 * width), quantile), 0.0
    missing, fit = np.zeros(len(steps_s), dtype=np.intp), 0.0
    for _ in range(MAX_ITERATIONS):
        late_s = time_s - interval_s * numbers
        if interval_s <= 0:  # most stamps are equal
            break
        later_s = find_least_ahead(late_s, width)[1:] - find_least_behind(late_s, width)[:-1]
        whole = np.rint(later_s / interval_s) * (later_s > MIN_LOSS_INTERVALS * interval_s)
        fit = float(np.mean(np.abs(later_s - interval_s * whole) < MULTIPLE_TOLERANCE * interval_s))
        missing = whole.astype(np.intp)
        if width > 1:
            ending = missing[-width:]
            ending[ending <= width] = 0  # the last packet may be incomplete
            missing = _merge_at_longest(missing, steps_s)
        if abs(interval_s - last_s) <= CONVERGED * interval_s:
            break
        last_s, interval_s = interval_s, _interval_s(time_s, missing, width)
    return _PeriodCandidate(width, interval_s, missing, fit)


def _lost_regularly(missing: NDArray[np.intp]) -> bool:
    """Return whether `missing` readings (n − 1,) recur so regularly that they are a beat of two clocks, not losses.

    Such a beat occurs if the stamps of a polled port are multiples of a time shorter than the interval. The stamps of a
    logger that loses every n-th reading look the same, but a logger is unlikely to lose as large a fraction.
    """
    missing = np.minimum(missing, 1)  # a gap counts once
    lost = int(missing.sum())
    size = max(len(missing) * BLOCK_LOSSES // lost, 1) if lost else len(missing) + 1
    blocks = len(missing) // size
    if blocks < MIN_BLOCKS or lost < MIN_POLLED_FRACTION * len(missing):
        return False
    counts = missing[: blocks * size].reshape(blocks, size).sum(axis=1)
    return bool(counts.var() < MAX_DISPERSION * counts.mean())


def _interval_s(time_s: Array, missing: NDArray[np.intp], width: int) -> float:
    """Return the mean interval between readings, including the missing ones, over the whole recording.

    The recording lasts from the most punctual of its first `width` readings to the most punctual of its last `width`.
    """
    steps_s, few = np.diff(time_s), missing <= MAX_COUNTED_LOSS
    interval_s = float(steps_s[few].sum() / (1 + missing[few]).sum())
    numbers = np.concatenate([[0], np.cumsum(1 + missing)])
    if width == 1 or not few.all() or numbers[-1] <= width:
        return interval_s
    late_s = time_s - interval_s * numbers
    first, last = int(np.argmin(late_s[:width])), len(late_s) - width + int(np.argmin(late_s[-width:]))
    return interval_s + float((late_s[last] - late_s[first]) / (numbers[last] - numbers[first]))


def _estimate_unlocated_losses(time_s: Array) -> Sampling:
    """Return the sampling for losses that cannot be located, because stamps are bad or losses too many.

    If a fraction p of all readings is lost at random, the variance of the lateness gained over m readings is p m T²,
    with the interval T, so that from m to 4 m readings it grows fourfold. This growth distinguishes losses from errors
    that do not accumulate, whose variance is constant, and from a clock's random walk, whose variance grows much more.
    """
    mean_s = float(time_s[-1] - time_s[0]) / (len(time_s) - 1)
    apart = min(len(time_s) // MIN_SEGMENTS, MAX_SEGMENT)
    width = max((width for width in WIDTHS if 4 * width <= apart), default=1)
    least_s = find_least_ahead(time_s - mean_s * np.arange(len(time_s)), width)[: len(time_s) - width]
    near, far = (_walk_variance(least_s, steps) for steps in (max(apart // 4, 1), max(apart, 1)))
    lost = width >= MAX_BURST and WALK_GROWTH[0] * near < far < WALK_GROWTH[1] * near
    nowhere = np.zeros(len(time_s) - 1, dtype=np.intp)
    scattered = far / (apart * mean_s**2) if lost else 0.0
    scattered = 0.0 if scattered >= 1 else scattered  # more than all: the stamps show nothing
    usual_s = find_typical_interval_s(time_s)
    late_s = time_s - usual_s * np.arange(len(time_s))
    late = late_s - find_least_ahead(late_s, LONG_WIDTHS[0]) > LONG_STEP_INTERVALS * usual_s
    return Sampling(_interval_s(time_s, nowhere, width), nowhere, scattered, width, on_arrival=False, late=late)


def _walk_variance(walk: Array, apart: int) -> float:
    """Return the variance that a random walk (k,) gains over `apart` steps, without trend (overlapping Allan variance).

    The largest second differences are omitted, because emptying a buffer at the start causes a large one.
    """
    curvatures = (walk[2 * apart :] - 2 * walk[apart:-apart] + walk[: -2 * apart]) ** 2
    if not len(curvatures):
        return 0.0
    return float(
        np.mean(curvatures[curvatures <= np.quantile(curvatures, TRIMMED_QUANTILE)]) / (2 * TRIMMED_MEAN_RATIO)
    )


def _merge_at_longest(missing: NDArray[np.intp], steps_s: Array) -> NDArray[np.intp]:
    """Return numbers (n − 1,) of missing readings with each loss counted once, at the longest step that it affects."""
    merged = np.zeros_like(missing)
    steps = np.flatnonzero(missing)
    if not len(steps):
        return merged
    first = np.concatenate([[0], 1 + np.flatnonzero(np.diff(steps) > 1)])
    group = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(steps))))
    longest = np.lexsort((steps_s[steps], group))[np.append(first[1:], len(steps)) - 1]
    merged[steps[longest]] = np.maximum.reduceat(missing[steps], first)
    return merged


def _interval_quantile(time_s: Array, apart: int, quantile: float = MEDIAN) -> float:
    """Return a quantile, by default the median, of the mean intervals of readings `apart` steps apart."""
    apart = min(apart, len(time_s) - 1)
    return float(np.quantile(time_s[apart:] - time_s[:-apart], quantile) / apart)


def find_resolution_s(time_s: Array) -> float:
    """Return the resolution of the stamps, s: a power of ten, or of two as in float32; 0 if no power fits."""
    units = sorted((*(10.0**-decimals for decimals in range(MAX_DECIMALS)), *(2.0**-bits for bits in range(MAX_BITS))))
    since_s = time_s - time_s[0]
    for unit_s in reversed(units):
        scaled = since_s / unit_s
        if np.abs(scaled - np.rint(scaled)).max() < 1e-3:  # rounding errors of the stamps
            return unit_s
    return 0.0
