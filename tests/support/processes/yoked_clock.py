"""A clock shared by two processes, which stops while either of them gets no processor."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from support.processes.forked import find_fork_server

STEP_S = 0.002  # of wall time that counts between two looks of who drives the clock
LEAD_S = 0.002  # its largest lead over the time that the driver has read
LOOK_S = 0.0005
NOW, READ, DRIVEN, FREE, LIMIT = range(5)


class YokedClock:
    """The time of a simulated servo and of its driver (a `Clock` of the driver's).

    The simulation advances it by wall time, and waits for the driver's thread that uses the line: while either is
    delayed, time stands still for both. `name`: that of the thread.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._cells = find_fork_server().RawArray("d", 5)
        self._wall_s = 0.0
        self.begin()

    def begin(self) -> None:
        """Start again, without a driver."""
        self._cells[:] = [100.0, 100.0, 0.0, 0.0, float("inf")]

    # The simulation's ---------------------------------------------------------------------------------------------
    def move_on(self) -> None:
        """Let time pass, as far as permitted."""
        now_s, cells = time.monotonic(), self._cells
        passed_s, self._wall_s = min(now_s - self._wall_s, STEP_S), now_s
        yoked = cells[DRIVEN] and not cells[FREE]
        most_s = min(cells[LIMIT], cells[READ] + LEAD_S) if yoked else cells[LIMIT]
        cells[NOW] = max(cells[NOW], min(cells[NOW] + passed_s, most_s))

    def time_s(self) -> float:
        """Return the time, without letting more pass."""
        return float(self._cells[NOW])

    # The driver's -------------------------------------------------------------------------------------------------
    def now_s(self) -> float:
        """Return the time; it may then continue, if the caller is the thread with the line or there is none yet."""
        now_s = float(self._cells[NOW])
        threads = {thread.name for thread in threading.enumerate()}
        if threading.current_thread().name == self._name or self._name not in threads:
            self._cells[READ], self._cells[DRIVEN] = now_s, 1.0
        return now_s

    reference_s = now_s

    def wait(self, event: threading.Event, timeout_s: float) -> bool:
        """Wait for an event."""
        ends_s = self.now_s() + timeout_s
        while not event.wait(LOOK_S) and self.now_s() < ends_s:
            pass
        return event.is_set()

    def wait_for(self, changed: threading.Condition, done: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until `done`."""
        ends_s = self.now_s() + timeout_s
        while not changed.wait_for(done, LOOK_S) and self.now_s() < ends_s:
            pass
        return done()

    # A test's -----------------------------------------------------------------------------------------------------
    @contextmanager
    def without_the_driver(self) -> Iterator[None]:
        """Let time pass in the block although the driver, delayed or dead, reads no clock."""
        self._cells[FREE] = 1.0
        try:
            yield
        finally:
            self._cells[READ], self._cells[FREE] = self._cells[NOW], 0.0

    def go_on_until(self, time_s: float) -> None:
        """Let time pass until `time_s` without the driver, then stop."""
        self._cells[LIMIT] = time_s
        with self.without_the_driver():
            while self._cells[NOW] < time_s:
                time.sleep(LOOK_S)
