"""The clock of a servo's driver: for time-outs, pauses, and the time of each position."""

import threading
import time
from collections.abc import Callable
from typing import Protocol


class Clock(Protocol):
    """A monotonic clock, and waits measured by that clock; a simulated servo may have its own."""

    def now_s(self) -> float:
        """Return the time by which time-outs are measured, s."""

    def reference_s(self) -> float:
        """Return the time with which states are stamped, s."""

    def wait(self, event: threading.Event, timeout_s: float) -> bool:
        """Wait for an event. Return whether the event occurred in time."""

    def wait_for(self, changed: threading.Condition, done: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until `done()` is true; return its last value.

        `done` is called at each notification of `changed`, which the caller has locked.
        """


class HostClock:
    """The host's clock. If the host has a raw monotonic clock, which is never slewed, states are stamped by that clock.

    The servo's clock (Realtime Tick) is unsuitable, because it counts milliseconds of an oscillator with 1 % tolerance.
    """

    def now_s(self) -> float:
        """Return `time.monotonic`, s."""
        return time.monotonic()

    def reference_s(self) -> float:
        """Return the raw monotonic time, s."""
        raw = getattr(time, "CLOCK_MONOTONIC_RAW", None)
        return time.monotonic() if raw is None else time.clock_gettime(raw)

    def wait(self, event: threading.Event, timeout_s: float) -> bool:
        """Wait for an event on the host's clock. Return whether the event occurred in time."""
        return event.wait(timeout_s)

    def wait_for(self, changed: threading.Condition, done: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until `done` is true, on the host's clock; return its last value."""
        return changed.wait_for(done, timeout_s)


HOST = HostClock()
