"""The board's clock relative to the controller's: offset and drift, estimated from the data alone.

The gyroscope and the arm measure the same rotation. A coarse search correlates turn rate with joint rate over all data
(the board may have been switched on at any time); a weighted least-squares fit of the vector readings to the flange's
rate then finds the offset to a fraction of a millisecond. The delay of the sensor's own filter is part of the offset.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.cubic_spline import CubicSpline
from rig.observation.motion.reference_motion import KnownMotion, check_span, not_finite
from rig.observation.statistics.coloured_noise import correlation_inflation

# The board's counter runs from its 32768 Hz crystal by way of a PLL, 576 ppm below the nominal rate (docs/board.md).
NOMINAL_DRIFT = 4e6 / (122 * 32768) - 1
MIN_SAMPLES = 100
CHECK_SENSOR = "Check that the sensor is fixed to the flange and read in the right range, then record again"
COARSE_STEP_S = 0.02  # far shorter than the ramps of a sweep, so that the fine fit converges
COARSE_REACH_S = 0.15  # largest clock error at either end of the data from which the fine fit converges
CANDIDATES = 12  # peaks of the correlation that are tried: six equal sweeps make eleven
CONTRADICTION = 6.0  # standard deviations between the drifts of two fits
MIN_EXPLAINED = 0.5  # fraction of the readings' variance that the arm's motion must explain
LONG_RUN_S = 1800.0  # the part of a recording that the coarse search uses first; it takes more only if that fails
MAX_DRIFT = 0.03  # an oscillator without a crystal is within 2 %
MAX_DRIFT_LONG_RUN = 1e-3  # one with a crystal is within 600 ppm
MAX_DRIFT_STEPS = 20  # steps to either side
TURNED_RAD_S = 0.05  # RMS over a recording, of an axis that was turned
# Ratio to the square of the fastest axis: a body that turns about one axis shows only rounding about others.
NO_TURNING = 1e-12
# Steps in standard deviations; an offset may turn around with a small step while the drift still changes.
SETTLED, UNDERWAY = 1e-3, 0.1
FINE_STEPS = 400  # many: if the arm vibrates and hardly turns, a step may be nearly as long as the one before
# Steps after which weights are kept: noise that seems correlated only at every second step would never settle.
WEIGHED_STEPS = 60
SLOW_S, FINE_S = 0.1, 0.02  # times over which rates are averaged, first and second
AVERAGED, EVERY = 10, 2  # rates in one average; stride of the averages in the spline
LEAST_GAP = 0.5  # in intervals between samples
# Step from which on, and interval at which, the fit extrapolates; largest number of steps it skips.
SLOW_STEPS, LEAP_STEPS, FARTHEST = 300, 20, 100.0


@dataclass(frozen=True, slots=True)
class TimeBase:
    """A clock: controller time = board time + `offset_s` + `drift` × (board time − `reference_s`), in seconds.

    `reference_s` is the board's time in the middle of the data, where offset and drift are nearly uncorrelated.
    `covariance` (2, 2) is that of (`offset_s`, `drift`). `zero_rate_rad_s` (3,) is the fitted reading at rest.
    """

    offset_s: float
    drift: float
    reference_s: float
    covariance: Array
    zero_rate_rad_s: Array

    @property
    def offset_std_s(self) -> float:
        """The standard deviation of the offset, s."""
        return float(np.sqrt(self.covariance[0, 0]))

    @property
    def drift_std(self) -> float:
        """The standard deviation of the drift."""
        return float(np.sqrt(self.covariance[1, 1]))

    def controller_time_s(self, board_time_s: Array) -> Array:
        """Return board times on the controller's clock."""
        return board_time_s + self.offset_s + self.drift * (board_time_s - self.reference_s)

    def correct(self, by_s: float, std_s: float) -> "TimeBase":
        """Return the time base with `by_s` added to its offset, whose standard deviation is then `std_s`."""
        covariance = np.diag([std_s**2, self.covariance[1, 1]])
        return replace(self, offset_s=self.offset_s + by_s, covariance=covariance)

    def board_time_s(self, controller_time_s: float) -> float:
        """Return a controller time on the board's clock."""
        since_reference_s = (controller_time_s - self.offset_s - self.reference_s) / (1 + self.drift)
        return self.reference_s + since_reference_s


