"""The time stamps of a log in order: the readings of the recording, and the time at which each was taken.

Loggers write rows that are not readings (NaN, zeros before the first conversion), the same row twice, rows in another
order, counters that wrap, and readings that waited in a buffer. At the start of a recording, old readings come faster
than they were taken; after a stall of the link, the readings taken during the stall come faster too. A stall loses no
readings. To recognise one, a long step between two stamps is compared with the number of readings that follow until a
reading is on time again.

Each kind of row is counted, with the first row and its time. The remaining readings have the times of
`rig.observation.time_stamps.sampling`. All functions are pure.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.errors import Refused
from rig.estimation.arrays import Array, runs_between, unwrap_counter
from rig.observation.time_stamps.even_times import find_sampling_times
from rig.observation.time_stamps.moving_values import find_least_ahead
from rig.observation.time_stamps.sampling import (
    COARSE_RATIO,
    LONG_STEP_INTERVALS,
    LONG_WIDTHS,
    MULTIPLE_TOLERANCE,
    Sampling,
    find_resolution_s,
    find_sampling,
    find_typical_interval_s,
)

# Periods after which counters restart: 16, 24 and 32 bits of ms and µs; a day and the GPS week.
WRAPS_S = (*(2.0**bits * unit_s for unit_s in (1e-3, 1e-6) for bits in (16, 24, 32)), 86_400.0, 604_800.0)
MAX_RESTART_RATIO = 2.0  # of a step over the end of a counter's period to the longest other step: a longer one is none
MAX_ZERO_ROWS = 5  # before the first reading
MAX_REPEAT_FRACTION = 0.01  # of adjacent readings that are equal, for which a repeat is no chance
MIN_HELD, MIN_JUMP_RATIO = 4, 5.0  # equal readings in a row, and the step after them in median steps, of a stop
MAX_DENSITY = 1.5  # readings per interval, above which two parts of a log overlap; below, rows are in another order
MAX_DISORDER_S = 1.0  # by which a row is out of order; beyond, a clock was set back
MIN_STALE_DELAY_S, MAX_STALE_STEP = 0.1, 0.8  # of a stale reading; step of stale readings, in intervals
MAX_DELAY = 1.0  # of a punctual reading, in intervals
DELAY_RATIO = 3.0  # of the largest usual delay to the median
ROUNDING = 1e-6  # tolerance of a whole multiple of a resolution, for which rounding makes no equal stamps
MAX_EQUAL = 2  # pairs of coarse stamps: rounding makes more
MIN_DELAYED_FRACTION = 0.5  # of the readings of a long step that come after it, if they were delayed and not lost
CATCH_UP_STEPS = 6  # number of readings, in lengths of the step, within which a link has caught up after a stall


@dataclass(frozen=True, slots=True)
class StampFinding:
    """A `reason` why `count` rows of a log are left out (`left_out`) or, if not left out, have new times.

    `sample` is the number, from 1, of the first of these rows in the log; `time_s` is its stamp.
    """

    reason: str
    count: int
    sample: int
    time_s: float
    left_out: bool = True

    def __str__(self) -> str:
        return f"sample {self.sample}, at {self.time_s:.10g} s"


@dataclass(frozen=True, slots=True)
class OrderedStamps:
    """The readings of a log in the order of time: `rows` (m,) in the log, and strictly increasing times (m,).

    `sampling` describes the stamps; `findings` lists the rows that are left out or have new times.
    """

    rows: NDArray[np.intp]
    time_s: Array
    sampling: Sampling
    findings: tuple[StampFinding, ...] = ()


@dataclass(frozen=True, slots=True)
class _UnorderedLog:
    """The rows (m,) of a log that are not left out, in the log's order, with `stamps_s` (m,) and `readings` (m, c)."""

    rows: NDArray[np.intp]
    stamps_s: Array
    readings: Array
    findings: tuple[StampFinding, ...] = ()

    def select(self, kept: NDArray[np.bool_], reason: str) -> "_UnorderedLog":
        """Return the log with only the rows `kept`; if others are left out, a finding with the `reason` is added."""
        if kept.all():
            return self
        finding = self._describe(~kept, reason, left_out=True)
        return _UnorderedLog(self.rows[kept], self.stamps_s[kept], self.readings[kept], (*self.findings, finding))

    def restamp(self, stamps_s: Array, changed: NDArray[np.bool_], reason: str) -> "_UnorderedLog":
        """Return the log with new stamps for the rows `changed`, and with a finding that states the `reason`."""
        finding = self._describe(changed, reason, left_out=False)
        return replace(self, stamps_s=stamps_s, findings=(*self.findings, finding))

    def _describe(self, mask: NDArray[np.bool_], reason: str, *, left_out: bool) -> StampFinding:
        first = int(np.flatnonzero(mask)[0])
        count = int(np.count_nonzero(mask))
        return StampFinding(reason, count, int(self.rows[first]) + 1, float(self.stamps_s[first]), left_out)


