"""The minimum, or the mean, of the values around each value of a series."""

import numpy as np

from rig.estimation.arrays import Array


def find_least_around(values: Array, width: int) -> Array:
    """Return for each of n values the larger of two minima: of `width` values from it on, and of `width` up to it.

    At the ends, where one of the minima is missing, the other is returned.
    """
    ahead, behind = find_least_ahead(values, width), find_least_behind(values, width)
    least = np.maximum(ahead, behind)
    least[:width], least[-width:] = ahead[:width], behind[-width:]
    return least


def find_least_ahead(values: Array, width: int) -> Array:
    """Return the minima (n,) of `width` values that begin with each value."""
    least, covered = values.copy(), 1
    while covered < min(width, len(values)):
        more = min(covered, width - covered)
        least[:-more] = np.minimum(least[:-more], least[more:])
        covered += more
    return least


def find_least_behind(values: Array, width: int) -> Array:
    """Return the minima (n,) of `width` values that end with each value."""
    return find_least_ahead(values[::-1], width)[::-1]


def average_around(values: Array, width: int) -> Array:
    """Return the moving average (n,) of the values, over fewer values at either end."""
    total = np.concatenate([[0.0], np.cumsum(values - values[0])])
    index = np.arange(len(values))
    first, last = np.maximum(index - width // 2, 0), np.minimum(index + width - width // 2, len(values))
    return np.asarray(values[0] + (total[last] - total[first]) / (last - first), dtype=np.float64)
