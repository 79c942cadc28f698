"""A browser's requests to a run: to stop and, if the page asks the operator, to agree.

A stop interrupts the procedure's thread like Ctrl-C, so the same code stops the arm and keeps the data.
"""

import _thread
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

from rig.data.processes.ending_signals import INTERRUPTS, signal_name

STOP_REASON = "stopped from the page"
STOP_SIGNAL = getattr(signal, "SIGUSR1", signal.SIGINT)  # SIGINT may be ignored in background jobs


class Control:
    """The page's control of a run, between the server's thread and the run's, which is the main thread."""

    def __init__(self, *, may_answer: bool) -> None:
        self._may_answer = may_answer
        self._changed = threading.Condition()
        self._stop: Callable[[], None] | None = None
        self._stopping = False
        self._question = 0
        self._answer: bool | None = None
        self._waiting = False
        self._gone = False

    @contextmanager
    def stoppable(self) -> Iterator[None]:
        """Make `stop` raise KeyboardInterrupt in this block of the main thread."""

        def interrupt(number: int, frame: FrameType | None) -> None:
            INTERRUPTS.hear(number, frame, STOP_REASON if self._stopping else f"interrupted by {signal_name(number)}")

        INTERRUPTS.allow()
        before = signal.signal(STOP_SIGNAL, interrupt)
        try:
            with self._changed:
                self._stop = _interrupt_the_main_thread
            yield
        finally:
            with self._changed:
                self._stop = None
            signal.signal(STOP_SIGNAL, before)

    def stop(self) -> bool:
        """End the run; return False if no run can be ended."""
        with self._changed:
            if self._stop is None:
                return False
            self._stopping = True
            self._stop()
            return True

    def ask(self, announcement: Sequence[str], to_do: str) -> bool | None:
        """Return the operator's answer, from a browser, whether to do `to_do`; None if no page is left to answer.

        The page shows the question, with the `announcement` before it, as it shows every event.
        """
        with self._changed:
            self._question += 1
            self._answer, self._waiting = None, True
            try:
                while self._answer is None and not self._gone:
                    self._changed.wait(1.0)
                return self._answer
            finally:
                self._waiting = False

    def answer(self, number: int, *, agreed: bool) -> bool:
        """Answer question `number`, from 1; return False if no question or a different one is open."""
        with self._changed:
            if not (self._may_answer and self._waiting) or number != self._question or self._answer is not None:
                return False
            self._answer = agreed
            self._changed.notify_all()
            return True

    @property
    def gone(self) -> bool:
        """Whether browsers can no longer send requests."""
        return self._gone

    def leave(self) -> None:
        """Record that browsers can no longer send requests."""
        with self._changed:
            self._gone = True
            self._changed.notify_all()


def _interrupt_the_main_thread() -> None:
    """Interrupt the main thread, if possible even while it waits."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, STOP_SIGNAL)
    else:
        _thread.interrupt_main(STOP_SIGNAL)
