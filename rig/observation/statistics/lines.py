"""Vibrations found in readings: lines that stand out of the noise's spectrum, whether the encoders see them or not.

A part of a revolution is too short for a vibration to average out in it: 4 mrad/s at 8 Hz leave 0.1 mrad/s in a second
and a half, several times what the noise of a good gyroscope does.
"""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.statistics.mean_weights import ALIKE
from rig.observation.statistics.tapered_weights import MAIN_LOBE, shaped

AROUND = 161  # bins, of which the median is taken
MOST_LINES = 8  # three of a servo, and what shakes in the room, which a turning sensor may feel as two
APART = 2.5  # cycles in all the readings, from a line that was found
SAME = 1.5  # cycles in all the readings: lines that come so near each other are no lines, but a jerk
PASSES = 1
WIDE = 4  # columns of a line, and of each of its beats
BEATS = 1  # as a sensor that makes a turn feels what shakes in the room
SAMPLES_EACH = 5  # are needed to find what one column has in them
NEARER = 1.02  # times as much must a line explain whose beat stands out, to be taken for that
LEAST_GAP = 1.5  # steps between samples, of which some are missing then
ROUNDING = 1e-12  # of the longest column: shorter ones hold what arithmetic leaves
NONE: Array = np.zeros(0)


@dataclass(frozen=True, slots=True)
class LineSearch:
    """What counts as a line.

    It stands `stands_out` times over the median power around it, and over `floor`, a power of the same window, where
    what is looked at has less noise than what it is compared with. It makes `slowest` cycles at least in all the
    readings, and has `beats`: see `waves`. At most so many are found, those known before among them.
    """

    stands_out: float = 16.0  # one line in seventy that is none costs nothing
    slowest: float = 8.0  # what is slower is told badly from what comes once and twice in a turn
    beats: int = BEATS
    most: int = MOST_LINES
    floor: float = 0.0


