"""What turned the sensors, as far as their clock is found by it: an arm's states, or a table's own file."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array


class KnownMotion(Protocol):
    """A body's turning as a function of the time of whoever turned it, in axes fixed to the body.

    Which way the sensors sit on the body is not asked: the clock is found whatever their mounting.
    """

    @property
    def time_s(self) -> Array:
        """(m,) rising: when it was looked at."""
        ...

    def rate(self, time_s: Array, derivative: int = 0, /) -> Array:
        """(n, 3) rad/s at times (n,) between the first and the last of `time_s`; with `derivative` 1 its change."""
        ...

    def covered(self, time_s: Array) -> NDArray[np.bool_]:
        """(n,) where looks follow each other closely enough for `rate` to be true."""
        ...
