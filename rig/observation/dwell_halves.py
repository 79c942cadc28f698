"""How much the means of a dwell's halves differ, which noise alone may tell apart. Pure."""

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from rig.estimation.mean_weights import even_groups, mean_weights
from rig.estimation.rounding import Steps
from rig.observation.beside_lines import BRIEF, noise_of
from rig.observation.lines import LineSearch, find_lines, fitted, waves
from rig.observation.mean import mean_at_rest
from rig.observation.raw_dwells import RawDwell
from rig.observation.windows import Window

SLOW_LINES = LineSearch(stands_out=30.0, slowest=2.5, beats=0)
TAPERED = 8.0  # cycles in a dwell: of faster lines nothing is left in the tapered mean of a half


def compare_halves(dwell: RawDwell, steps: Steps) -> tuple[Array, Array]:
    """Return the mean of a dwell's second half less that of its first, and its variance by noise, (3,) each, in counts.

    The counts come in `steps`. Of a slow vibration, which a mean of half a dwell keeps, nothing is left in either.
    """
    window, middle_s = dwell.window, dwell.middle_s
    halves = Window(window.start_s, middle_s), Window(middle_s, window.end_s)
    early = dwell.time_s < middle_s
    share = (dwell.time_s - window.start_s) / (window.end_s - window.start_s)
    readings = dwell.counts.astype(np.float64)
    cycles = find_lines(readings - readings.mean(axis=0), SLOW_LINES, share=share)
    if (cycles < TAPERED).any():
        return _beside_lines(waves(cycles, share, SLOW_LINES.beats), readings, early, steps)
    first, last = (
        mean_at_rest(readings[inside], dwell.time_s[inside], half, steps)[0]
        for half, inside in zip(halves, (early, ~early), strict=True)
    )
    return last.mean - first.mean, first.variance + last.variance


def _beside_lines(lines: Array, readings: Array, early: NDArray[np.bool_], steps: Steps) -> tuple[Array, Array]:
    """Return what `compare_halves` does of readings (n, 3) in which slow `lines` (n, k) swing."""
    halves = even_groups(np.where(early, 0, 1), 2)
    first, last = mean_weights(halves, lines)
    columns = np.column_stack([halves, lines])
    noise = noise_of(readings - columns @ fitted(columns, readings), columns.shape[1], steps, BRIEF)
    difference = (last - first) @ readings
    return difference, noise.in_a_mean * float(np.sum((last - first) ** 2))