def order_stamps(stamps_s: Array, readings: Array, where: str = "the samples") -> OrderedStamps:
    """Return a log with `stamps_s` (n,) and `readings` (n, c) in the order of time.

    Raise Refused `time_not_increasing`, which names `where`, if a clock was set back.
    """
    log = _UnorderedLog(np.arange(len(stamps_s)), stamps_s, readings)
    for step in (_drop_empty, _drop_zeros, _unwrap, _drop_repeated, _sort, _drop_held):
        log = step(log)
    _check_rising(log, where)
    if len(log.rows) > 2:
        for step in (_drop_stale, _spread_stalled, _separate_equal):
            log = step(log)
    if len(log.rows) < 2:
        return OrderedStamps(log.rows, log.stamps_s, Sampling.even(len(log.rows)), log.findings)
    sampling = find_sampling(log.stamps_s)
    return OrderedStamps(log.rows, find_sampling_times(log.stamps_s, sampling), sampling, log.findings)


def _drop_empty(log: _UnorderedLog) -> _UnorderedLog:
    return log.select(np.asarray(~np.isnan(log.readings).all(axis=1), dtype=np.bool_), "they hold no reading")


def _drop_zeros(log: _UnorderedLog) -> _UnorderedLog:
    """Return the log without rows of zeros at its start, which a register holds before the first conversion."""
    zero = (log.readings == 0).all(axis=1)
    first = int(np.argmin(zero)) if not zero.all() else 0
    kept = np.ones(len(zero), dtype=np.bool_)
    if first <= MAX_ZERO_ROWS and not zero[first:].any():
        kept[:first] = False
    return log.select(kept, "they are zeros before the first reading")


def _unwrap(log: _UnorderedLog) -> _UnorderedLog:
    """Return the log with continuous stamps, if a counter restarted at zero."""
    period_s = find_restart_s(log.stamps_s)
    if period_s is None:
        return log
    stamps_s = unwrap_counter(log.stamps_s, period_s)
    return log.restamp(
        stamps_s, stamps_s > log.stamps_s, f"their counter restarts after {period_s:.10g} s, which are added"
    )


def find_restart_s(stamps_s: Array) -> float | None:
    """Return the period after which the counter of stamps (n,) restarted at zero, None if it did not.

    A clock that was set back by about a counter's period is no restart, because the interval across the jump is
    unusual.
    """
    steps_s = np.diff(stamps_s)
    backward_steps = np.flatnonzero(steps_s < 0)
    if not len(backward_steps):
        return None
    longest_s = MAX_RESTART_RATIO * float(steps_s.max())
    for period_s in WRAPS_S:
        over_s = steps_s[backward_steps] + period_s
        if ((over_s >= 0) & (over_s <= longest_s)).all() and np.ptp(stamps_s) <= period_s:
            return period_s
    return None


def _drop_repeated(log: _UnorderedLog) -> _UnorderedLog:
    """Return the log without rows that repeat both stamp and readings of another row.

    If a sensor's readings often repeat, two rows with equal stamps may be two readings, and both remain.
    """
    shared = np.flatnonzero(np.isin(log.stamps_s, _find_repeated_values(log.stamps_s)))
    if not len(shared):
        return log
    rows = np.column_stack([log.stamps_s, log.readings])[shared]
    repeated = np.ones(len(shared), dtype=np.bool_)
    repeated[np.unique(rows, axis=0, return_index=True)[1]] = False
    later = np.diff(log.stamps_s) > 0
    equal = (np.diff(log.readings, axis=0) == 0).all(axis=1)[later]
    others = len(shared) - len(np.unique(rows[:, 0])) - np.count_nonzero(repeated)  # second readings of one stamp
    if others and len(equal) and equal.mean() > MAX_REPEAT_FRACTION:
        return log
    kept = np.ones(len(log.rows), dtype=np.bool_)
    kept[shared[repeated]] = False
    return log.select(kept, "they repeat the stamp and the readings of another one")


def _find_repeated_values(values: Array) -> Array:
    unique, counts = np.unique(values, return_counts=True)
    return np.asarray(unique[counts > 1], dtype=np.float64)


