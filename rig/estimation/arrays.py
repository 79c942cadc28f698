"""The array type of numeric code, and small functions of arrays."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
MIN_SIZE = 1e-200  # a smaller uncertainty counts as zero: division by it would overflow
BISECTION_STEPS = 30
MAD_TO_STD = 1.4826  # standard deviation over median absolute deviation, of normal errors


def scale_of(matrix: Array) -> Array:
    """Return the scale factors (3,) of a sensor that reads `matrix` · input: 1 over the length of each row."""
    scale: Array = 1 / np.linalg.norm(matrix, axis=1)
    return scale


def perpendicular_unit_vectors(axis: Array) -> Array:
    """Return two unit vectors (2, 3) at right angles to a unit vector (3,) and to each other."""
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first = first / np.linalg.norm(first)
    return np.array([first, np.cross(axis, first)])


def rotation_vectors(matrices: Array) -> Array:
    """Return the rotation vectors (…, 3) in rad of rotations (…, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(matrices).as_rotvec(), dtype=np.float64)


def axis_of(name: str) -> Array:
    """Return the unit vector (3,) of an axis or face by its name, such as "+x" or "-z"."""
    return np.asarray((1.0 if name[0] == "+" else -1.0) * np.eye(3)["xyz".index(name[1])], dtype=np.float64)


def integrate_rates(time_s: Array, rates: Array) -> Array:
    """Return the integral (n, c) of rates (n, c) from the first of times (n,), by the trapezoidal rule."""
    steps = (rates[1:] + rates[:-1]) / 2 * np.diff(time_s)[:, None]
    return np.concatenate([np.zeros((1, rates.shape[1])), np.cumsum(steps, axis=0)])


def median(values: NDArray[Any], axis: int = -1) -> Array:
    """Return the median of finite values along an axis; NaN if the axis has no values.

    NumPy's median takes three times as long, mostly to look for NaN.
    """
    middle, is_odd = divmod(values.shape[axis], 2)
    if not values.shape[axis]:
        return np.full(np.delete(values.shape, axis), np.nan)
    if is_odd:
        return np.asarray(np.partition(values, middle, axis).take(middle, axis), dtype=np.float64)
    ordered = np.partition(values, (middle - 1, middle), axis)
    return np.asarray((ordered.take(middle - 1, axis) + ordered.take(middle, axis)) / 2, dtype=np.float64)


def distinct(values: NDArray[Any]) -> NDArray[Any]:
    """Return the distinct values of an array of any shape, in rising order."""
    ordered = np.sort(values, axis=None)
    return ordered[np.append(True, ordered[1:] != ordered[:-1])[: len(ordered)]]


def median_step(rising: Array) -> float:
    """Return the median difference between adjacent values of a rising series (n,)."""
    return float(median(np.diff(rising)))


def interpolate(instants: Array | NDArray[np.intp], points: Array | NDArray[np.intp], values: Array) -> Array:
    """Return the values (m, c) at `instants` (m,), interpolated linearly between values (n, c) at `points` (n,)."""
    return np.column_stack([np.interp(instants, points, column) for column in values.T])


def unwrap_counter(values: Array, period: float) -> Array:
    """Return the values (n,) of a counter as if it did not restart at each `period`; NaN remains NaN."""
    present = ~np.isnan(values)
    falls = np.diff(values[present], prepend=values[present][:1]) < -period / 2
    unwrapped = values.copy()
    unwrapped[present] += period * np.cumsum(falls)
    return unwrapped


def divide_or_infinity(values: ArrayLike, sizes: ArrayLike) -> Array:
    """Return values divided by sizes ≥ 0 of the same shape; infinite for a nonzero value over a negligible size."""
    value, size = np.asarray(values, dtype=np.float64), np.asarray(sizes, dtype=np.float64)
    none = np.where(value == 0, 0.0, np.copysign(np.inf, value))
    ratio: Array = np.divide(value, size, out=none, where=size > MIN_SIZE)
    return ratio


def equal_runs(values: NDArray[Any]) -> NDArray[np.intp]:
    """Return the first index and the end (k, 2) of each run of equal values (n,); the end is exclusive."""
    return runs_between(values[1:] != values[:-1], len(values))


def runs_between(changes: NDArray[np.bool_], count: int) -> NDArray[np.intp]:
    """Return the first index and the end (k, 2) of each of the k runs that divide a series of `count` values.

    `changes` (count − 1,) is true at i if a new run begins at value i + 1; the ends are exclusive.
    """
    bounds = np.concatenate([[0], np.flatnonzero(changes) + 1, [count]])
    return np.column_stack([bounds[:-1], bounds[1:]])[:count]


def bisect(is_too_small: Callable[[Array], Array | NDArray[np.bool_]], highest: Array) -> Array:
    """Return by bisection the smallest values (q,), between 0 and `highest` (q,), that are not too small.

    `is_too_small` takes q values and returns for each whether it is too small.
    """
    low, high = np.zeros_like(highest), highest
    for _ in range(BISECTION_STEPS):
        middle = (low + high) / 2
        small = is_too_small(middle)
        low, high = np.where(small, middle, low), np.where(small, high, middle)
    return high
