"""When a sample was taken, on the controller's clock: offset and drift of the board's clock, from the data alone.

The gyroscope and the arm see the same turning. A coarse search correlates turn rate with joint rate over all data (the
board may have been switched on at any time); a weighted least-squares fit of the vector readings to the flange's rate
then finds the offset to a fraction of a millisecond. The delay of the sensor's own filter is part of the offset.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.observation.motion.known_motion import KnownMotion, check_span, not_finite
from rig.observation.statistics.coloured_noise import widening

# The board's counter runs from its 32768 Hz crystal by way of a PLL, 576 ppm below the nominal rate (docs/board.md).
NOMINAL_DRIFT = 4e6 / (122 * 32768) - 1
MIN_SAMPLES = 100
COARSE_STEP_S = 0.02  # far below the ramps of a sweep, so that the fine fit starts inside its reach
COARSE_REACH_S = 0.15  # what the clock may be off at either end of the data when the fine fit starts
CANDIDATES = 12  # peaks of the correlation looked at: six equal sweeps give eleven
MIN_EXPLAINED = 0.5  # share of the readings' variance that the arm's motion must explain
LONG_RUN_S = 1800.0  # so much of a recording the coarse search looks at, and more only where it finds nothing
MAX_DRIFT = 0.03  # an oscillator that no crystal holds is within 2 %
MAX_DRIFT_LONG_RUN = 1e-3  # one that a crystal holds is within 600 ppm
MAX_DRIFT_STEPS = 20  # to either side
TURNED_RAD_S = 0.05  # RMS over a recording, of an axis that was turned
NO_TURNING = 1e-12  # of the square of the fastest: a body that turns about one axis has only rounding about others
SETTLED, UNDERWAY = 1e-3, 0.1  # standard deviations; an offset may turn back, standing still, while the drift goes on
FINE_STEPS = 400  # each may be nearly as long as the last where the arm vibrates and little of it turns
SLOW_S, FINE_S = 0.1, 0.02  # over which rates are averaged, at first and then
AVERAGED, EVERY = 10, 2  # rates in as long, and every so many of the averages is looked at
LEAST_GAP = 0.5  # of the time between samples
SLOW_STEPS, LEAP_STEPS, FARTHEST = 300, 20, 100.0  # then, and so often, what is left is gone at once, at most so far


@dataclass(frozen=True, slots=True)
class TimeBase:
    """Controller time = board time + `offset_s` + `drift` × (board time − `reference_s`), all in seconds.

    `reference_s` is the board's time in the middle of the data, where offset and drift are nearly uncorrelated.
    `covariance` (2, 2) is that of (`offset_s`, `drift`). `zero_rate_rad_s` (3,) is the reading at rest that fits the
    whole run.
    """

    offset_s: float
    drift: float
    reference_s: float
    covariance: Array
    zero_rate_rad_s: Array

    @property
    def offset_std_s(self) -> float:
        """Standard deviation of the offset."""
        return float(np.sqrt(self.covariance[0, 0]))

    @property
    def drift_std(self) -> float:
        """Standard deviation of the drift."""
        return float(np.sqrt(self.covariance[1, 1]))

    def controller_time_s(self, board_time_s: Array) -> Array:
        """Board times on the controller's clock."""
        return board_time_s + self.offset_s + self.drift * (board_time_s - self.reference_s)

    def board_time_s(self, controller_time_s: float) -> float:
        """A time of the controller's on the board's clock."""
        since_reference_s = (controller_time_s - self.offset_s - self.reference_s) / (1 + self.drift)
        return self.reference_s + since_reference_s


