"""The detection of inverted attitudes, by solving with their inverses."""

from collections.abc import Callable, Collection
from typing import TypeVar

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.refusals import report_inverted

Solved = TypeVar("Solved")


def solve_unless_inverted(attitudes: Array, solve: Callable[[Array], Solved], contradicting: Collection[str]) -> Solved:
    """Return the result of `solve` with attitudes (N, 3, 3).

    Raise its Faults, but `inverted_attitudes` instead of the names in `contradicting` if the inverse attitudes fit.
    """
    try:
        return solve(attitudes)
    except Fault as fault:
        if fault.name not in contradicting:
            raise
        try:
            solve(np.swapaxes(attitudes, -1, -2))
        except Fault:
            raise fault from None
        raise report_inverted() from None
