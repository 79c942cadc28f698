"""Vibrations found in readings: lines that stand out of the noise's spectrum, whether the encoders see them or not.

A part of a revolution is too short for a vibration to average out in it: 4 mrad/s at 8 Hz leave 0.1 mrad/s in a second
and a half, several times what the noise of a good gyroscope does.
"""

import numpy as np

from rig.estimation.arrays import Array
from rig.observation.tapered_weights import MAIN_LOBE, shaped

STANDS_OUT = 30.0  # over the median power: of noise one bin in 10⁹ does
AROUND = 161  # bins, of which the median is taken
MOST_LINES = 8  # three of a servo, and what shakes in the room, which a turning sensor may feel as two
SLOWEST = 8  # cycles in all the readings: what is slower is told badly from what the parts differ by
APART = 2.5  # cycles in all the readings, from a line that was found
SAME = 1.5  # cycles in all the readings: lines that come so near each other are no lines, but a jerk
PASSES = 2
WIDE = 4  # columns of a line, and of each of its beats
BEATS = 1  # as a sensor that makes a turn feels what shakes in the room
SAMPLES_EACH = 5  # are needed to find what one column has in them
NONE: Array = np.zeros(0)
ALIKE = 1e-2  # columns that differ by less are one


def lines(
    residuals: Array,
    stands_out: float = STANDS_OUT,
    known_cycles: Array = NONE,
    beats: int = BEATS,
    apart_cycles: float = APART,
) -> Array:
    """(k,) how many cycles each line makes in all of the residuals (n, 3); k may be zero.

    A line `stands_out` so far over the median power around it, each with its `beats`: see `waves`. None is looked for
    nearer to another than `apart_cycles`, and one that comes to be another is none. Those that are known are among
    them, as they are.
    """
    count, merged, held = len(residuals), NONE, len(known_cycles)
    cycles = known_cycles
    most = min(MOST_LINES, count // (wide(beats) * SAMPLES_EACH))
    share = np.arange(count) / count
    while len(cycles) < most and len(merged) < most:
        found = waves(cycles, share, beats)
        beside = np.append(cycles, merged)
        strongest = _strongest(residuals - found @ fitted(found, residuals), beside, stands_out, apart_cycles)
        if strongest is None:
            break
        refined = _refined(np.append(cycles, strongest), residuals, held, beats)
        if np.diff(np.sort(refined)).min(initial=np.inf) < SAME:
            merged = np.append(merged, strongest)
        else:
            cycles = refined
    return cycles


def in_hertz(cycles: Array, time_s: Array) -> Array:
    """(k,) frequencies of lines that make so many cycles (k,) in readings at times (n,), evenly spaced."""
    hertz: Array = cycles * (len(time_s) - 1) / len(time_s) / (time_s[-1] - time_s[0])
    return hertz


def wide(beats: int) -> int:
    """How many columns of `waves` one line has."""
    return WIDE * (1 + beats)


def waves(cycles: Array, share: Array, beats: int = BEATS) -> Array:
    """(n, w k) cosine and sine of k lines where a share (n,) of the time is over, w columns of each: see `wide`.

    Beside each stand both growing steadily, for a line that comes or goes, and both of one cycle more and one less:
    what shakes in the room is felt so by a sensor that makes a turn. Or of up to so many more and less as the line
    `beats` in a turn: see `rig.observation.revolution.Revolution`.
    """
    line, turn = (np.exp(2j * np.pi * np.outer(cycles_each, share)) for cycles_each in (cycles, range(1, beats + 1)))
    beside = [line * way for once in turn for way in (once.conj(), once)]
    each = [part for wave in (line, line * (2 * share - 1), *beside) for part in (wave.real, wave.imag)]
    return np.stack(each, axis=1).reshape(wide(beats) * len(cycles), len(share)).T


def turning(turned_rad: Array, most: int) -> Array:
    """(n, 2 most) cosine and sine of what comes once, twice, up to `most` times in a turn, at its angles (n,)."""
    each = [wave(times * turned_rad) for times in range(1, most + 1) for wave in (np.cos, np.sin)]
    return np.reshape(each, (2 * most, len(turned_rad))).T


def fitted(columns: Array, values: Array) -> Array:
    """(k, m) least squares of values (n, m) by such columns (n, k), some of which may be nearly alike.

    By the normal equations, in which what `ALIKE` leaves is told apart well enough: of many values they take a third
    of the time.
    """
    return np.asarray(np.linalg.lstsq(columns.T @ columns, columns.T @ values, rcond=ALIKE**2)[0], dtype=np.float64)


def swings(residuals: Array, columns: Array, lines_hz: Array) -> Array:
    """(3,) mean square, over (rad/s)² s², by which the angle of all lines differs between two moments.

    The lines are those of columns (n, 8 k) in residuals (n, 3): one of the mean square P and the frequency f swings by
    √(2 P) / (2π f) either way, and so its angle differs between two moments by P / (2 π² f²) in the mean square.
    """
    sizes = fitted(columns, residuals).reshape(len(lines_hz), wide(BEATS), residuals.shape[1])
    each = np.einsum("nlw,lwm->lnm", columns.reshape(len(residuals), len(lines_hz), wide(BEATS)), sizes)
    found: Array = np.sum(np.mean(each**2, axis=1) / (2 * np.pi**2 * lines_hz[:, None] ** 2), axis=0)
    return found


def _strongest(left: Array, known: Array, stands_out: float, apart_cycles: float) -> float | None:
    """Cycles of the line in readings (n, 3) that stands out most; None where there is none beside those known."""
    from scipy.ndimage import median_filter

    powers = np.abs(np.fft.rfft(shaped(left).T)) ** 2
    powers[:, :MAIN_LOBE] = powers[:, MAIN_LOBE, None]
    around = np.array([median_filter(axis, AROUND) for axis in powers])  # in one dimension it takes a tenth
    powers /= around + np.finfo(np.float64).tiny  # noise may have a colour
    bins = np.arange(powers.shape[1])
    free = (bins >= SLOWEST) & (bins < len(bins) - 1) & (np.abs(bins - known[:, None]) > apart_cycles).all(axis=0)
    best = int(np.argmax(np.where(free, powers.max(axis=0), 0.0)))
    axis = int(np.argmax(powers[:, best]))
    if not (free[best] and powers[axis, best] > stands_out):
        return None
    below, here, above = np.log(powers[axis, best - 1 : best + 2])
    bend = below - 2 * here + above
    return best + (float(np.clip(0.5 * (below - above) / bend, -0.5, 0.5)) if bend < 0 else 0.0)


def _refined(cycles: Array, residuals: Array, held: int, beats: int) -> Array:
    """Lines refined by what grows of each a quarter of a cycle behind it: its phase. The first so many are held."""
    share = np.arange(len(residuals)) / len(residuals)
    for _ in range(PASSES):
        sizes = fitted(waves(cycles, share, beats), residuals).reshape(len(cycles), wide(beats), -1)
        cosine, sine, cosine_grown, sine_grown = np.moveaxis(sizes, 1, 0)[:4]
        late = np.sum(cosine_grown * sine - sine_grown * cosine, axis=1) / np.sum(cosine**2 + sine**2, axis=1)
        cycles = cycles + np.where(np.arange(len(cycles)) < held, 0.0, np.clip(late / np.pi, -0.5, 0.5))
    return cycles