def estimate_time_base(board_time_s: Array, readings_rad_s: Array, motion: KnownMotion) -> TimeBase:
    """The board's clock against that of what turned it, from readings (n, 3) taken at board times (n,).

    Raises Fault `not_finite`, `impossible_times`, `board_clock_restarted`, `duplicated_samples`, `stuck_sensor`,
    `stuck_axis`, `time_base_not_found`.
    """
    check_span(motion.time_s, "the states or attitudes")
    _check_samples(board_time_s, readings_rad_s, motion)
    clock, known = _begun(board_time_s, readings_rad_s, motion)
    while True:
        # The clock so far says which samples to use; a choice that followed the fine one might never settle.
        used = motion.covered(clock.controller_time_s(board_time_s[:known]))
        if used.sum() < MIN_SAMPLES:
            raise _not_found("board and arm were hardly recorded at the same time")
        clock = _settled(clock, board_time_s[:known][used], readings_rad_s[:known][used], motion)
        if known == len(board_time_s):
            break
        known = _until(board_time_s, 2 * (board_time_s[known] - board_time_s[0]))
        clock = _seen_from(clock, (board_time_s[0] + board_time_s[known - 1]) / 2)
    if not abs(clock.drift) < MAX_DRIFT or not clock.offset_std_s < COARSE_STEP_S:
        raise _not_found(
            f"the board's clock would run {100 * clock.drift:+.2f} % off, to {clock.offset_std_s * 1e3:.1f} ms"
        )
    return clock


def _check_samples(board_time_s: Array, readings: Array, motion: KnownMotion) -> None:
    if len(board_time_s) < MIN_SAMPLES:
        raise _not_found(f"the recording holds {len(board_time_s)} samples")
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
    """Whether every axis of a sensor turned, however it sits: one that nothing turns may read the same all the time."""
    rates = motion.rate(motion.time_s[motion.covered(motion.time_s)])
    return bool(np.linalg.eigvalsh(rates.T @ rates).min() > TURNED_RAD_S**2 * len(rates))


def check_readings(board_time_s: Array, readings: Array) -> None:
    """Readings (n, 3) are refused whose times (n,) do not rise, or that are no numbers.

    Raises Fault `not_finite`, `duplicated_samples`, `board_clock_restarted`, `impossible_times`.
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


def _begun(board_time_s: Array, readings: Array, motion: KnownMotion) -> tuple[TimeBase, int]:
    """The coarse clock of the first samples in which one is found, and how many those are.

    All of a recording of ordinary length; of one of hours a part, whose fine clock reaches twice as far, and so on.
    """
    span_s = LONG_RUN_S
    while True:
        known = _until(board_time_s, span_s)
        try:
            return _coarse(board_time_s[:known], readings[:known], motion), known
        except Fault:
            if known == len(board_time_s):
                raise
        span_s *= 2


def _seen_from(clock: TimeBase, reference_s: float) -> TimeBase:
    """The clock with its offset at another time."""
    offset_s = clock.offset_s + clock.drift * (reference_s - clock.reference_s)
    return replace(clock, offset_s=float(offset_s), reference_s=float(reference_s))


def _until(board_time_s: Array, span_s: float) -> int:
    """How many samples lie in the first `span_s`."""
    return int(np.searchsorted(board_time_s, board_time_s[0] + span_s, side="right"))


def _coarse(board_time_s: Array, readings: Array, motion: KnownMotion) -> TimeBase:
    """The clock to within the fine fit's reach: of all offsets and drifts, the one under which most is explained."""
    reference, half_s = (board_time_s[0] + board_time_s[-1]) / 2, (board_time_s[-1] - board_time_s[0]) / 2
    spacing = 2 * COARSE_REACH_S / half_s
    count = round(max(min(MAX_DRIFT, MAX_DRIFT_STEPS * spacing), MAX_DRIFT_LONG_RUN) / spacing)
    arm_rate = lru_cache(maxsize=1)(partial(_arm_rate, motion))  # nearly always the same for all drifts
    found = (
        (*_coarse_offset((board_time_s - reference) * (1 + drift), readings, arm_rate), drift)
        for drift in spacing * np.arange(-count, count + 1)
    )
    explained, offset, drift = max(found)
    if explained < MIN_EXPLAINED:
        raise _not_found(f"the arm's motion explains {100 * explained:.0f} % of what the gyroscope reads")
    return TimeBase(float(offset - reference), float(drift), float(reference), np.zeros((2, 2)), np.zeros(3))


def _arm_rate(motion: KnownMotion, step_s: float) -> tuple[float, Array]:
    """When the motion begins, and from then on in such steps its rate (3, n) less its mean."""
    grid = np.arange(motion.time_s[0], motion.time_s[-1], step_s)
    rate = motion.rate(grid).T
    return float(grid[0]), rate - rate.mean(axis=1, keepdims=True)