def estimate_time_base(board_time_s: Array, readings_rad_s: Array, motion: KnownMotion) -> TimeBase:
    """Estimate the board's clock relative to the turner's from readings (n, 3) taken at board times (n,).

    Raise Fault `not_finite`, `impossible_times`, `board_clock_restarted`, `duplicated_samples`, `stuck_sensor`,
    `stuck_axis`, `time_base_not_found`.
    """
    check_span(motion.time_s, "the states or attitudes")
    _check_samples(board_time_s, readings_rad_s, motion)
    clock, count = _find_first_clock(board_time_s, readings_rad_s, motion)
    while True:
        # The samples are chosen by the present clock: a choice that followed the fitted clock might never settle.
        used = motion.covered(clock.controller_time_s(board_time_s[:count]))
        if used.sum() < MIN_SAMPLES:
            raise _not_found("board and arm were hardly recorded at the same time")
        clock = _fit_clock(clock, board_time_s[:count][used], readings_rad_s[:count][used], motion)
        if count == len(board_time_s):
            break
        count = _count_until(board_time_s, 2 * (board_time_s[count] - board_time_s[0]))
        clock = _move_reference(clock, (board_time_s[0] + board_time_s[count - 1]) / 2)
    if not abs(clock.drift) < MAX_DRIFT or not clock.offset_std_s < COARSE_STEP_S:
        raise _not_found(
            f"the board's clock would run {100 * clock.drift:+.2f} % off, to {clock.offset_std_s * 1e3:.1f} ms"
        )
    return clock


def _check_samples(board_time_s: Array, readings: Array, motion: KnownMotion) -> None:
    if len(board_time_s) < MIN_SAMPLES:
        raise _not_found(
            f"the recording holds {len(board_time_s)} samples, of at least {MIN_SAMPLES} that are needed",
            "Raise the rate of the samples, or sweep more slowly",
        )
    check_readings(board_time_s, readings)
    still = np.ptp(readings, axis=0) == 0
    if still.all():
        raise Fault(
            "stuck_sensor",
            f"the gyroscope reads {_triple(readings[0])} rad/s all the time, although the arm moves",
            "Check the sensor's supply and its bus wiring",
        )
    if still.any() and _turns_every_axis(motion):
        raise Fault(
            "stuck_axis",
            f"axis {'xyz'[int(np.argmax(still))]} of the gyroscope never changes, although the arm moves",
            "The sensor is broken or wrongly configured; replace it",
        )


def _turns_every_axis(motion: KnownMotion) -> bool:
    """Return whether every sensor axis turns, however it is mounted; one that does not may repeat its reading."""
    rates = motion.rate(motion.time_s[motion.covered(motion.time_s)])
    return bool(np.linalg.eigvalsh(rates.T @ rates).min() > TURNED_RAD_S**2 * len(rates))


def check_readings(board_time_s: Array, readings: Array) -> None:
    """Raise Fault if readings (n, 3) are not finite or their times (n,) do not rise.

    The faults are `not_finite`, `duplicated_samples`, `board_clock_restarted`, `impossible_times`.
    """
    if not np.isfinite(readings).all():
        raise not_finite("a reading")
    if np.any(np.diff(board_time_s) == 0):
        raise Fault(
            "duplicated_samples",
            "the recording holds two samples of the same moment",
            "Record again; the board's firmware or the link has delivered samples twice",
        )
    if np.any(np.diff(board_time_s) < 0):
        raise Fault(
            "board_clock_restarted",
            "the board's clock goes back within the recording: the board was reset",
            "Check the board's power and cable, then record again",
        )
    check_span(board_time_s, "the samples")


def _find_first_clock(board_time_s: Array, readings: Array, motion: KnownMotion) -> tuple[TimeBase, int]:
    """Return the coarse clock of the first samples that suffice to find one, and their number.

    A recording of ordinary length needs all samples. In a recording of hours a part suffices; the fine clock is then
    extended to twice its length, repeatedly.
    """
    span_s = LONG_RUN_S
    while True:
        count = _count_until(board_time_s, span_s)
        try:
            return _search_clock(board_time_s[:count], readings[:count], motion), count
        except Fault:
            if count == len(board_time_s):
                raise
        span_s *= 2


