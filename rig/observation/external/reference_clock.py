"""The offset of a reference's clock relative to the readings' clock, from the rotation that both show.

The rates of densely written, evenly stamped rows determine offset and drift to a fraction of a millisecond
(`rig.observation.clocks`). Rows that come slowly, or are stamped on arrival, have no such rates, and a drift fitted to
them would only show errors of the time stamps. So only an offset is fitted to such rows, without drift. This offset
minimises the sum of the absolute differences between the rotations that rows and readings show from row to row
(`robust_start`).
"""

from dataclasses import replace
from functools import partial

import numpy as np

from rig.errors import Fault, or_fault
from rig.estimation.arrays import Array
from rig.estimation.refusals import report_inverted
from rig.observation.clocks.clock_estimate import estimate_time_base
from rig.observation.clocks.coarse_search import estimate_coarse_offset
from rig.observation.clocks.time_base import TimeBase
from rig.observation.external.reference_rows import Turning, select_covered
from rig.observation.external.robust_start import COARSE_S, find_start
from rig.observation.external.still_attitudes import MAX_CLOCK_S
from rig.observation.external.table_motion import TableMotion

MAX_UNEXPLAINED_RATIO = 0.9  # a drift is accepted if it reduces the unexplained fraction to this ratio or less
CRYSTAL_DRIFT_STD = 1e-4  # between two crystals
# longest step of the rows: in intervals of the readings, or as a fraction of the total change by drift
MAX_STEP_INTERVALS, MAX_STEP_DRIFT_FRACTION = 2.5, 0.2
MIN_DRIFT, MIN_DRIFT_STDS = 5e-4, 6.0  # more than any crystal's, and more than chance
MAX_UNEXPLAINED = 0.1  # fraction, above which the rows may be inverse rotations
# Fraction of the variance of all readings, and of a quarter of them, that shows another offset of the clocks.
MIN_AGREEMENT, MIN_PART_AGREEMENT = 0.7, 0.95
MIN_EXPLAINED = 0.3  # fraction of the readings' variance, by the coarse offset


def find_reference_clock(turning: Turning, rates_rad_s: Array | None) -> TimeBase:
    """Return the clock of a reference; `rates_rad_s` (N, 3) are the rates of its rows, None for attitudes alone.

    Raise Fault `inverted_attitudes`, and those of `TableMotion` and `estimate_time_base`.
    """
    time_s, readings = turning.time_s, turning.readings_rad_s
    motion = TableMotion(turning.rows_s.mean(axis=1), turning.attitudes, rates_rad_s)
    estimated = or_fault(partial(estimate_time_base, time_s, readings, motion))
    if rates_rad_s is not None:
        return _raise_fault(estimated)
    steady, unexplained = _find_steady_clock(turning, motion)
    if unexplained > MAX_UNEXPLAINED:
        _check_not_inverted(turning, unexplained)
    if not isinstance(estimated, Fault):
        aligned = replace(turning, time_s=estimated.controller_time_s(time_s))
        if find_start(select_covered(aligned)).unexplained <= MAX_UNEXPLAINED_RATIO * unexplained:
            return estimated
    if unexplained < 1.0:
        return steady
    return _raise_fault(estimated)


def _estimate_clock(turning: Turning, rates_rad_s: Array | None) -> TimeBase:
    motion = TableMotion(turning.rows_s.mean(axis=1), turning.attitudes, rates_rad_s)
    return estimate_time_base(turning.time_s, turning.readings_rad_s, motion)


