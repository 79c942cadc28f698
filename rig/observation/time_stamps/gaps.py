"""The rotation that a gap between readings can hide: the error of bridging it, from the readings on either side.

A gap between rates is bridged by the trapezoidal rule. If the body is at rest or turns evenly, a gap hides nothing; if
the body starts or oscillates, a short gap hides much. So artificial gaps of the same length are made among the readings
on either side and bridged, and the result is compared with the integral of those readings. If the rate changes over the
gap by more than on either side, the error allows for this change anywhere in the gap. All functions are pure.
"""

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array, integrate_rates

MAX_HIDDEN_RAD = 2e-3  # as large as the errors of attitude references: a gap that may hide more is not bridged
MAX_GAP_S = 1.0  # that is bridged: in a longer one a body may be lifted and laid back
STEP_STD = 12**-0.5  # standard deviation of the time of a sudden change, uniform in a gap of length 1
SIDE_LENGTHS, MIN_SIDE_READINGS = 4, 12  # examined on either side of a gap, in gap lengths


def hidden_angles_rad(time_s: Array, readings: Array, gaps: NDArray[np.intp]) -> Array:
    """Return the standard deviation (k,), rad, of the rotation interpolated over each of the steps `gaps` (k,).

    `readings` (n, 3) are rates at rising times (n,); a step has the number of its first reading. The result is infinite
    for a gap that is too long, or without enough readings next to it.
    """
    turned = integrate_rates(time_s, readings)
    return np.array([_hidden_rad(time_s, readings, turned, int(gap)) for gap in gaps])


def find_hiding_gaps(time_s: Array, readings: Array, gaps: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return those of the steps `gaps` (k,) that may hide too much rotation to be interpolated.

    `readings` (n, 3) are rates at rising times (n,); a step has the number of its first reading.
    """
    return np.asarray(gaps[hidden_angles_rad(time_s, readings, gaps) > MAX_HIDDEN_RAD], dtype=np.intp)


def _hidden_rad(time_s: Array, readings: Array, turned: Array, gap: int) -> float:
    """Return the standard deviation, rad, of the rotation over the step `gap`; see `hidden_angles_rad`."""
    lasts_s = float(time_s[gap + 1] - time_s[gap])
    if lasts_s > MAX_GAP_S:
        return np.inf
    size = SIDE_LENGTHS * lasts_s
    first = min(int(np.searchsorted(time_s, time_s[gap] - size)), gap - MIN_SIDE_READINGS)
    last = max(int(np.searchsorted(time_s, time_s[gap + 1] + size)), gap + 1 + MIN_SIDE_READINGS)
    sides = (slice(max(first, 0), gap + 1), slice(gap + 1, min(last, len(time_s))))
    bridged = [_bridge(time_s[side], readings[side], turned[side], lasts_s) for side in sides]
    errors = [side for side in bridged if side is not None]
    if not errors:
        return np.inf
    change_rad_s = float(np.linalg.norm(readings[gap + 1] - readings[gap]))
    excess_rad_s = max(change_rad_s - max(changes for _, changes in errors), 0.0)
    return float(np.hypot(max(rms for rms, _ in errors), excess_rad_s * lasts_s * STEP_STD))


def _bridge(time_s: Array, readings: Array, turned: Array, lasts_s: float) -> tuple[float, float] | None:
    """Return the RMS error of interpolating over `lasts_s`, and the largest change of the rate during that time.

    `turned` is the integral of the readings. Return None for too few readings.
    """
    end = np.searchsorted(time_s, time_s + lasts_s * (1 - 1e-9))
    start = np.flatnonzero(end < len(time_s))
    if len(start) < 2:
        return None
    end = end[start]
    span_s = (time_s[end] - time_s[start])[:, None]
    error = turned[end] - turned[start] - span_s * (readings[end] + readings[start]) / 2
    changes_rad_s = np.linalg.norm(readings[end] - readings[start], axis=1)
    return float(np.sqrt(np.mean(np.sum(error**2, axis=1)))), float(changes_rad_s.max())
