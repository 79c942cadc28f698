"""The detection of attitudes in another convention, by solving with their inverses.

Quaternions that were written as x y z w but are read as w x y z look like inverse rotations too, because that
permutation is improper. In addition they exchange the axes of body and room, so the sensor's axes show which mistake
was made.
"""

from collections.abc import Callable, Collection
from typing import Protocol, TypeVar

import numpy as np

from rig.errors import Fault, or_fault
from rig.estimation.arrays import Array
from rig.estimation.refusals import report_inverted, report_scalar_last


class HasMatrix(Protocol):
    """A solution with the matrix F (3, 3) of a sensor."""

    @property
    def matrix(self) -> Array:
        """The matrix F (3, 3) of scale factors and axes."""
        ...


Solved = TypeVar("Solved", bound=HasMatrix)


def solve_unless_inverted(attitudes: Array, solve: Callable[[Array], Solved], contradicting: Collection[str]) -> Solved:
    """Return the result of `solve` with attitudes (N, 3, 3). Raise Fault as `solve` does.

    If the Fault's name is in `contradicting` and the attitudes in another convention have a solution, raise instead
    Fault `inverted_attitudes`, whose message names the mistake: inverse quaternions, or the order of their numbers.
    """
    try:
        return solve(attitudes)
    except Fault as fault:
        if fault.name not in contradicting:
            raise
        raise _find_convention(attitudes, solve) or fault from None


def _find_convention(attitudes: Array, solve: Callable[[Array], Solved]) -> Fault | None:
    """Return the Fault that names the mistake in the attitudes, None if `solve` fails with either correction.

    The mistake is inverse quaternions, or another order of their numbers. If `solve` succeeds with both corrections,
    the one that brings the sensor's axes nearer to the body's is right.
    """
    inverted = or_fault(lambda: solve(np.swapaxes(attitudes, -1, -2)))
    reordered = or_fault(lambda: solve(_read_scalar_last(attitudes)))
    if isinstance(reordered, Fault):
        return None if isinstance(inverted, Fault) else report_inverted()
    if isinstance(inverted, Fault) or _find_alignment(reordered.matrix) > _find_alignment(inverted.matrix):
        return report_scalar_last()
    return report_inverted()


def _read_scalar_last(attitudes: Array) -> Array:
    """Return the attitudes (N, 3, 3) as if their quaternions, which were read as w x y z, had been written x y z w."""
    from scipy.spatial.transform import Rotation

    read = Rotation.from_matrix(attitudes).as_quat()[:, [3, 0, 1, 2]]
    return np.asarray(Rotation.from_quat(read).as_matrix(), dtype=np.float64)


def _find_alignment(matrix: Array) -> float:
    """Return the mean cosine between a sensor's axes, the rows of `matrix` (3, 3), and the body's axes x, y, z."""
    return float(np.mean(np.diag(matrix) / np.linalg.norm(matrix, axis=1)))