def _move_reference(clock: TimeBase, reference_s: float) -> TimeBase:
    """Return the clock with its offset at another reference time."""
    offset_s = clock.offset_s + clock.drift * (reference_s - clock.reference_s)
    return replace(clock, offset_s=float(offset_s), reference_s=float(reference_s))


def _count_until(board_time_s: Array, span_s: float) -> int:
    """Return how many samples lie in the first `span_s`."""
    return int(np.searchsorted(board_time_s, board_time_s[0] + span_s, side="right"))


def _search_clock(board_time_s: Array, readings: Array, motion: KnownMotion) -> TimeBase:
    """Return the clock with which the arm's motion explains most of the readings, to start the fine fit."""
    reference, half_s = (board_time_s[0] + board_time_s[-1]) / 2, (board_time_s[-1] - board_time_s[0]) / 2
    spacing = 2 * COARSE_REACH_S / half_s
    count = round(max(min(MAX_DRIFT, MAX_DRIFT_STEPS * spacing), MAX_DRIFT_LONG_RUN) / spacing)
    arm_rate = lru_cache(maxsize=1)(partial(_arm_rate, motion))  # nearly always the same for all drifts
    candidates = (
        (*_coarse_offset((board_time_s - reference) * (1 + drift), readings, arm_rate), drift)
        for drift in spacing * np.arange(-count, count + 1)
    )
    explained, offset, drift = max(candidates)
    if explained < MIN_EXPLAINED:
        raise _not_found(f"the arm's motion explains {100 * explained:.0f} % of what the gyroscope reads")
    return TimeBase(float(offset - reference), float(drift), float(reference), np.zeros((2, 2)), np.zeros(3))


def estimate_coarse_offset(board_time_s: Array, readings_rad_s: Array, motion: KnownMotion) -> tuple[float, float]:
    """Return the explained fraction of the variance of readings (n, 3), and the clock's offset without drift, s."""
    reference_s = float(board_time_s[0] + board_time_s[-1]) / 2
    explained, offset_s = _coarse_offset(board_time_s - reference_s, readings_rad_s, partial(_arm_rate, motion))
    return explained, offset_s - reference_s


def _arm_rate(motion: KnownMotion, step_s: float) -> tuple[float, Array]:
    """Return the start of the motion, s, and from then its rate (3, n) at even steps, minus the mean."""
    grid = np.arange(motion.time_s[0], motion.time_s[-1], step_s)
    rate = motion.rate(grid).T
    return float(grid[0]), rate - rate.mean(axis=1, keepdims=True)


def _coarse_offset(
    time_s: Array, readings: Array, arm_rate: Callable[[float], tuple[float, Array]]
) -> tuple[float, float]:
    """Return the explained fraction of the variance, and the offset (controller − `time_s`) to within a step.

    Every pair of axes is cross-correlated (magnitudes could hide a rotation in a bias); the vector fit judges the
    peaks. A step contains at least one sample.
    """
    step_s = max(COARSE_STEP_S, 1.1 * float(np.median(np.diff(time_s))))
    bins = ((time_s - time_s[0]) / step_s).astype(np.intp)
    counts = np.bincount(bins)
    filled = counts > 0
    board = np.array([np.bincount(bins, readings[:, axis]) for axis in range(3)]) / np.maximum(counts, 1)
    turning = np.where(filled, board - board[:, filled].mean(axis=1, keepdims=True), 0.0)
    start_s, moving = arm_rate(step_s)

    count = len(filled) + moving.shape[1]
    size = _fast_length(count)
    spectra = np.conj(np.fft.rfft(turning, size)), np.fft.rfft(moving, size)
    squares = sum(np.fft.irfft(one * other, size) ** 2 for one in spectra[0] for other in spectra[1])
    correlation = np.roll(squares, len(filled))[:count]
    peaks = np.flatnonzero((correlation[1:-1] > correlation[:-2]) & (correlation[1:-1] >= correlation[2:])) + 1
    best = peaks[np.argsort(correlation[peaks])[::-1][:CANDIDATES]] - len(filled)

    explained = _compute_explained_fractions(turning, filled, moving, best)
    fraction, lag = max(zip(explained.tolist(), best.tolist(), strict=True), default=(0.0, 0))
    # Bin j of the board, whose middle lies half a step after its start, corresponds to point j + lag of the arm's grid.
    return fraction, float(start_s + lag * step_s - time_s[0] - step_s / 2)


