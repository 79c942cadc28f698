"""Attitudes that a program interpolated between those that a reference reported.

Robots report a few attitudes per second. To align them with a sensor's samples, programs often interpolate the four
numbers of the quaternion linearly, over time or from row to row. An interpolated row adds no information, because its
error is that of the reports around it. Between q and −q, which are one attitude, the interpolation passes through zero.
"""

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array

JUDGED_FRACTION, MIN_INTERPOLATED_FRACTION = 0.25, 0.4  # fastest rows, and the fraction of them that is interpolated
MAX_BEND_RATIO = 0.1  # distance from the chord, relative to that of a unit quaternion
ROUNDING = 2e-6  # distance from the chord of a number with six decimals
MIN_SHORT_RATIO = 10.0  # lack of length of an interpolated row, relative to that of the slowest rows
MAX_LENGTH_ERROR, MIN_CHORD = 1e-3, 1e-3
MIN_ROWS = 20


def find_interpolated(time_s: Array, quaternions: Array) -> NDArray[np.bool_]:
    """Return a mask (n,) of the quaternions (n, 4) interpolated between others; all False for a measured motion.

    Unit quaternions lie on a sphere, and an interpolated row lies on a chord inside it. So it lies on the chord between
    its neighbours, or is too short for a unit quaternion. Chords are longest in the fastest motion, so the fastest rows
    decide whether the file contains interpolated rows. If it does, all rows with either property are marked.
    """
    interpolated = np.zeros(len(quaternions), dtype=np.bool_)
    if len(quaternions) < MIN_ROWS:
        return interpolated
    distances, bends = _measure_chords(time_s, quaternions)
    lengths = np.linalg.norm(quaternions[2:] - quaternions[:-2], axis=1)
    slow, fast = np.quantile(lengths, [JUDGED_FRACTION, 1 - JUDGED_FRACTION])
    lacks = 1 - np.linalg.norm(quaternions, axis=1)
    usual = max(float(np.quantile(np.abs(lacks[1:-1][lengths <= slow]), 1 - JUDGED_FRACTION)), ROUNDING)
    is_straight, is_short = distances <= MAX_BEND_RATIO * bends, lacks[1:-1] > MIN_SHORT_RATIO * usual
    judged = np.array([is_straight.any(axis=0), is_short])[:, lengths >= fast]
    if fast > MIN_CHORD and judged.mean(axis=1).max() >= MIN_INTERPOLATED_FRACTION:
        lies_on = (distances <= np.maximum(MAX_BEND_RATIO * bends, ROUNDING)).any(axis=0)
        interpolated[1:-1] = lies_on & (lengths > ROUNDING)
        interpolated |= lacks > MAX_LENGTH_ERROR
    return interpolated


def _measure_chords(time_s: Array, quaternions: Array) -> tuple[Array, Array]:
    """Return the distances (2, n − 2) of rows from the chord between their neighbours, and those of unit quaternions.

    In both arrays, row 0 is for an interpolation from row to row, which reaches the middle of the chord, and row 1 for
    an interpolation over time. A distance is that from the point on the chord that the interpolation gives. At the
    fraction w of a chord of length d, a unit quaternion has the distance w (1 − w) d² / 2.
    """
    before, rows, after = quaternions[:-2], quaternions[1:-1], quaternions[2:]
    steps_s = np.diff(time_s)
    spans_s = steps_s[:-1] + steps_s[1:]
    halves = np.full_like(spans_s, 0.5)
    fractions = np.array([halves, np.divide(steps_s[:-1], spans_s, out=halves.copy(), where=spans_s > 0)])
    points = before + fractions[..., None] * (after - before)
    bends = np.abs(fractions * (1 - fractions)) * ((after - before) ** 2).sum(axis=1) / 2
    return np.asarray(np.linalg.norm(rows - points, axis=-1)), np.asarray(bends)
