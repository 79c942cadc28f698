"""The time that a servo's driver goes by: its time-outs, its pauses, and when a position was measured."""

import threading
import time
from collections.abc import Callable
from typing import Protocol


class Clock(Protocol):
    """A clock that never goes back, and what waits by it; whoever simulates the servo may bring another."""

    def now_s(self) -> float:
        """Return the time that time-outs are measured by, s."""

    def reference_s(self) -> float:
        """Return the time that states are stamped with, s."""

    def wait(self, event: threading.Event, timeout_s: float) -> bool:
        """Wait for an event; return whether it came in time."""

    def wait_for(self, changed: threading.Condition, done: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until `done`, looking whenever `changed` (which is held) is notified; return what it said last."""


class HostClock:
    """The host's. States have one that nobody slews or sets, on a system that has such a one.

    The servo's own (Realtime Tick) is none: it counts milliseconds, by an oscillator that may be a per cent out.
    """

    def now_s(self) -> float:
        """Return `time.monotonic`, s."""
        return time.monotonic()

    def reference_s(self) -> float:
        """Return the raw monotonic time, s."""
        raw = getattr(time, "CLOCK_MONOTONIC_RAW", None)
        return time.monotonic() if raw is None else time.clock_gettime(raw)

    def wait(self, event: threading.Event, timeout_s: float) -> bool:
        """Wait for an event, as of `Clock`."""
        return event.wait(timeout_s)

    def wait_for(self, changed: threading.Condition, done: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until `done`, as of `Clock`."""
        return changed.wait_for(done, timeout_s)


HOST = HostClock()
