"""The mean of a rest in which the arm vibrates: weights that come and go smoothly at either end.

A plain mean over T keeps of a vibration by how much its angle differs between both ends, over T: 2 mrad/s at 14 Hz
leave 0.7 deg/h RMS in ten seconds, three times what the noise of a KVH 1775 does. Weights with raised-cosine flanks of
length L (Tukey's window) divide that by 4 (f L)² − 1, two hundred with half a second. White noise they average a little
worse, by n Σ w² where Σ w = 1: 4 % in variance in ten seconds, 10 % in the shortest rests.
"""

from functools import lru_cache

import numpy as np

from rig.estimation.arrays import Array
from rig.observation.statistics.coloured_noise import noise_left

FLANK_S = 0.5
FLANK_SHARE = 0.125  # of the window, at most
PREVAILS = 0.5  # of the residuals' variance, what is left in a long mean where the rest of them is a vibration
BLACKMAN_HARRIS = (0.35875, -0.48829, 0.14128, -0.01168)  # Harris 1978, table 1: side lobes below −92 dB
MAIN_LOBE = 4  # bins to either side
NOISE_BINS = 2.0  # that neighbouring bins have in common: the window's equivalent noise bandwidth, table 1
LOW = 0.1  # of the data rate: frequencies at which the noise is as at zero, but for where the arm vibrates
FEWEST_BINS = 16


def vibrates(readings: Array) -> bool:
    """Whether most of what readings (n, 3) at rest scatter by is a vibration, on any axis."""
    return len(readings) > 2 * _highest(len(readings)) and any(noise_left(axis) < PREVAILS for axis in readings.T)


def flank_s(duration_s: float) -> float:
    """How long the weights take to come, and to go."""
    return min(FLANK_S, FLANK_SHARE * duration_s)


def weights(time_s: Array, start_s: float, end_s: float) -> Array:
    """(n,) weights that add up to 1, of readings at times (n,) between start and end."""
    inside = np.clip(np.minimum(time_s - start_s, end_s - time_s) / flank_s(end_s - start_s), 0.0, 1.0)
    window = np.sin(np.pi / 2 * inside) ** 2
    shares: Array = window / np.sum(window)
    return shares


def noise_at_zero(readings: Array, low: float = LOW) -> Array:
    """(3,) the variance per reading (n, 3) that counts in a long mean: the spectrum near zero, without its lines.

    The median over low frequencies, which lines do not move, over that of χ² of two degrees of freedom. They are so,
    up to a share `low` of the data rate, but for the fewest that tell it.
    """
    powers = np.abs(np.fft.rfft(shaped(readings), axis=0)[MAIN_LOBE : _highest(len(readings), low)]) ** 2
    found: Array = np.median(powers, axis=0) / np.log(2)
    return found


def shaped(readings: Array) -> Array:
    """Readings (n, 3) less their mean under Blackman and Harris' window, of which the squares add up to 1."""
    under: Array = _window(len(readings))[:, None] * (readings - readings.mean(axis=0))
    return under


@lru_cache(maxsize=4)  # line after line is looked for in equally many readings
def _window(count: int) -> Array:
    """(n,) Blackman and Harris' window, of which the squares add up to 1."""
    phase = 2 * np.pi * (np.arange(count) + 0.5) / count
    window = np.cos(np.outer(phase, np.arange(len(BLACKMAN_HARRIS)))) @ np.array(BLACKMAN_HARRIS)
    shares: Array = window / np.sqrt(np.sum(window**2))
    return shares


def freedom_at_zero(count: int) -> float:
    """Degrees of freedom of `noise_at_zero` by so many readings: those of the median of m independent powers.

    Its relative variance is 1 / (m ln² 2), and ν is two over that (JCGM 100, G.4.2).
    """
    return float(2 * np.log(2) ** 2 * (_highest(count) - MAIN_LOBE) / NOISE_BINS)


def _highest(count: int, low: float = LOW) -> int:
    """The bin at which low frequencies end."""
    return max(round(low * count), MAIN_LOBE + FEWEST_BINS)
