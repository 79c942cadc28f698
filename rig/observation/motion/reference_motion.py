"""The turner's motion that observations need: from an arm's states, or from a table's file."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation.arrays import Array

MIN_RATE_RAD_S = 0.01  # a turner that is never faster did not move
MAX_SPAN_S = 48 * 3600.0  # longest recording: times farther apart are damage, and would fill the memory


class RateFunction(Protocol):
    """A function of times (n,): rates (n, 3), rad/s, or their derivative if `derivative` is 1."""

    def __call__(self, time_s: Array, derivative: int = 0, /) -> Array:
        """Return the rates (n, 3) at the times (n,), or their derivative if `derivative` is 1."""
        ...


class KnownMotion(Protocol):
    """A body's rotation in axes fixed to the body, as a function of time on the clock of the machine that turns it.

    The axes need not be those of the sensors, because the fit of the clock also fits the sensors' mounting.
    """

    @property
    def time_s(self) -> Array:
        """The rising times (m,) of the recorded states."""
        ...

    @property
    def rate(self) -> RateFunction:
        """The function that returns the rates at times within `time_s`."""
        ...

    def covered(self, time_s: Array) -> NDArray[np.bool_]:
        """Return a mask of the times (n,) between states that are close enough together for `rate` to be valid."""
        ...


def closely_followed(states_s: Array, close: NDArray[np.bool_], time_s: Array) -> NDArray[np.bool_]:
    """Return a mask of the times (n,) in those intervals between successive states (m,) that `close` (m − 1,) marks."""
    interval = np.searchsorted(states_s, time_s, side="right") - 1
    inside = (interval >= 0) & (interval < len(close))
    covered: NDArray[np.bool_] = inside & close[np.clip(interval, 0, len(close) - 1)]
    return covered


def check_span(time_s: Array, what: str) -> None:
    """Raise Fault `impossible_times` if rising times (n,) span too long a time; the message calls them `what`."""
    span_s = time_s[-1] - time_s[0]
    if span_s > MAX_SPAN_S:
        raise Fault(
            "impossible_times",
            f"{what} in the recording span {span_s / 3600:.3g} h",
            "Do not use this recording, which is damaged; make a new one",
        )


def not_finite(what: str) -> Fault:
    """Return the error for a recording with a value that is not a finite number."""
    return Fault("not_finite", f"{what} in the recording is not a number", "Do not use this recording; make a new one")
