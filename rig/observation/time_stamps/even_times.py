"""The times at which readings were taken, from coarse time stamps or arrival times."""

import numpy as np

from rig.estimation.arrays import Array
from rig.observation.time_stamps.moving_values import average_around, find_least_around
from rig.observation.time_stamps.sampling import Sampling

AVERAGED_READINGS = 32  # whose time stamps err in either direction


def find_sampling_times(time_s: Array, sampling: Sampling) -> Array:
    """Return the strictly rising times (n,) at which readings were taken; good, distinct stamps are unchanged.

    Arrival times are never early, so the least late ones determine the times. Coarse stamps err in both directions, so
    moving averages of them determine the times. A latency that all readings share remains.
    """
    if sampling.late is not None:
        return _separate(time_s)
    if not sampling.on_arrival and sampling.width == 1 and (np.diff(time_s) > 0).all():
        return time_s
    numbers = sampling.interval_s * sampling.numbers
    late_s = time_s - numbers
    width = 2 * sampling.width
    if sampling.on_arrival:
        # Moving averages of a moving maximum: the least lateness, without steps.
        smooth_s = average_around(find_least_around(late_s, width), width)
    else:
        smooth_s = average_around(late_s, max(width, AVERAGED_READINGS))
    return _separate(np.asarray(numbers + smooth_s, dtype=np.float64))


def _separate(time_s: Array) -> Array:
    """Return strictly increasing times (n,); equal or decreasing ones are spread evenly up to the next later time."""
    latest_s = np.maximum.accumulate(time_s)
    new = np.concatenate([[True], np.diff(latest_s) > 0])
    if new.all():
        return time_s
    starts = np.flatnonzero(new)
    index = np.arange(len(time_s))
    end_s = (
        latest_s[-1] + max(float(np.median(np.diff(latest_s[starts]))), np.finfo(np.float64).tiny)
        if len(starts) > 1
        else latest_s[-1] + 1.0
    )
    apart = np.diff(np.append(starts, len(time_s)))
    typical_s = (end_s - latest_s[0]) / len(time_s)
    span_s = np.minimum(np.diff(np.append(latest_s[starts], end_s)), typical_s * apart)
    group = np.cumsum(new) - 1
    return np.asarray(latest_s + (index - starts[group]) * (span_s / apart)[group], dtype=np.float64)
