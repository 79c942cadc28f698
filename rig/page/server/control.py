"""What a browser may ask of a run: to stop it, and, where the operator is asked on the page, to agree.

A stop interrupts the thread that runs the procedure, as Ctrl-C does: what stops the arm and keeps the data then
is the same code.
"""

import _thread
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

from rig.data.processes.ending_signals import INTERRUPTS, signal_name

STOPPED = "stopped from the page"
STOP_SIGNAL = getattr(signal, "SIGUSR1", signal.SIGINT)  # its own: SIGINT may be ignored, as in a script's background


class Control:
    """What the page may do to a run, between the server's thread and the run's, which is the main one."""

    def __init__(self, *, may_answer: bool) -> None:
        self._may_answer = may_answer
        self._changed = threading.Condition()
        self._stop: Callable[[], None] | None = None
        self._stopping = False
        self._asked = 0
        self._answer: bool | None = None
        self._waiting = False
        self._gone = False

    @contextmanager
    def stoppable(self) -> Iterator[None]:
        """A block of the main thread's in which `stop` ends in a KeyboardInterrupt."""

        def stopped(number: int, frame: FrameType | None) -> None:
            INTERRUPTS.hear(number, frame, STOPPED if self._stopping else f"interrupted by {signal_name(number)}")

        INTERRUPTS.allow()
        before = signal.signal(STOP_SIGNAL, stopped)
        try:
            with self._changed:
                self._stop = _interrupt_the_main_thread
            yield
        finally:
            with self._changed:
                self._stop = None
            signal.signal(STOP_SIGNAL, before)

    def stop(self) -> bool:
        """End the run; False when there is none that could be."""
        with self._changed:
            if self._stop is None:
                return False
            self._stopping = True
            self._stop()
            return True

    def ask(self, announcement: Sequence[str], to_do: str) -> bool | None:
        """Wait for the operator's answer from a browser; None when no page is left that could bring one.

        The page shows the question as it shows all that happens.
        """
        with self._changed:
            self._asked += 1
            self._answer, self._waiting = None, True
            try:
                while self._answer is None and not self._gone:
                    self._changed.wait(1.0)
                return self._answer
            finally:
                self._waiting = False

    def answer(self, number: int, *, agreed: bool) -> bool:
        """The answer to question `number` from 1; False when that is not the one that is asked."""
        with self._changed:
            if not (self._may_answer and self._waiting) or number != self._asked or self._answer is not None:
                return False
            self._answer = agreed
            self._changed.notify_all()
            return True

    @property
    def gone(self) -> bool:
        """Whether no browser can ask for anything any more."""
        return self._gone

    def leave(self) -> None:
        """No browser can ask for anything any more."""
        with self._changed:
            self._gone = True
            self._changed.notify_all()


def _interrupt_the_main_thread() -> None:
    """Interrupt the main thread out of whatever it waits for, where the system can do that."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, STOP_SIGNAL)
    else:
        _thread.interrupt_main(STOP_SIGNAL)