def _fast_length(least: int) -> int:
    """Return the next number without prime factors above 5: a length for which a Fourier transform is fast."""
    threes = (3**power for power in range(least.bit_length()))
    odd = (three * 5**power for three in threes for power in range(least.bit_length()) if three * 5**power < 2 * least)
    length: int = min(number << (-(-least // number) - 1).bit_length() for number in odd)
    return length


def _compute_explained_fractions(
    turning: Array, filled: NDArray[np.bool_], moving: Array, lags: NDArray[np.intp]
) -> Array:
    """Return the fraction (k,) of the variance that the arm's rate explains at each lag (k,) of bins; 0 if few overlap.

    The arm's rate (3, m) explains the board's rate (3, n) by a linear map, over the bins that are `filled` (n,). The
    normal equations are precise enough, because the best lag is only the start of the fine fit.
    """
    board, products = np.vstack([filled, turning]), np.empty((len(lags), 7, 7))
    for product, lag in zip(products, lags, strict=True):
        start, end = max(0, -lag), min(len(filled), moving.shape[1] - lag)
        both = np.vstack([board[:, start:end], moving[:, start + lag : end + lag] * filled[start:end]])
        product[:] = both.copy() @ both.T  # the product of a matrix with itself would take twice as long
    count, sums = products[:, :1, :1], products[:, :1, 1:]
    scatter = products[:, 1:, 1:] - np.swapaxes(sums, 1, 2) @ sums / np.maximum(count, 1)
    together, total = scatter[:, 3:, :3], np.trace(scatter[:, :3, :3], axis1=1, axis2=2)
    inverse = np.linalg.pinv(scatter[:, 3:, 3:], rcond=1e-10, hermitian=True)
    enough = (count[:, 0, 0] >= 0.5 * min(len(filled), moving.shape[1])) & (total > 0)
    fractions: Array = np.sum(together * (inverse @ together), axis=(1, 2)) / np.where(enough, total, np.inf)
    return fractions


class _SlowMotion:
    """A `KnownMotion` between two times, with its rate averaged over `over_s`."""

    def __init__(self, motion: KnownMotion, over_s: float, start_s: float, end_s: float) -> None:
        self.time_s, self.covered = motion.time_s, motion.covered
        step_s = over_s / AVERAGED
        times_s = np.arange(max(start_s, self.time_s[0]), min(end_s, self.time_s[-1]), step_s)
        rates = np.cumsum(motion.rate(times_s), axis=0)
        means = (rates[AVERAGED:] - rates[:-AVERAGED]) / AVERAGED
        self.rate = CubicSpline(times_s[AVERAGED::EVERY] - (AVERAGED - 1) / 2 * step_s, means[::EVERY])


def _average_samples(time_s: Array, readings: Array, count: int) -> tuple[Array, Array]:
    """Return times (m,) and readings (m, 3) averaged over `count` samples that follow each other without a gap."""
    starts = np.arange(0, len(time_s) - count + 1, count)
    lasting_s = time_s[starts + count - 1] - time_s[starts]
    starts = starts[lasting_s <= (count - 1 + LEAST_GAP) * float(np.median(np.diff(time_s)))]
    inside = starts[:, None] + np.arange(count)
    return time_s[inside].mean(axis=1), readings[inside].mean(axis=1)


def _fit_clock(clock: TimeBase, board_time_s: Array, readings: Array, motion: KnownMotion) -> TimeBase:
    """Return the clock with the best fit of readings and motion, first by their slow parts.

    A ripple is the same after a period, and a fast ripple differs between readings and states because of their filters.
    If the finest fit has no optimum for this reason, the clock of the slow parts remains, with its own uncertainty.
    Raise Fault `time_base_not_found`.
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
    """Return whether the drift of a finer fit is less certain than that of the one before it, and contradicts it.

    It has then found another optimum: readings without a filter show fast ripples at other frequencies (aliasing). The
    offsets may differ, as filters delay slow and fast parts differently.
    """
    difference, std = abs(refined.drift - clock.drift), float(np.hypot(refined.drift_std, clock.drift_std))
    return refined.drift_std > clock.drift_std and difference > CONTRADICTION * std


def _list_stages(
    clock: TimeBase, board_time_s: Array, readings: Array, motion: KnownMotion
) -> Iterator[tuple[Array, Array, KnownMotion]]:
    """Yield times, readings and motion for each fit: averaged over long times, over short times, and not averaged."""
    start_s, end_s = clock.controller_time_s(board_time_s[[0, -1]]).tolist()
    step_s = float(np.median(np.diff(board_time_s)))
    for over_s in (SLOW_S, FINE_S):
        count = round(over_s / step_s)
        if count < 2 or len(board_time_s) < MIN_SAMPLES * count:
            continue
        slow = _SlowMotion(motion, count * step_s, start_s - 1.0, end_s + 1.0)
        yield *_average_samples(board_time_s, readings, count), slow
        if over_s == FINE_S:
            return
    yield board_time_s, readings, motion


def _iterate_clock(clock: TimeBase, board_time_s: Array, readings: Array, motion: KnownMotion) -> TimeBase:
    """Refine the clock until it settles, with leaps if steps shrink slowly. Raise Fault `time_base_not_found`."""
    moved, inflation = np.zeros(2), None
    for number in range(1, FINE_STEPS + 1):
        before, last = clock, moved
        settled = inflation if number > WEIGHED_STEPS else None
        clock, inflation = _refine_clock(clock, board_time_s, readings, motion, settled)
        moved = np.array([clock.offset_s - before.offset_s, clock.drift - before.drift])
        if abs(moved[0]) < SETTLED * clock.offset_std_s and abs(moved[1]) < UNDERWAY * clock.drift_std:
            return clock
        if number >= SLOW_STEPS and number % LEAP_STEPS == 0:
            further = moved * _remaining_steps(float(moved[0] / last[0]))
            clock = replace(clock, offset_s=clock.offset_s + further[0], drift=clock.drift + further[1])
    raise _not_found("the fit of the board's clock does not settle")


def _remaining_steps(ratio: float) -> float:
    """Return the sum of all further steps as a multiple of the last step, if steps shrink by `ratio` (Aitken's Δ²)."""
    return min(ratio / (1 - ratio), FARTHEST) if 0 < ratio < 1 else 0.0


def _refine_clock(
    clock: TimeBase, board_time_s: Array, readings: Array, motion: KnownMotion, inflation: Array | None = None
) -> tuple[TimeBase, Array]:
    """Return the clock after one Gauss–Newton step, and the inflation (3,) of each axis' variance due to correlation.

    Model: m = A r(t) + c + noise, r the flange's rate at controller time t; A (3, 3) and c (3,) are also fitted.
    Without `inflation`, estimate it from the residuals.
    """
    t, since = clock.controller_time_s(board_time_s), board_time_s - clock.reference_s
    columns = np.column_stack([motion.rate(t), np.ones(len(t))])
    inverse = np.linalg.pinv(columns.T @ columns, rcond=NO_TURNING, hermitian=True) @ columns.T
    fitted = inverse @ readings
    residual = readings - columns @ fitted
    by_offset = motion.rate(t, 1) @ fitted[:3]
    by_clock = np.hstack([by_offset, by_offset * since[:, None]])
    by_clock -= columns @ (inverse @ by_clock)
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


def _triple(values: Array) -> str:
    return ", ".join(f"{value:.4g}" for value in values)


def _not_found(what: str, remedy: str = CHECK_SENSOR) -> Fault:
    return Fault("time_base_not_found", f"{what}, so board and arm cannot be put on one clock", remedy)
