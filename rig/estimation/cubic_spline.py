"""Cubic splines by NumPy alone, because an import of SciPy's would take every command a quarter of a second."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.estimation.arrays import Array

NEGLIGIBLE_WEIGHT = 1e-18  # of a distant neighbour in a slope: far below the resolution of a double


class CubicSpline:
    """The not-a-knot cubic spline through values at rising abscissae (de Boor, A Practical Guide to Splines, ch. IV).

    x (n,) rises strictly, with n ≥ 2; y is (n, …). Called with abscissae of any shape, the spline returns values whose
    shape is that of the abscissae, followed by y.shape[1:]. Beyond the ends it extrapolates the outer polynomials.
    Raise ValueError for other x and y.
    """

    def __init__(self, x: Array, y: Array) -> None:
        values = np.asarray(y, dtype=np.float64)
        if len(x) < 2 or len(x) != len(values):
            raise ValueError(f"a spline through {len(x)} abscissae and {len(values)} values")
        if not (np.isfinite(x).all() and np.isfinite(values).all()):
            raise ValueError("a spline takes finite abscissae and values")
        step = np.diff(x)
        if not (step > 0).all():
            raise ValueError("the abscissae of a spline must rise strictly")
        self._x, self._shape = np.asarray(x, dtype=np.float64), values.shape[1:]
        flat = values.reshape(len(values), -1)
        steps = step[:, None]
        secants = np.diff(flat, axis=0) / steps
        slopes = _slopes(step, secants)
        cubic = (slopes[:-1] + slopes[1:] - 2 * secants) / steps
        quadratic = (secants - slopes[:-1]) / steps - cubic
        cubic /= steps
        # (n − 1, k) each, the highest power first: of the polynomial and of its derivative.
        self._coefficients = (cubic, quadratic, slopes[:-1], flat[:-1].copy()), (3 * cubic, 2 * quadratic, slopes[:-1])

    def __call__(self, x: ArrayLike, derivative: int = 0, columns: NDArray[np.intp] | None = None) -> Array:
        """Return the spline's values at `x`, or its slopes there if `derivative` is 1.

        `columns` are indices of the columns of y that are evaluated, all by default.
        """
        if derivative not in (0, 1):
            raise ValueError(f"derivative {derivative} of a spline: 0 and 1 are there")
        x = np.asarray(x, dtype=np.float64)
        flat = x.ravel()
        interval = np.searchsorted(self._x[1:-1], flat, side="right")
        offset = (flat - self._x.take(interval))[:, None]
        highest, *others = self._coefficients[derivative]
        if columns is None:
            shape, index, axis = self._shape, interval, 0
        else:  # of the flattened coefficients: to index rows and columns takes five times as long
            shape, index, axis = columns.shape, interval[:, None] * highest.shape[1] + columns, None
        value = highest.take(index, axis)
        for coefficient in others:  # Horner's scheme in place: only the access to memory takes time
            value *= offset
            value += coefficient.take(index, axis)
        values: Array = value.reshape(x.shape + shape)
        return values


def _slopes(step: Array, secants: Array) -> Array:
    """Return the spline's slopes (n, k) at n knots, from the steps (n − 1,) between knots and the secants' slopes."""
    if len(step) == 1:
        return np.repeat(secants, 2, axis=0)
    before, after = step[:-1, None], step[1:, None]
    both = before + after
    if len(step) == 2:  # a parabola
        middle = (after * secants[:1] + before * secants[1:]) / both
        return np.concatenate([2 * secants[:1] - middle, middle, 2 * secants[1:] - middle])
    # after s₋ + 2 both s + before s₊ = …; at each end the third derivative does not jump at the knot next to it.
    middle = 3 * (after * secants[:-1] + before * secants[1:])
    first = _end_condition(step[0], step[1], secants[0], secants[1])
    last = _end_condition(step[-1], step[-2], secants[-1], secants[-2])
    middle[0] -= first
    middle[-1] -= last
    diagonal, lower, upper = 2 * both, after.copy(), before.copy()
    diagonal[0], diagonal[-1] = both[0], both[-1]
    lower[0] = upper[-1] = 0.0
    inner = _solve_tridiagonal(lower / diagonal, upper / diagonal, middle / diagonal)
    begin = (first - both[0] * inner[0]) / step[1]
    end = (last - both[-1] * inner[-1]) / step[-2]
    return np.concatenate([begin[None], inner, end[None]])


def _end_condition(step: float, following: float, secant: Array, next_secant: Array) -> Array:
    """Return the right side r (k,) of the not-a-knot condition: `following` · s₀ + (`step` + `following`) · s₁ = r.

    s₀ and s₁ are the slopes of the spline at its end and at the next knot. `step` is the width of the outer interval,
    `following` that of the next one; `secant` and `next_secant` (k,) are the slopes of the secants there.
    """
    both = step + following
    end: Array = ((step + 2 * both) * following * secant + step**2 * next_secant) / both
    return end


def _solve_tridiagonal(lower: Array, upper: Array, right: Array) -> Array:
    """Return the solution s (n, k) of lower s₋ + s + upper s₊ = right, s₋ and s₊ being the rows before and after s.

    `lower` and `upper` are (n, 1). Parallel cyclic reduction (R. W. Hockney 1965): each pass eliminates the neighbours
    of a row, which then depends on rows twice as far away, with squared coefficients. The rows of a spline are
    diagonally dominant, so six passes suffice for any n.
    """
    apart = 1
    while apart < len(right) and max(np.abs(lower).max(), np.abs(upper).max()) > NEGLIGIBLE_WEIGHT:
        before, after = lower[apart:], upper[:-apart]
        size, new, new_lower, new_upper = np.ones_like(lower), right.copy(), np.zeros_like(lower), np.zeros_like(upper)
        size[apart:] -= before * upper[:-apart]
        size[:-apart] -= after * lower[apart:]
        new[apart:] -= before * right[:-apart]
        new[:-apart] -= after * right[apart:]
        new_lower[apart:] = -before * lower[:-apart]
        new_upper[:-apart] = -after * upper[apart:]
        lower, upper, right = new_lower / size, new_upper / size, new / size
        apart *= 2
    return right
