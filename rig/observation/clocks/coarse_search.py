"""The first estimate of a board's clock, by correlation of turn rate and joint rate over all data.

The board may have been switched on at any time, and its oscillator may be some per cent off.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array, median_step
from rig.observation.clocks.time_base import TimeBase, time_base_not_found
from rig.observation.motion.reference_motion import KnownMotion

COARSE_STEP_S = 0.02  # far shorter than the ramps of a sweep, so that the fine fit converges
COARSE_REACH_S = 0.15  # largest clock error at either end of the data from which the fine fit converges
SUBDIVISIONS = np.array([-0.5, -0.25, 0.25, 0.5])  # of the first search's spacing, for the second
CANDIDATE_PEAKS = 12  # peaks of the correlation that are tried: six equal sweeps make eleven
MIN_EXPLAINED = 0.5  # fraction of the readings' variance that the arm's motion must explain
MAX_DRIFT = 0.03  # an oscillator without a crystal is within 2 %
MAX_DRIFT_LONG_RUN = 1e-3  # one with a crystal is within 600 ppm
MAX_DRIFT_STEPS = 20  # steps to either side


def find_coarse_clock(board_time_s: Array, readings: Array, motion: KnownMotion) -> TimeBase:
    """Return the clock with which the arm's motion explains most of the readings, to start the fine fit."""
    reference, half_s = (board_time_s[0] + board_time_s[-1]) / 2, (board_time_s[-1] - board_time_s[0]) / 2
    spacing = 2 * COARSE_REACH_S / half_s
    count = round(max(min(MAX_DRIFT, MAX_DRIFT_STEPS * spacing), MAX_DRIFT_LONG_RUN) / spacing)
    arm = _ArmRates.sample(motion)

    def search(drifts: Array) -> tuple[_Match, float]:
        matches = [_coarse_offset((board_time_s - reference) * (1 + drift), readings, arm) for drift in drifts]
        return max(zip(matches, drifts.tolist(), strict=True))

    coarse = search(spacing * np.arange(-count, count + 1))
    match, drift = max(coarse, search(coarse[1] + spacing * SUBDIVISIONS))
    if match.fraction < MIN_EXPLAINED:
        raise time_base_not_found(f"the arm's motion explains {100 * match.fraction:.0f} % of what the gyroscope reads")
    return TimeBase(float(match.offset_s - reference), drift, float(reference), np.zeros((2, 2)), np.zeros(3))


def estimate_coarse_offset(board_time_s: Array, readings_rad_s: Array, motion: KnownMotion) -> tuple[float, float]:
    """Return the explained fraction of the variance of readings (n, 3), and the clock's offset without drift, s."""
    reference_s = float(board_time_s[0] + board_time_s[-1]) / 2
    match = _coarse_offset(board_time_s - reference_s, readings_rad_s, _ArmRates.sample(motion))
    return match.fraction, match.offset_s - reference_s


@dataclass(frozen=True, slots=True)
class _ArmRates:
    """The arm's rates on an even grid of times, as functions of the grid's step.

    The last result of each function is stored, because nearly all drifts need the same step.

    - at_step: takes a step; returns the start of the motion, s, and its rate (3, n) at every step from then on, with
      the mean subtracted.
    - spectrum: takes a step and a size; returns the Fourier transform of that rate, extended by zeros to the size.
    """

    at_step: Callable[[float], tuple[float, Array]]
    spectrum: Callable[[float, int], NDArray[np.complex128]]

    @classmethod
    def sample(cls, motion: KnownMotion) -> "_ArmRates":
        """Return the rates of a motion."""
        at_step = lru_cache(maxsize=1)(partial(_sample_rate, motion))
        return cls(at_step, lru_cache(maxsize=1)(lambda step_s, size: np.fft.rfft(at_step(step_s)[1], size)))


def _sample_rate(motion: KnownMotion, step_s: float) -> tuple[float, Array]:
    """Return the start of the motion, s, and its rate (3, n) every `step_s` from then on, with the mean subtracted."""
    grid = np.arange(motion.time_s[0], motion.time_s[-1], step_s)
    rate = motion.rate(grid).T
    return float(grid[0]), rate - rate.mean(axis=1, keepdims=True)


@dataclass(frozen=True, slots=True, order=True)
class _Match:
    """A candidate for the offset (controller − board); of two matches, the one that compares as larger is better.

    - `share`: the fraction of the sum of squares of all readings that the arm's motion explains. It is lower for a
      wrong offset that matches each sweep with the next one, because one sweep then has no match.
    - `fraction`: defined like `share`, but only for the readings taken while the arm's motion was recorded. `enough`:
      whether `fraction` is at least `MIN_EXPLAINED`.
    """

    enough: bool
    share: float
    fraction: float
    offset_s: float