def _coarse_offset(
    time_s: Array, readings: Array, arm_rate: Callable[[float], tuple[float, Array]]
) -> tuple[float, float]:
    """Share explained, and offset (controller − `time_s`) to within a step.

    Looks at peaks of the correlation, each axis with each (not of magnitudes, in which a bias can hide the turning),
    judged by the vector fit. A step holds at least one sample.
    """
    from scipy.fft import next_fast_len

    step_s = max(COARSE_STEP_S, 1.1 * float(np.median(np.diff(time_s))))
    bins = ((time_s - time_s[0]) / step_s).astype(np.intp)
    counts = np.bincount(bins)
    seen = counts > 0
    board = np.array([np.bincount(bins, readings[:, axis]) for axis in range(3)]) / np.maximum(counts, 1)
    turning = np.where(seen, board - board[:, seen].mean(axis=1, keepdims=True), 0.0)
    start_s, moving = arm_rate(step_s)

    count = len(seen) + moving.shape[1]
    size = next_fast_len(count, real=True)
    spectra = np.conj(np.fft.rfft(turning, size)), np.fft.rfft(moving, size)
    squares = sum(np.fft.irfft(one * other, size) ** 2 for one in spectra[0] for other in spectra[1])
    correlation = np.roll(squares, len(seen))[:count]
    peaks = np.flatnonzero((correlation[1:-1] > correlation[:-2]) & (correlation[1:-1] >= correlation[2:])) + 1
    best = peaks[np.argsort(correlation[peaks])[::-1][:CANDIDATES]] - len(seen)

    explained = _explained(turning, seen, moving, best)
    share, lag = max(zip(explained.tolist(), best.tolist(), strict=True), default=(0.0, 0))
    # Bin j of the board, whose middle lies half a step after its start, stands beside point j + lag of the arm's grid.
    return share, float(start_s + lag * step_s - time_s[0] - step_s / 2)


def _explained(turning: Array, seen: NDArray[np.bool_], moving: Array, lags: NDArray[np.intp]) -> Array:
    """Shares (k,) of the variance of what the board has `seen` (n,) turning (3, n) that a linear map of the arm's rate
    (3, m) explains when shifted by lags (k,) of bins; zero where they have little time in common.

    By the normal equations: the fine fit starts from whatever is best, so its precision is not needed here.
    """
    board, products = np.vstack([seen, turning]), np.empty((len(lags), 7, 7))
    for product, lag in zip(products, lags, strict=True):
        start, end = max(0, -lag), min(len(seen), moving.shape[1] - lag)
        both = np.vstack([board[:, start:end], moving[:, start + lag : end + lag] * seen[start:end]])
        product[:] = both.copy() @ both.T  # of a matrix and itself the product takes twice as long
    count, sums = products[:, :1, :1], products[:, :1, 1:]
    spread = products[:, 1:, 1:] - np.swapaxes(sums, 1, 2) @ sums / np.maximum(count, 1)
    together, total = spread[:, 3:, :3], np.trace(spread[:, :3, :3], axis1=1, axis2=2)
    inverse = np.linalg.pinv(spread[:, 3:, 3:], rcond=1e-10, hermitian=True)
    enough = (count[:, 0, 0] >= 0.5 * min(len(seen), moving.shape[1])) & (total > 0)
    shares: Array = np.sum(together * (inverse @ together), axis=(1, 2)) / np.where(enough, total, np.inf)
    return shares


class _SlowMotion:
    """A `KnownMotion` between two times, of which the rate is averaged over so long."""

    def __init__(self, motion: KnownMotion, over_s: float, start_s: float, end_s: float) -> None:
        from scipy.interpolate import CubicSpline

        self.time_s, self.covered = motion.time_s, motion.covered
        step_s = over_s / AVERAGED
        times_s = np.arange(max(start_s, self.time_s[0]), min(end_s, self.time_s[-1]), step_s)
        rates = np.cumsum(motion.rate(times_s), axis=0)
        means = (rates[AVERAGED:] - rates[:-AVERAGED]) / AVERAGED
        self.rate = CubicSpline(times_s[AVERAGED::EVERY] - (AVERAGED - 1) / 2 * step_s, means[::EVERY])


