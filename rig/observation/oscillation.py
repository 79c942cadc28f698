"""The oscillation of an arm at rest about its mean position, by the angles of its joints."""

import numpy as np

from rig.estimation.arrays import Array

MAX_TRAVEL_AT_REST_RAD = 1e-3  # largest travel of a joint that does not move
# Cycles in a window. A slower oscillation cannot be distinguished from a joint that creeps; 0.75 cycles leave half of a
# creep.
MIN_CYCLES, MAX_CYCLES, CYCLE_STEP = 0.75, 12.0, 0.05
MIN_OSCILLATION_ANGLES = 8  # fewest angles; the oscillation itself takes three parameters for each joint


def remove_oscillation(q_rad: Array) -> Array:
    """Return angles (n, k) of joints, evenly spaced in time, without the strongest sine about their means.

    All joints oscillate at one frequency, each with its own amplitude and phase. Least squares over a grid of
    frequencies determine these (Lomb's periodogram with a floating mean). Steps and creep are preserved.
    """
    time = np.arange(len(q_rad)) / len(q_rad)
    fastest = min(MAX_CYCLES, len(q_rad) / 4)
    residuals = [_fit_residuals(cycles, time, q_rad) for cycles in np.arange(MIN_CYCLES, fastest, CYCLE_STEP)]
    return min(residuals, key=lambda residual: float(np.sum(residual**2)), default=q_rad)


def _fit_residuals(cycles: float, time: Array, q_rad: Array) -> Array:
    phase = 2 * np.pi * cycles * time
    columns = np.column_stack([np.ones(len(time)), np.cos(phase), np.sin(phase)])
    residuals: Array = q_rad - columns @ np.linalg.lstsq(columns, q_rad, rcond=None)[0]
    return residuals