def _sort(log: _UnorderedLog) -> _UnorderedLog:
    """Return the log in the order of time, but unchanged if its clock was set back."""
    latest_s = np.maximum.accumulate(log.stamps_s)
    early = log.stamps_s < latest_s
    if not early.any():
        return log
    order = np.argsort(log.stamps_s, kind="stable")
    stamps_s = log.stamps_s[order]
    interval_s = find_typical_interval_s(stamps_s)
    for row in np.flatnonzero(np.diff(log.stamps_s) < 0):
        first, last = np.searchsorted(stamps_s, (log.stamps_s[row + 1], log.stamps_s[row]))
        overlap_s = log.stamps_s[row] - log.stamps_s[row + 1]
        if overlap_s > MAX_DISORDER_S or last - first > MAX_DENSITY * overlap_s / interval_s + 2:
            return log
    ordered = _UnorderedLog(log.rows[order], stamps_s, log.readings[order], log.findings)
    return ordered.restamp(stamps_s, early[order], "they stand after later ones, and are put in order")


def _drop_held(log: _UnorderedLog) -> _UnorderedLog:
    """Return the log without rows that repeat the readings before them for long, and then jump to other values.

    A sensor or a link that stops repeats its last reading. So does a coarse log of a body at rest. But if readings
    rarely repeat otherwise, a long repetition is no coincidence, and at its end the readings jump if the body moved.
    """
    steps = np.diff(log.readings, axis=0)
    same = (steps == 0).all(axis=1)
    runs = runs_between(~same, len(log.readings))
    runs = runs[runs[:, 1] - runs[:, 0] >= MIN_HELD]
    runs = runs[runs[:, 1] < len(log.readings)]
    if not len(runs):
        return log
    usual = np.median(np.abs(steps[~same]), axis=0)
    stopped = np.zeros(len(log.readings), dtype=np.bool_)
    for start, end in runs.tolist():
        stopped[start + 1 : end] = bool((np.abs(steps[end - 1]) > MIN_JUMP_RATIO * usual).any())
    others = same[~stopped[1:]]
    if not len(others) or others.mean() > MAX_REPEAT_FRACTION:
        return log
    return log.select(~stopped, "they repeat the reading before them: the sensor or its link had stopped")


def _check_rising(log: _UnorderedLog, where: str) -> None:
    """Raise Refused `time_not_increasing` for a clock that stands still, or was set back, so that nothing is sorted."""
    if len(log.rows) > 1 and not np.ptp(log.stamps_s):
        raise Refused(
            "time_not_increasing",
            f"{where} has the time {log.stamps_s[0]:.10g} s in all of its {len(log.rows)} samples",
            "Name the column that holds the time, with all of its digits",
        )
    backward_steps = np.flatnonzero(np.diff(log.stamps_s) < 0)
    if not len(backward_steps):
        return
    first = int(backward_steps[0])
    before_s, after_s = log.stamps_s[first : first + 2].tolist()
    back_s = before_s - after_s + float(np.median(np.diff(log.stamps_s)))
    more, give = "", "Give"
    if len(backward_steps) > 1:
        more = f", the first of {len(backward_steps)} such steps"
        give = "State with --columns where it begins again (wraps_at), if it is a counter; otherwise give"
    raise Refused(
        "time_not_increasing",
        f"{where} has time_s {after_s:.9g} after {before_s:.9g}, in sample {log.rows[first + 1] + 1}{more}: the clock "
        f"was set back by about {back_s:.4g} s, and nothing shows which of the two is right",
        f"{give} the part before it or the part after it, with a motion on the same clock",
    )


def _drop_stale(log: _UnorderedLog) -> _UnorderedLog:
    """Return the log without old readings at its start, which come faster than they were taken."""
    interval_s = find_typical_interval_s(log.stamps_s)
    late_s = log.stamps_s - interval_s * np.arange(len(log.stamps_s))
    delays_s = late_s - find_least_ahead(late_s, LONG_WIDTHS[-1])
    usual_s = _estimate_usual_delay_s(late_s, interval_s)
    first = int(np.argmax(delays_s <= np.median(delays_s) + MULTIPLE_TOLERANCE * interval_s))
    delay_s = float(late_s[0] - late_s[first])
    kept = np.ones(len(late_s), dtype=np.bool_)
    if delay_s > max(MIN_STALE_DELAY_S, LONG_STEP_INTERVALS * interval_s, 2 * usual_s):
        step_s = float(log.stamps_s[first] - log.stamps_s[0]) / first
        kept[:first] = step_s >= MAX_STALE_STEP * interval_s
        return log.select(kept, f"they had waited in a buffer: they come every {1e3 * step_s:.2g} ms")
    return log


