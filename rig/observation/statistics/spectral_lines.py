"""Spectral lines in readings: vibrations that exceed the noise's spectrum.

A part of a revolution is too short for a vibration to average out: 4 mrad/s at 8 Hz leave 0.1 mrad/s in a second and a
half, several times the noise of a good gyroscope.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array, median
from rig.estimation.statistics.mean_weights import invert_squares
from rig.observation.statistics.tapered_weights import MAIN_LOBE, apply_window

BINS = 161  # of the running median
MAX_COPIES = 6  # of a spectrum, mirrored, in the running median: SciPy's filter reads beyond the end of shorter ones
MAX_LINES = 8  # three of a servo, and vibrations of the room, each of which a turning sensor may sense as two
MIN_DISTANCE = 2.5  # from a spectral line found before, in cycles of all readings
MIN_LINE_CYCLES = 1.5  # closer spectral lines are one sudden motion, not two vibrations
MIN_SIDEBAND_CYCLES = 0.5  # closer sidebands of slow lines resemble the turn's own waves
PASSES = 1
LINE_COLUMNS = 4  # of the design, for a line and for each of its sidebands
SIDEBANDS = 1  # sidebands on either side that a turning sensor reads of a vibration in the room
COLUMN_SAMPLES = 3  # needed per column
MIN_GAIN = 1.02  # a sideband replaces the strongest peak if it explains this many times more
MIN_GAP_STEPS = 1.5  # after a longer interval between samples, samples are missing
ROUNDING_RATIO = 1e-12  # to the longest column: shorter ones contain only rounding errors
EMPTY: Array = np.zeros(0)


@dataclass(frozen=True, slots=True)
class LineSearch:
    """The criteria of a spectral line.

    - `stands_out`: the factor by which a line's power exceeds the median power around it, and `floor`.
    - `floor`: the median power of the readings if lines are sought in quieter data, such as encoder rates; else 0.
    - `slowest`: the least number of cycles in all readings; `sidebands`: the number of a line's sidebands (`waves`).
    - `most`: the largest number of lines, previous ones included.
    """

    stands_out: float = 16.0  # one false line in seventy recordings costs nothing
    slowest: float = 8.0  # slower lines are hard to separate from waves once and twice per revolution
    sidebands: int = SIDEBANDS
    most: int = MAX_LINES
    floor: float = 0.0


def find_lines(residuals: Array, search: LineSearch, previous: Array = EMPTY, fraction: Array | None = None) -> Array:
    """Return the numbers of cycles (k,) of the spectral lines in the residuals (n, axes); k may be zero.

    `fraction` (n,): elapsed fraction of the time at each reading, by default at even intervals. Lines are at least
    `MIN_DISTANCE` from each other; a line that merges with another is dropped. The `previous` lines, given as numbers
    of cycles, are returned first, unchanged.
    """
    count, merged, fixed = len(residuals), EMPTY, len(previous)
    cycles = previous
    most = min(search.most, count // (column_count(search.sidebands) * COLUMN_SAMPLES))
    fraction = np.arange(count) / count if fraction is None else fraction
    spacing = 1 / count / _sampling_step(fraction) if most > len(cycles) else 1.0
    while len(cycles) < most and len(merged) < most:
        columns = waves(cycles, fraction, search.sidebands)
        remainder = residuals - columns @ fit_columns(columns, residuals)
        strongest = _find_strongest(remainder, np.append(cycles, merged), fraction, spacing, search)
        if strongest is None:
            break
        refined = _refine(np.append(cycles, strongest), residuals, fixed, fraction, search.sidebands)
        if _are_too_near(refined, search):
            merged = np.append(merged, strongest)
        else:
            cycles = refined
    return cycles


def _are_too_near(cycles: Array, search: LineSearch) -> bool:
    """Return whether two spectral lines, or the slowest line and the turn's harmonics, cannot be told apart.

    The refinement may move a line below the lowest frequency of the search. It is then valid only if its sidebands do
    not overlap those of another line. Otherwise a vibration and a ripple whose frequencies differ by less than a cycle
    would together explain a part of the mean.
    """
    ordered = np.sort(cycles)
    gaps = np.diff(ordered)
    if gaps.min(initial=np.inf) < MIN_LINE_CYCLES or ordered[0] < 1.0:
        return True
    return bool(ordered[0] < search.slowest and gaps.size and gaps[0] < 2 * search.sidebands + MIN_SIDEBAND_CYCLES)


def median_power(residuals: Array) -> float:
    """Return the median power of the quietest axis of residuals (n, axes), tapered as in the search for lines."""
    return float(median(np.abs(np.fft.rfft(apply_window(residuals).T)) ** 2).min())


def column_count(sidebands: int) -> int:
    """Return the number of columns of `waves` per spectral line."""
    return LINE_COLUMNS * (1 + sidebands)


def waves(cycles: Array, fraction: Array, sidebands: int = SIDEBANDS) -> Array:
    """Return cosine and sine columns (n, w k) of k lines at elapsed fractions (n,) of the time, w = `column_count`.

    A line also has two linearly growing columns, for a vibration that begins or ends, and sidebands up to `sidebands`
    cycles above and below it. One sideband on either side is needed because a rotating sensor measures a vibration of
    the room one cycle per turn above and below the vibration's own frequency. More are needed if the speed varies
    within a turn (`rig.observation.motion.revolution.Revolution`).
    """
    line, turn = (_rotate(2 * np.pi * np.outer(number, fraction)) for number in (cycles, range(1, sidebands + 1)))
    shifted = [line * shift for once in turn for shift in (once.conj(), once)]
    columns = [part for wave in (line, line * (2 * fraction - 1), *shifted) for part in (wave.real, wave.imag)]
    return np.stack(columns, axis=1).reshape(column_count(sidebands) * len(cycles), len(fraction)).T


def _rotate(angle_rad: Array) -> NDArray[np.complex128]:
    """Return e^(i angle): from cosine and sine, because the complex exponential takes half as long again."""
    wave = np.empty(angle_rad.shape, dtype=np.complex128)
    wave.real, wave.imag = np.cos(angle_rad), np.sin(angle_rad)
    return wave


def harmonics(angle_rad: Array, most: int) -> Array:
    """Return columns (n, 2 most) of cosine and sine of the first `most` harmonics of a turn.

    They are computed as powers of the first harmonic, because products take a tenth of the time of cosines.
    """
    powers = np.cumprod(np.broadcast_to(_rotate(angle_rad), (most, len(angle_rad))), axis=0)
    columns = np.stack([powers.real, powers.imag], axis=1).reshape(2 * most, len(angle_rad))
    return np.asarray(columns.T, dtype=np.float64)


def unit_columns(columns: Array) -> Array:
    """Return columns (n, k), of any units, scaled to unit length; columns of mere rounding errors become zero.

    Otherwise rounding errors, which differ between processors, would be scaled up and look like real columns.
    """
    sizes = np.linalg.norm(columns, axis=0)
    return columns / np.where(sizes > ROUNDING_RATIO * sizes.max(initial=0.0), sizes, np.inf)


def fit_columns(columns: Array, values: Array) -> Array:
    """Return the least-squares coefficients (k, m) of values (n, m) by columns (n, k), which may be nearly collinear.

    Normal equations take a fraction of the time of a singular value decomposition, and are accurate enough, because
    nearly collinear directions are left out.
    """
    return np.asarray(invert_squares(columns.T @ columns) @ (columns.T @ values), dtype=np.float64)


def fit_residuals(columns: Array, values: Array) -> Array:
    """Return the residuals of values (n, m) after a fit of columns (n, k), which may be in different units."""
    unit = unit_columns(columns)
    residuals: Array = values - unit @ fit_columns(unit, values)
    return residuals


def find_angle_change_rad2(residuals: Array, columns: Array, lines_hz: Array) -> Array:
    """Return the mean square (3,), rad², of the body's rotation by vibration from one random moment to another.

    The vibration is k spectral lines with w columns each; the columns (n, w k) are fitted to residuals (n, 3). A line
    of mean square P and frequency f has the angle amplitude √(2 P) / (2π f), so its change has the mean square
    P / (2 π² f²).
    """
    width = columns.shape[1] // max(len(lines_hz), 1)
    sizes = fit_columns(columns, residuals).reshape(len(lines_hz), width, residuals.shape[1])
    waveforms = np.einsum("nlw,lwm->lnm", columns.reshape(len(residuals), len(lines_hz), width), sizes)
    mean_squares: Array = np.sum(np.mean(waveforms**2, axis=1) / (2 * np.pi**2 * lines_hz[:, None] ** 2), axis=0)
    return mean_squares


def running_median(powers: Array) -> Array:
    """Return the medians (axes, n) of powers (axes, n) over `BINS` around each, with the spectrum mirrored at its ends.

    A short spectrum is mirrored `MAX_COPIES` times at most.
    """
    from scipy.ndimage import median_filter

    width = min(BINS, MAX_COPIES * powers.shape[1] + 1)
    return np.array([median_filter(axis, width) for axis in powers])  # one-dimensional: it takes a tenth of the time


def _sampling_step(fraction: Array) -> float:
    """Return the interval between samples as a fraction of the whole time; samples may be missing."""
    steps = np.diff(fraction)
    return float(steps[steps < MIN_GAP_STEPS * median(steps)].mean())


def _find_strongest(
    residuals: Array, previous: Array, fraction: Array, spacing: float, search: LineSearch
) -> float | None:
    """Return the number of cycles of the strongest line in residuals (n, axes), apart from `previous`, or None.

    `spacing`: cycles from one bin of the spectrum to the next.
    """
    powers = np.abs(np.fft.rfft(apply_window(residuals).T)) ** 2
    powers[:, :MAIN_LOBE] = powers[:, MAIN_LOBE, None]
    powers /= np.maximum(running_median(powers), search.floor) + np.finfo(np.float64).tiny  # noise may have a colour
    bins, last = np.arange(powers.shape[1]), powers.shape[1] - 1
    cycles = spacing * bins
    free = (cycles >= search.slowest) & (bins < last) & (np.abs(cycles - previous[:, None]) > MIN_DISTANCE).all(axis=0)
    best = int(np.argmax(np.where(free, powers.max(axis=0), 0.0)))
    axis = int(np.argmax(powers[:, best]))
    if not (free[best] and powers[axis, best] > search.stands_out):
        return None
    below, centre, above = np.log(powers[axis, best - 1 : best + 2])
    bend = below - 2 * centre + above
    peak = best + (float(np.clip(0.5 * (below - above) / bend, -0.5, 0.5)) if bend < 0 else 0.0)
    peak *= spacing
    return _choose_middle(peak, residuals, previous, fraction, search) if search.sidebands else peak


def _choose_middle(peak: float, residuals: Array, previous: Array, fraction: Array, search: LineSearch) -> float:
    """Return the frequency, in cycles, of the line of which the `peak` is either the centre or a sideband.

    Of the possible lines, the one that explains most is chosen. A rotating sensor may sense a vibration of the room
    only across the axis of rotation, that is, in the sidebands and not in the line itself.
    """
    whitened = residuals / (residuals.std(axis=0) + np.finfo(np.float64).tiny)
    sidebands = [peak + shift for shift in (-1.0, 1.0) if search.slowest <= peak + shift]
    sidebands = [cycles for cycles in sidebands if not (np.abs(cycles - previous) <= MIN_LINE_CYCLES).any()]
    explained = []
    for cycles in (peak, *sidebands):
        columns = waves(np.array([cycles]), fraction, search.sidebands)
        explained.append(float(np.sum((columns @ fit_columns(columns, whitened)) ** 2)))
    best = int(np.argmax(explained))
    return (peak, *sidebands)[best] if explained[best] > MIN_GAIN * explained[0] else peak


def _refine(cycles: Array, residuals: Array, fixed: int, fraction: Array, sidebands: int) -> Array:
    """Return the frequencies of spectral lines, in cycles, refined from their phase drift.

    A wrong frequency shows as a component that grows in proportion to time, 90° out of phase with the line. The first
    `fixed` lines are unchanged, and so are lines of sidebands only, which have no carrier whose phase could drift.
    """
    for _ in range(PASSES):
        fitted = fit_columns(waves(cycles, fraction, sidebands), residuals)
        amplitudes = fitted.reshape(len(cycles), column_count(sidebands), -1)
        cosine, sine, cosine_growth, sine_growth = np.moveaxis(amplitudes, 1, 0)[:4]
        power = np.sum(amplitudes[:, :2] ** 2, axis=(1, 2)) + np.sum(amplitudes[:, LINE_COLUMNS:] ** 2, axis=(1, 2))
        drift = np.sum(cosine_growth * sine - sine_growth * cosine, axis=1) / (power + np.finfo(np.float64).tiny)
        cycles = cycles + np.where(np.arange(len(cycles)) < fixed, 0.0, np.clip(drift / np.pi, -0.5, 0.5))
    return cycles
