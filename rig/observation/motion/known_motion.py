"""What turned the sensors, as far as observations are made by it: an arm's states, or a table's own file."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation.arrays import Array

MIN_RATE_RAD_S = 0.01  # slower all the time, nothing has turned
MAX_SPAN_S = 48 * 3600.0  # of a recording; what lies farther apart is damage, and would fill the memory


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


def closely_followed(looks_s: Array, close: NDArray[np.bool_], time_s: Array) -> NDArray[np.bool_]:
    """Which of the times (n,) lie between two of the looks (m,) that are `close` (m − 1,)."""
    interval = np.searchsorted(looks_s, time_s, side="right") - 1
    inside = (interval >= 0) & (interval < len(close))
    known: NDArray[np.bool_] = inside & close[np.clip(interval, 0, len(close) - 1)]
    return known


def check_span(time_s: Array, what: str) -> None:
    """Times (n,) that rise are refused where they reach too far. Raises Fault `impossible_times`."""
    span_s = time_s[-1] - time_s[0]
    if span_s > MAX_SPAN_S:
        raise Fault(
            "impossible_times",
            f"{what} in the recording reach over {span_s / 3600:.3g} h",
            "Do not use this recording, which is damaged; make a new one",
        )


def not_finite(what: str) -> Fault:
    """The error for a recording that holds what is no number."""
    return Fault("not_finite", f"{what} in the recording is not a number", "Do not use this recording; make a new one")
