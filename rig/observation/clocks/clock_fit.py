"""The weighted least-squares fit of vector readings to the flange's rate, which refines a clock."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array, median_step
from rig.estimation.cubic_spline import CubicSpline
from rig.observation.clocks.time_base import TimeBase, time_base_not_found
from rig.observation.motion.reference_motion import KnownMotion
from rig.observation.statistics.coloured_noise import correlation_inflation

MIN_SAMPLES = 100
MAX_DRIFT_DIFFERENCE = 6.0  # standard deviations between the drifts of two fits
MIN_ROTATION_RATIO = 1e-12  # to the square of the fastest axis: less is rounding
# Steps in standard deviations; an offset may turn around with a small step while the drift still changes.
CONVERGED_OFFSET, CONVERGED_DRIFT = 1e-3, 0.1
MAX_FINE_STEPS = 400  # many: if the arm vibrates and hardly turns, a step may be nearly as long as the one before
MAX_WEIGHING_STEPS = 60  # noise that seems correlated only at every second step would never settle
SLOW_AVERAGE_S, FINE_AVERAGE_S = 0.1, 0.02  # over which rates are averaged in the first fit and in the second
MEAN_RATES, STRIDE = 10, 2  # rates in one average; stride of the averages in the spline
MIN_STEP_INTERVALS = 0.5  # between samples
# The first step at which the fit extrapolates, the steps between extrapolations, and the most steps that one skips.
FIRST_LEAP_STEP, LEAP_INTERVAL, MAX_LEAP_STEPS = 300, 20, 100.0


class _SlowMotion:
    """A `KnownMotion` between two times, with its rate averaged over `over_s`."""

    def __init__(self, motion: KnownMotion, over_s: float, start_s: float, end_s: float) -> None:
        self.time_s, self.covered = motion.time_s, motion.covered
        step_s = over_s / MEAN_RATES
        times_s = np.arange(max(start_s, self.time_s[0]), min(end_s, self.time_s[-1]), step_s)
        rates = np.cumsum(motion.rate(times_s), axis=0)
        means = (rates[MEAN_RATES:] - rates[:-MEAN_RATES]) / MEAN_RATES
        self.rate = CubicSpline(times_s[MEAN_RATES::STRIDE] - (MEAN_RATES - 1) / 2 * step_s, means[::STRIDE])


def _average_samples(time_s: Array, readings: Array, count: int) -> tuple[Array, Array]:
    """Return times (m,) and readings (m, 3) averaged over `count` samples that follow each other without a gap."""
    starts = np.arange(0, len(time_s) - count + 1, count)
    lasting_s = time_s[starts + count - 1] - time_s[starts]
    starts = starts[lasting_s <= (count - 1 + MIN_STEP_INTERVALS) * median_step(time_s)]
    inside = starts[:, None] + np.arange(count)
    return time_s[inside].mean(axis=1), readings[inside].mean(axis=1)


def fit_clock(clock: TimeBase, board_time_s: Array, readings: Array, motion: KnownMotion) -> TimeBase:
    """Return the clock with which readings and motion agree best, at first only in their slow parts, then in all.

    The slow parts come first because a fast ripple fits as well if the offset is wrong by one of its periods, and
    because filters change a fast ripple differently in readings and in states. If a finer fit fails, or contradicts the
    fit before it, return the clock of the earlier fit. Raise Fault `time_base_not_found`.
    """
    first, *finer = _list_stages(clock, board_time_s, readings, motion)
    clock = _iterate_clock(clock, *first)
    with suppress(Fault):
        for stage in finer:
            refined = _iterate_clock(clock, *stage)
            if _is_contradiction(clock, refined):
                break
            clock = refined
    return clock


def _is_contradiction(clock: TimeBase, refined: TimeBase) -> bool:
    """Return whether a finer fit has a less certain drift than the fit before it, and contradicts that fit.

    The finer fit has then found another optimum, because readings without a filter show fast ripples at other
    frequencies (aliasing). Only the drifts are compared. The offsets may differ, because filters delay slow and fast
    parts differently.
    """
    difference, std = abs(refined.drift - clock.drift), float(np.hypot(refined.drift_std, clock.drift_std))
    return refined.drift_std > clock.drift_std and difference > MAX_DRIFT_DIFFERENCE * std


def _list_stages(
    clock: TimeBase, board_time_s: Array, readings: Array, motion: KnownMotion
) -> Iterator[tuple[Array, Array, KnownMotion]]:
    """Yield the times, readings and motion of each fit: first averaged over a long time, then over a short time.

    An average is omitted if it would leave too few readings. If the second average is omitted, the last fit is of the
    readings as they are.
    """
    start_s, end_s = clock.controller_time_s(board_time_s[[0, -1]]).tolist()
    step_s = median_step(board_time_s)
    for over_s in (SLOW_AVERAGE_S, FINE_AVERAGE_S):
        count = round(over_s / step_s)
        if count < 2 or len(board_time_s) < MIN_SAMPLES * count:
            continue
        time_s, means = _average_samples(board_time_s, readings, count)
        if len(time_s) < MIN_SAMPLES / 2:  # uneven times seem to have gaps everywhere
            continue
        yield time_s, means, _SlowMotion(motion, count * step_s, start_s - 1.0, end_s + 1.0)
        if over_s == FINE_AVERAGE_S:
            return
    yield board_time_s, readings, motion


def _iterate_clock(clock: TimeBase, board_time_s: Array, readings: Array, motion: KnownMotion) -> TimeBase:
    """Return the clock after Gauss–Newton steps until it settles.

    Steps that shrink slowly are extrapolated at regular intervals. Raise Fault `time_base_not_found`.
    """
    moved, inflation = np.zeros(2), None
    for number in range(1, MAX_FINE_STEPS + 1):
        before, last = clock, moved
        settled = inflation if number > MAX_WEIGHING_STEPS else None
        clock, inflation = _refine_clock(clock, board_time_s, readings, motion, settled)
        moved = np.array([clock.offset_s - before.offset_s, clock.drift - before.drift])
        if abs(moved[0]) < CONVERGED_OFFSET * clock.offset_std_s and abs(moved[1]) < CONVERGED_DRIFT * clock.drift_std:
            return clock
        if number >= FIRST_LEAP_STEP and number % LEAP_INTERVAL == 0:
            further = moved * _remaining_steps(float(moved[0] / last[0]))
            clock = replace(clock, offset_s=clock.offset_s + further[0], drift=clock.drift + further[1])
    raise time_base_not_found("the fit of the board's clock does not settle")


def _remaining_steps(ratio: float) -> float:
    """Return the sum of all further steps as a multiple of the last step, if steps shrink by `ratio` (Aitken's Δ²)."""
    return min(ratio / (1 - ratio), MAX_LEAP_STEPS) if 0 < ratio < 1 else 0.0


def _refine_clock(
    clock: TimeBase, board_time_s: Array, readings: Array, motion: KnownMotion, inflation: Array | None = None
) -> tuple[TimeBase, Array]:
    """Return the clock after one Gauss–Newton step, and the inflation (3,) of each axis' variance due to correlation.

    The model of a reading is m = A r(t) + c + noise, with the flange's rate r at the controller time t; A (3, 3) and c
    (3,) are fitted too. If `inflation` is None, it is estimated from the residuals.
    """
    t, since = clock.controller_time_s(board_time_s), board_time_s - clock.reference_s
    columns = np.column_stack([motion.rate(t), np.ones(len(t))])
    inverse = np.linalg.pinv(columns.T @ columns, rcond=MIN_ROTATION_RATIO, hermitian=True) @ columns.T
    fitted = inverse @ readings
    residual = readings - columns @ fitted
    by_offset = motion.rate(t, 1) @ fitted[:3]
    by_clock = np.hstack([by_offset, by_offset * since[:, None]])
    by_clock -= columns @ (inverse @ by_clock)  # without the part that A and c explain
    if inflation is None:
        inflation = np.array([correlation_inflation(noise) for noise in residual.T])
    weights = 1 / (np.einsum("na,na->a", residual, residual) / len(t) * inflation + np.finfo(np.float64).tiny)
    normal = np.einsum("iaja,a->ij", (by_clock.T @ by_clock).reshape(2, 3, 2, 3), weights)
    right = np.einsum("iaa,a->i", (by_clock.T @ residual).reshape(2, 3, 3), weights)
    covariance = np.asarray(np.linalg.pinv(normal, hermitian=True), dtype=np.float64)
    step = covariance @ right
    refined = TimeBase(
        clock.offset_s + float(step[0]),
        clock.drift + float(step[1]),
        clock.reference_s,
        covariance,
        np.asarray(fitted[3], dtype=np.float64),
    )
    return refined, inflation