def find_lines(residuals: Array, search: LineSearch, known_cycles: Array = NONE, share: Array | None = None) -> Array:
    """Return (k,) how many cycles each line makes in all of the residuals (n, axes); k may be zero.

    share (n,): which share of the time was over at each reading; evenly spaced if it is not given, and nearly so, but
    for gaps, if it is. None is looked for nearer to another than `APART`, and one that comes to be another is none. The
    known lines are among them, as they are.
    """
    count, merged, held = len(residuals), NONE, len(known_cycles)
    cycles = known_cycles
    most = min(search.most, count // (wide(search.beats) * SAMPLES_EACH))
    share = np.arange(count) / count if share is None else share
    while len(cycles) < most and len(merged) < most:
        columns = waves(cycles, share, search.beats)
        left = residuals - columns @ fitted(columns, residuals)
        strongest = _strongest(left, np.append(cycles, merged), share, search)
        if strongest is None:
            break
        refined = _refined(np.append(cycles, strongest), residuals, held, share, search.beats)
        if np.diff(np.sort(refined)).min(initial=np.inf) < SAME or refined.min() < 1.0:
            merged = np.append(merged, strongest)
        else:
            cycles = refined
    return cycles


def median_power(residuals: Array) -> float:
    """Return the median power of residuals (n, axes) under the window of the search, of the quietest axis."""
    return float(np.median(np.abs(np.fft.rfft(shaped(residuals).T)) ** 2, axis=1).min())


def wide(beats: int) -> int:
    """How many columns of `waves` one line has."""
    return WIDE * (1 + beats)


def waves(cycles: Array, share: Array, beats: int = BEATS) -> Array:
    """(n, w k) cosine and sine of k lines where a share (n,) of the time is over, w columns of each: see `wide`.

    Beside each stand both growing steadily, for a line that comes or goes, and both of one cycle more and one less:
    what shakes in the room is felt so by a sensor that makes a turn. Or of up to so many more and less as the line
    `beats` in a turn: see `rig.observation.motion.revolution.Revolution`.
    """
    line, turn = (np.exp(2j * np.pi * np.outer(cycles_each, share)) for cycles_each in (cycles, range(1, beats + 1)))
    beside = [line * way for once in turn for way in (once.conj(), once)]
    each = [part for wave in (line, line * (2 * share - 1), *beside) for part in (wave.real, wave.imag)]
    return np.stack(each, axis=1).reshape(wide(beats) * len(cycles), len(share)).T


def turning(turned_rad: Array, most: int) -> Array:
    """(n, 2 most) cosine and sine of what comes once, twice, up to `most` times in a turn, at its angles (n,)."""
    each = [wave(times * turned_rad) for times in range(1, most + 1) for wave in (np.cos, np.sin)]
    return np.reshape(each, (2 * most, len(turned_rad))).T


def unit_columns(columns: Array) -> Array:
    """Return columns (n, k), of whatever units, with a length of one each; those that are rounding alone are zero.

    Scaled up, rounding would make columns of noise that differ from one processor to another.
    """
    sizes = np.linalg.norm(columns, axis=0)
    return columns / np.where(sizes > ROUNDING * sizes.max(initial=0.0), sizes, np.inf)


def fitted(columns: Array, values: Array) -> Array:
    """(k, m) least squares of values (n, m) by such columns (n, k), some of which may be nearly alike.

    By the normal equations, in which what `ALIKE` leaves is told apart well enough: of many values they take a third
    of the time.
    """
    return np.asarray(np.linalg.lstsq(columns.T @ columns, columns.T @ values, rcond=ALIKE**2)[0], dtype=np.float64)


def swings(residuals: Array, columns: Array, lines_hz: Array) -> Array:
    """(3,) mean square, over (rad/s)² s², by which the angle of all lines differs between two moments.

    The lines are those of columns (n, w k) in residuals (n, 3): one of the mean square P and the frequency f swings by
    √(2 P) / (2π f) either way, and so its angle differs between two moments by P / (2 π² f²) in the mean square.
    """
    own = columns.shape[1] // max(len(lines_hz), 1)
    sizes = fitted(columns, residuals).reshape(len(lines_hz), own, residuals.shape[1])
    each = np.einsum("nlw,lwm->lnm", columns.reshape(len(residuals), len(lines_hz), own), sizes)
    found: Array = np.sum(np.mean(each**2, axis=1) / (2 * np.pi**2 * lines_hz[:, None] ** 2), axis=0)
    return found


def _step(share: Array) -> float:
    """The share of the time between samples that follow each other, some of which may be missing."""
    steps = np.diff(share)
    return float(steps[steps < LEAST_GAP * np.median(steps)].mean())


def _strongest(left: Array, known: Array, share: Array, search: LineSearch) -> float | None:
    """Cycles of the line in readings (n, axes) that stands out most; None where there is none beside those known."""
    from scipy.ndimage import median_filter

    powers = np.abs(np.fft.rfft(shaped(left).T)) ** 2
    powers[:, :MAIN_LOBE] = powers[:, MAIN_LOBE, None]
    around = np.array([median_filter(axis, AROUND) for axis in powers])  # in one dimension it takes a tenth
    powers /= np.maximum(around, search.floor) + np.finfo(np.float64).tiny  # noise may have a colour
    bins, last = np.arange(powers.shape[1]), powers.shape[1] - 1
    cycles = bins / len(share) / _step(share)
    free = (cycles >= search.slowest) & (bins < last) & (np.abs(cycles - known[:, None]) > APART).all(axis=0)
    best = int(np.argmax(np.where(free, powers.max(axis=0), 0.0)))
    axis = int(np.argmax(powers[:, best]))
    if not (free[best] and powers[axis, best] > search.stands_out):
        return None
    below, here, above = np.log(powers[axis, best - 1 : best + 2])
    bend = below - 2 * here + above
    peak = best + (float(np.clip(0.5 * (below - above) / bend, -0.5, 0.5)) if bend < 0 else 0.0)
    peak *= float(cycles[1])
    return _middle(peak, left, known, share, search) if search.beats else peak


def _middle(peak: float, left: Array, known: Array, share: Array, search: LineSearch) -> float:
    """Return the line of which a peak is the middle or a beat: that which explains most of what is left (n, axes).

    What shakes in the room a sensor may feel across the axis alone, beside the line and not at it.
    """
    whitened = left / (left.std(axis=0) + np.finfo(np.float64).tiny)
    beside = [peak + way for way in (-1.0, 1.0) if search.slowest <= peak + way]
    beside = [each for each in beside if not (np.abs(each - known) <= SAME).any()]
    explained = []
    for each in (peak, *beside):
        columns = waves(np.array([each]), share, search.beats)
        explained.append(float(np.sum((columns @ fitted(columns, whitened)) ** 2)))
    best = int(np.argmax(explained))
    return (peak, *beside)[best] if explained[best] > NEARER * explained[0] else peak


def _refined(cycles: Array, residuals: Array, held: int, share: Array, beats: int) -> Array:
    """Lines refined by what grows of each a quarter of a cycle behind it: its phase. The first so many are held.

    A line of which the beats alone are felt has no phase, and stays where it is.
    """
    for _ in range(PASSES):
        sizes = fitted(waves(cycles, share, beats), residuals).reshape(len(cycles), wide(beats), -1)
        cosine, sine, cosine_grown, sine_grown = np.moveaxis(sizes, 1, 0)[:4]
        power = np.sum(sizes[:, :2] ** 2, axis=(1, 2)) + np.sum(sizes[:, WIDE:] ** 2, axis=(1, 2))
        late = np.sum(cosine_grown * sine - sine_grown * cosine, axis=1) / (power + np.finfo(np.float64).tiny)
        cycles = cycles + np.where(np.arange(len(cycles)) < held, 0.0, np.clip(late / np.pi, -0.5, 0.5))
    return cycles