def _coarse_offset(time_s: Array, readings: Array, arm: _ArmRates) -> _Match:
    """Return the best offset from `time_s` (n,) to the controller's clock, to within a bin.

    Readings are averaged in bins of equal duration, which is longer than the samples' interval. Every axis of the board
    is cross-correlated with every axis of the arm, because the norm of the readings would contain the bias. Of the
    offsets at the highest peaks, the one with the best linear fit of the vectors is returned.
    """
    step_s = max(COARSE_STEP_S, 1.1 * median_step(time_s))
    bins = ((time_s - time_s[0]) / step_s).astype(np.intp)
    counts = np.bincount(bins)
    filled = counts > 0
    board = np.array([np.bincount(bins, readings[:, axis]) for axis in range(3)]) / np.maximum(counts, 1)
    turning = np.where(filled, board - board[:, filled].mean(axis=1, keepdims=True), 0.0)
    start_s, moving = arm.at_step(step_s)

    count = len(filled) + moving.shape[1]
    size = _fast_length(count)
    spectra = np.conj(np.fft.rfft(turning, size)), arm.spectrum(step_s, size)
    squares = sum(np.fft.irfft(one * other, size) ** 2 for one in spectra[0] for other in spectra[1])
    correlation = np.roll(squares, len(filled))[:count]
    peaks = np.flatnonzero((correlation[1:-1] > correlation[:-2]) & (correlation[1:-1] >= correlation[2:])) + 1
    best = peaks[np.argsort(correlation[peaks])[::-1][:CANDIDATE_PEAKS]] - len(filled)

    shares, fractions = _compute_explained_shares(turning, filled, moving, best)
    # Bin j of the board, whose middle lies half a step after its start, corresponds to point j + lag of the arm's grid.
    offsets_s = float(start_s - time_s[0] - step_s / 2) + best * step_s
    return max(
        map(_Match, (fractions >= MIN_EXPLAINED).tolist(), shares.tolist(), fractions.tolist(), offsets_s.tolist()),
        default=_Match(enough=False, share=0.0, fraction=0.0, offset_s=0.0),
    )


def _fast_length(least: int) -> int:
    """Return the first number from `least` on without prime factors above 5: a fast length for a Fourier transform."""
    threes = (3**power for power in range(least.bit_length()))
    odd = (three * 5**power for three in threes for power in range(least.bit_length()) if three * 5**power < 2 * least)
    length: int = min(number << (-(-least // number) - 1).bit_length() for number in odd)
    return length


def _compute_explained_shares(
    turning: Array, filled: NDArray[np.bool_], moving: Array, lags: NDArray[np.intp]
) -> tuple[Array, Array]:
    """Return `share` (k,) and `fraction` (k,) of a `_Match` at each of `lags`, in bins; 0 if too few bins overlap.

    The arm's rate (3, m) explains the board's rate (3, n) by a linear map, over the bins that are `filled` (n,). The
    normal equations are precise enough, because the best lag is only the start of the fine fit.
    """
    board, products = np.vstack([filled, turning]), np.empty((len(lags), 7, 7))
    for product, lag in zip(products, lags, strict=True):
        start, end = max(0, -lag), min(len(filled), moving.shape[1] - lag)
        both = np.empty((7, end - start))
        both[:4] = board[:, start:end]
        np.multiply(moving[:, start + lag : end + lag], filled[start:end], out=both[4:])
        product[:] = both.copy() @ both.T  # the product of a matrix with itself would take twice as long
    count, sums = products[:, :1, :1], products[:, :1, 1:]
    scatter = products[:, 1:, 1:] - np.swapaxes(sums, 1, 2) @ sums / np.maximum(count, 1)
    together, total = scatter[:, 3:, :3], np.trace(scatter[:, :3, :3], axis1=1, axis2=2)
    inverse = np.linalg.pinv(scatter[:, 3:, 3:], rcond=1e-10, hermitian=True)
    enough = (count[:, 0, 0] >= 0.5 * min(len(filled), moving.shape[1])) & (total > 0)
    explained = np.sum(together * (inverse @ together), axis=(1, 2))
    everything = np.maximum(np.sum(turning**2), total)
    return explained / np.where(enough, everything, np.inf), explained / np.where(enough, total, np.inf)