def check_one_clock(turning: Turning, rates_rad_s: Array | None) -> None:
    """Raise Fault `clocks_apart` if the rotation shows that the clocks of rows and readings run at different rates.

    Raise nothing if the readings have a long gap, because a clock may have been set there, which looks like another
    rate.
    """
    drift = 0.0
    for find in (_estimate_clock, find_reference_clock):  # the first is fast, and shows that nothing is wrong
        clock = or_fault(partial(find, turning, rates_rad_s))
        if isinstance(clock, Fault) or abs(clock.drift) < max(MIN_DRIFT, MIN_DRIFT_STDS * clock.drift_std):
            return
        drift = clock.drift
    lasts_s = float(turning.time_s[-1] - turning.time_s[0])
    steps_s = np.diff(turning.time_s)
    if steps_s.max() > max(MAX_STEP_INTERVALS * np.median(steps_s), MAX_STEP_DRIFT_FRACTION * abs(drift) * lasts_s):
        return
    raise Fault(
        "clocks_apart",
        f"the clock of the attitudes gains {100 * drift:+.2g} % on that of the samples, "
        f"{1e3 * abs(drift) * lasts_s:.0f} ms over the recording: the scale factors would be wrong by as much",
        "Write both files by one clock, or let --estimate-clock-offset find the difference",
    )


def check_offset(turning: Turning) -> None:
    """Raise Fault `clocks_apart` if rows and readings show the same rotation only after a shift in time.

    Raise it also if a clock was set during the recording: the first and the last quarter of the readings need different
    shifts to agree with the rows, or the times of the rows step back once.
    """
    middles_s = turning.rows_s.mean(axis=1)
    backward = np.flatnonzero(np.diff(middles_s) < 0)
    if len(backward) == 1:
        at_s, next_s = middles_s[backward[0] : backward[0] + 2].tolist()
        raise _clock_set(f"whose clock was set back by {at_s - next_s:.2g} s after {at_s:.10g} s")
    motion = or_fault(lambda: TableMotion(middles_s, turning.attitudes, None))
    if isinstance(motion, Fault):
        return
    quarter = len(turning.time_s) // 4
    (explained, offset_s), (first, before_s), (last, after_s) = (
        estimate_coarse_offset(turning.time_s[part], turning.readings_rad_s[part], motion)
        for part in (slice(None), slice(quarter), slice(-quarter, None))
    )
    if explained >= MIN_AGREEMENT and abs(offset_s) > MAX_CLOCK_S:
        late = "late" if offset_s > 0 else "early"
        raise _clock_set(f"but agree with them if these are {abs(offset_s):.2g} s too {late}")
    if min(first, last) >= MIN_PART_AGREEMENT and abs(after_s - before_s) > MAX_CLOCK_S:
        raise _clock_set(f"but agree with them if a clock was set by {abs(after_s - before_s):.2g} s in between")


def _clock_set(what: str) -> Fault:
    return Fault(
        "clocks_apart",
        f"the readings contradict the attitudes, {what}",
        "Write both files by one clock, or give the part before or after a step; --estimate-clock-offset finds a "
        "constant difference",
    )


def _find_steady_clock(turning: Turning, motion: TableMotion) -> tuple[TimeBase, float]:
    """Return the clock without drift, and the fraction (0 to 1) of the rotation that this clock leaves unexplained."""
    time_s = turning.time_s
    explained, offset_s = estimate_coarse_offset(time_s, turning.readings_rad_s, motion)
    unexplained, bias_rad_s = 1.0, np.zeros(3)
    if explained >= MIN_EXPLAINED:
        start = find_start(select_covered(replace(turning, time_s=time_s + offset_s)))
        offset_s, unexplained, bias_rad_s = offset_s - start.state.clock_s, start.unexplained, start.state.bias
    covariance = np.diag([COARSE_S**2, CRYSTAL_DRIFT_STD**2])
    return TimeBase(offset_s, 0.0, float(time_s[0] + time_s[-1]) / 2, covariance, bias_rad_s), unexplained


def _check_not_inverted(turning: Turning, unexplained: float) -> None:
    """Raise Fault `inverted_attitudes` if inverse rotations reduce the fraction `unexplained` to less than half."""
    inverse = replace(turning, attitudes=np.swapaxes(turning.attitudes, -1, -2))
    motion = TableMotion(inverse.rows_s.mean(axis=1), inverse.attitudes, None)
    if _find_steady_clock(inverse, motion)[1] < unexplained / 2:
        raise report_inverted()


def _raise_fault(estimated: TimeBase | Fault) -> TimeBase:
    if isinstance(estimated, Fault):
        raise estimated
    return estimated