def _spread_stalled(log: _UnorderedLog) -> _UnorderedLog:
    """Return the log in which readings that waited during a stall of the link have the times at which they were taken.

    If some of the readings of a stall were lost, it is unknown which, so all of them are left out.
    """
    stamps_s, interval_s = log.stamps_s.copy(), find_typical_interval_s(log.stamps_s)
    steps_s = np.diff(stamps_s)
    usual_s = _estimate_usual_delay_s(stamps_s - interval_s * np.arange(len(stamps_s)), interval_s)
    waited, lost = np.zeros(len(stamps_s), dtype=np.bool_), np.zeros(len(stamps_s), dtype=np.bool_)
    for last in np.flatnonzero(steps_s > LONG_STEP_INTERVALS * interval_s + usual_s).tolist():
        reach = int(CATCH_UP_STEPS * steps_s[last] / interval_s)  # readings among which one must be on time again
        ahead_s = log.stamps_s[last + 1 : last + 1 + reach] - log.stamps_s[last]
        late_s = ahead_s - interval_s * np.arange(1, len(ahead_s) + 1)
        caught_up = int(np.argmax(late_s <= late_s.min() + MAX_DELAY * interval_s))
        missing = max(round(float(late_s[caught_up]) / interval_s), 0)  # readings that never came
        # No stall: the first reading after it is on time, too many never came, or the one before it waited itself.
        if not caught_up or missing > (1 - MIN_DELAYED_FRACTION) * steps_s[last] / interval_s or waited[last]:
            continue
        late = slice(last + 1, last + 1 + caught_up)
        if missing * interval_s > usual_s + MAX_DELAY * interval_s:  # more than a late reading explains
            lost[late] = True
            continue
        waited[late] = True
        span_s = log.stamps_s[last + 1 + caught_up] - log.stamps_s[last]
        stamps_s[late] = log.stamps_s[last] + span_s * np.arange(1, caught_up + 1) / (caught_up + 1)
    if waited.any():
        what = "they waited while the link stalled and came at once: they count as taken one after the other"
        log = log.restamp(stamps_s, waited, what)
    return log.select(~lost, "they waited while the link stalled, and others of them are lost")


def _separate_equal(log: _UnorderedLog) -> _UnorderedLog:
    """Return the log without the second of two readings with equal stamps, unless an adjacent interval is free.

    If no reading is in the interval before or after the two, one of them is moved there. A log with coarse stamps or
    arrival times, in which equal stamps are usual, is unchanged.
    """
    steps_s = np.diff(log.stamps_s)
    equal = np.flatnonzero(steps_s == 0)
    if not len(equal):
        return log
    sampling = find_sampling(log.stamps_s)
    interval_s, rounded_s = find_typical_interval_s(log.stamps_s), find_resolution_s(log.stamps_s)
    uneven_s = abs(interval_s - rounded_s * round(interval_s / rounded_s)) if rounded_s else 0.0
    slips = rounded_s > COARSE_RATIO * interval_s and (uneven_s > ROUNDING * rounded_s or len(equal) > MAX_EQUAL)
    if sampling.width > 1 or sampling.on_arrival or slips:  # equal stamps are usual in such a log
        return log
    before = np.append(np.inf, steps_s)[equal] > 1.5 * sampling.interval_s
    after = np.append(steps_s, np.inf)[equal + 1] > 1.5 * sampling.interval_s
    stamps_s = log.stamps_s.copy()
    kept = np.ones(len(stamps_s), dtype=np.bool_)
    kept[equal[~before & ~after] + 1] = False
    stamps_s[equal[after] + 1] += sampling.interval_s
    stamps_s[equal[before & ~after]] -= sampling.interval_s
    if (moved := stamps_s != log.stamps_s).any():
        log = log.restamp(stamps_s, moved, "they have the stamp of another one, and a time beside it is free")
    return log.select(kept, "they are second readings with one stamp")


def _estimate_usual_delay_s(late_s: Array, interval_s: float) -> float:
    """Return how late, s, a reading that was not buffered can be, relative to the most punctual reading after it."""
    return DELAY_RATIO * float(np.median(late_s - find_least_ahead(late_s, LONG_WIDTHS[-1]))) + MAX_DELAY * interval_s
