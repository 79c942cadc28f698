"""The mean over a rest in which the arm vibrates, with weights that rise and fall smoothly at either end.

In a plain mean over the time T, a vibration leaves a remainder: the change of the body's angle from start to end,
divided by T. 2 mrad/s at 14 Hz leave 0.7 deg/h RMS in ten seconds, thrice the noise of a KVH 1775. With raised-cosine
flanks of length L (Tukey's window), weights reduce the remainder at the frequency f by the factor 4 (f L)² − 1: 200 for
half a second. White noise averages out a little worse: with n weights w that add up to 1, the variance of the mean
grows by the factor n Σ w², that is, by 4 % in ten seconds and by 10 % in the shortest rests.
"""

from functools import lru_cache

import numpy as np

from rig.estimation.arrays import Array, median
from rig.observation.statistics.coloured_noise import fit_noise_factor

FLANK_S = 0.5
MAX_FLANK_FRACTION = 0.125  # of the window
MAX_NOISE_RATIO = 0.5  # of the scatter that remains in a long mean, below which the rest is a vibration
BLACKMAN_HARRIS = (0.35875, -0.48829, 0.14128, -0.01168)  # Harris 1978, table 1: side lobes below −92 dB
MAIN_LOBE = 4  # bins to either side
NOISE_BINS = 2.0  # bins per independent power: the window's equivalent noise bandwidth, table 1
LOW_FRACTION = 0.1  # of the data rate, below which the noise is that at zero, apart from the arm's vibrations
MIN_BINS = 16


def vibrates(readings: Array) -> bool:
    """Return whether, on any axis, most of the scatter of readings (n, 3) at rest is due to a vibration."""
    return len(readings) > 2 * _count_low_bins(len(readings)) and any(
        fit_noise_factor(axis) < MAX_NOISE_RATIO for axis in readings.T
    )


def flank_s(duration_s: float) -> float:
    """Return the duration of a rising or falling flank of the weights."""
    return min(FLANK_S, MAX_FLANK_FRACTION * duration_s)


def weights(time_s: Array, start_s: float, end_s: float) -> Array:
    """Return weights (n,) that add up to 1, of readings at times (n,) between start and end."""
    inside = np.clip(np.minimum(time_s - start_s, end_s - time_s) / flank_s(end_s - start_s), 0.0, 1.0)
    window = np.sin(np.pi / 2 * inside) ** 2
    normalized: Array = window / np.sum(window)
    return normalized


def noise_at_zero(readings: Array, low: float = LOW_FRACTION) -> Array:
    """Return the variance (3,) of a long mean times its number of readings: the spectrum near zero without its lines.

    The spectrum is estimated from the median power over low frequencies, because spectral lines hardly change a median.
    ln 2 converts it to the mean power (χ² with two degrees of freedom). Low frequencies reach up to the fraction `low`
    of the data rate, in at least `MIN_BINS` bins.
    """
    powers = np.abs(np.fft.rfft(apply_window(readings), axis=0)[MAIN_LOBE : _count_low_bins(len(readings), low)]) ** 2
    medians: Array = median(powers, axis=0) / np.log(2)
    return medians


def apply_window(readings: Array) -> Array:
    """Return readings (n, 3) minus their mean, times Blackman and Harris' window, whose squares add up to 1."""
    windowed: Array = _window(len(readings))[:, None] * (readings - readings.mean(axis=0))
    return windowed


@lru_cache(maxsize=4)  # the searches for line after line use equally many readings
def _window(count: int) -> Array:
    """Return Blackman and Harris' window (n,), whose squares add up to 1."""
    phase = 2 * np.pi * (np.arange(count) + 0.5) / count
    window = np.cos(np.outer(phase, np.arange(len(BLACKMAN_HARRIS)))) @ np.array(BLACKMAN_HARRIS)
    normalized: Array = window / np.sqrt(np.sum(window**2))
    return normalized


def dof_at_zero(count: int) -> float:
    """Return the degrees of freedom of `noise_at_zero`, a median of m independent powers, from `count` readings.

    The median's relative variance is 1 / (m ln² 2), and the degrees of freedom are 2 divided by this variance (JCGM
    100, G.4.2).
    """
    return float(2 * np.log(2) ** 2 * (_count_low_bins(count) - MAIN_LOBE) / NOISE_BINS)


def _count_low_bins(count: int, low: float = LOW_FRACTION) -> int:
    """Return the number of frequency bins that count as low."""
    return max(round(low * count), MAIN_LOBE + MIN_BINS)