def _averaged(time_s: Array, readings: Array, count: int) -> tuple[Array, Array]:
    """Times (m,) and readings (m, 3), averages of so many that follow each other without a gap."""
    starts = np.arange(0, len(time_s) - count + 1, count)
    lasting_s = time_s[starts + count - 1] - time_s[starts]
    starts = starts[lasting_s <= (count - 1 + LEAST_GAP) * float(np.median(np.diff(time_s)))]
    inside = starts[:, None] + np.arange(count)
    return time_s[inside].mean(axis=1), readings[inside].mean(axis=1)


def _settled(clock: TimeBase, board_time_s: Array, readings: Array, motion: KnownMotion) -> TimeBase:
    """The clock under which readings and motion fit best, first what is slow in both.

    A ripple looks alike one period earlier and later, and a fast one is not the same in readings and states, each of
    which has a filter of its own.
    """
    start_s, end_s = clock.controller_time_s(board_time_s[[0, -1]]).tolist()
    step_s = float(np.median(np.diff(board_time_s)))
    for over_s in (SLOW_S, FINE_S):
        count = round(over_s / step_s)
        if count < 2 or len(board_time_s) < MIN_SAMPLES * count:
            continue
        slow = _SlowMotion(motion, count * step_s, start_s - 1.0, end_s + 1.0)
        clock = _converged(clock, *_averaged(board_time_s, readings, count), slow)
        if over_s == FINE_S:
            return clock
    return _converged(clock, board_time_s, readings, motion)


def _converged(clock: TimeBase, board_time_s: Array, readings: Array, motion: KnownMotion) -> TimeBase:
    moved = np.zeros(2)
    for number in range(1, FINE_STEPS + 1):
        before, last = clock, moved
        clock = _refined(clock, board_time_s, readings, motion)
        moved = np.array([clock.offset_s - before.offset_s, clock.drift - before.drift])
        if abs(moved[0]) < SETTLED * clock.offset_std_s and abs(moved[1]) < UNDERWAY * clock.drift_std:
            return clock
        if number >= SLOW_STEPS and number % LEAP_STEPS == 0:
            further = moved * _left_to_go(float(moved[0] / last[0]))
            clock = replace(clock, offset_s=clock.offset_s + further[0], drift=clock.drift + further[1])
    raise _not_found("the fit of the board's clock does not settle")


def _left_to_go(ratio: float) -> float:
    """How many times the last step is still to go where each is shorter by that ratio (Aitken's Δ²); else 0."""
    return min(ratio / (1 - ratio), FARTHEST) if 0 < ratio < 1 else 0.0


def _refined(clock: TimeBase, board_time_s: Array, readings: Array, motion: KnownMotion) -> TimeBase:
    """One Gauss–Newton step.

    Model: m = A r(t) + c + noise, r the flange's rate at controller time t; A (3, 3) and c (3,) are fitted along.
    """
    t, since = clock.controller_time_s(board_time_s), board_time_s - clock.reference_s
    columns = np.column_stack([motion.rate(t), np.ones(len(t))])
    inverse = np.linalg.pinv(columns.T @ columns, rcond=NO_TURNING, hermitian=True) @ columns.T
    fitted = inverse @ readings
    residual = readings - columns @ fitted
    by_offset = motion.rate(t, 1) @ fitted[:3]
    by_clock = np.hstack([by_offset, by_offset * since[:, None]])
    by_clock -= columns @ (inverse @ by_clock)
    widened = np.array([widening(noise) for noise in residual.T])
    weights = 1 / (np.einsum("na,na->a", residual, residual) / len(t) * widened + np.finfo(np.float64).tiny)
    normal = np.einsum("iaja,a->ij", (by_clock.T @ by_clock).reshape(2, 3, 2, 3), weights)
    right = np.einsum("iaa,a->i", (by_clock.T @ residual).reshape(2, 3, 3), weights)
    covariance = np.asarray(np.linalg.pinv(normal, hermitian=True), dtype=np.float64)
    step = covariance @ right
    return TimeBase(
        clock.offset_s + float(step[0]),
        clock.drift + float(step[1]),
        clock.reference_s,
        covariance,
        np.asarray(fitted[3], dtype=np.float64),
    )


def _triple(values: Array) -> str:
    return ", ".join(f"{value:.4g}" for value in values)


def _not_found(what: str) -> Fault:
    return Fault(
        "time_base_not_found",
        f"{what}, so board and arm cannot be put on one clock",
        "Check that the sensor is fixed to the flange and read in the right range, then record again",
    )
