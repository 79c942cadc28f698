"""The signals that end or suspend a program from outside, and their conversion to an interrupt."""

import _thread
import signal
import sys
import threading
import time
from types import FrameType
from typing import Final

# Not among them: SIGKILL and SIGSTOP, which no program can handle; SIGSEGV, SIGABRT and the like, which mean that the
# program has crashed; SIGPIPE and SIGXFSZ, which Python ignores; SIGTTIN, which waits for a terminal.
_BY_KEYS_AND_SYSTEM = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP")  # Windows has the first two
_BY_PROGRAMS = (
    *("SIGUSR1", "SIGUSR2", "SIGALRM", "SIGVTALRM", "SIGPROF", "SIGIO", "SIGPWR", "SIGSTKFLT", "SIGXCPU"),
    *("SIGEMT", "SIGLOST"),
)


def _numbers(names: tuple[str, ...]) -> tuple[int, ...]:
    return tuple(int(getattr(signal, name)) for name in names if hasattr(signal, name))


def _real_time_signals() -> tuple[int, ...]:
    if not hasattr(signal, "SIGRTMIN"):
        return ()
    return tuple(range(signal.SIGRTMIN, signal.SIGRTMAX + 1))


MEANT_SIGNALS: Final = _numbers(_BY_KEYS_AND_SYSTEM)  # which mean that the program should end or be suspended
OTHER_SIGNALS: Final = _numbers(_BY_PROGRAMS) + _real_time_signals()  # which mean anything, and end it by default
ENDING_SIGNALS: Final = (*MEANT_SIGNALS, *OTHER_SIGNALS)


BURST_S = 1.0  # a stop takes less time: further signals within it request the same stop
REPEAT_S = 0.001
# Methods of the locks of `threading`, which are written in Python.
_LOCK_METHODS = ("__enter__", "__exit__", "_acquire_restore", "_release_save")


class Interrupts:
    """The signal handler that raises KeyboardInterrupt in the main thread, except while that thread takes a lock.

    An exception while `threading` takes or releases a lock would leave it taken, and stopping the arm needs the same
    locks. After the exception, an interrupted wait takes its lock again, so a second exception must not follow soon.
    """

    def __init__(self) -> None:
        self._raised: int | None = None  # the signal that raised the last exception
        self._report = sys.unraisablehook  # of other exceptions that Python cannot raise
        self.allow()

    def allow(self) -> None:
        """Permit the next signal to raise an exception, however soon after the last signal."""
        self._raised_s = float("-inf")
        self._first_s: float | None = None  # arrival of the signal that waits for a lock

    def send_lost_again(self) -> None:
        """Begin to resend signals: each whose exception Python has dropped, as in a destructor or in a callback."""
        if sys.unraisablehook != self._resend:
            self._report, sys.unraisablehook = sys.unraisablehook, self._resend

    def _resend(self, dropped: "sys.UnraisableHookArgs") -> None:
        """Handle an exception that Python has dropped: send its signal again, or report another exception."""
        if self._raised is None or not isinstance(dropped.exc_value, KeyboardInterrupt):
            self._report(dropped)
            return
        self.allow()
        _thread.start_new_thread(_send_later, (_thread.get_ident(), self._raised))

    def hear(self, number: int, frame: FrameType | None, text: str = "") -> None:
        """Raise an exception for a signal, except within a burst of signals.

        While a thread takes a lock, the exception is delayed, at most by the duration of a burst.
        """
        now_s = time.monotonic()
        if now_s - self._raised_s < BURST_S:
            return
        if _takes_a_lock(frame):
            self._first_s = now_s if self._first_s is None else self._first_s
            if now_s - self._first_s < BURST_S:
                _thread.start_new_thread(_send_later, (_thread.get_ident(), number))
                return
        self._raised_s, self._first_s, self._raised = now_s, None, number
        raise KeyboardInterrupt(*filter(None, [text]))


def _takes_a_lock(frame: FrameType | None) -> bool:
    """Return whether a frame, or one of its callers, is acquiring or releasing a lock."""
    while frame is not None:
        if frame.f_code.co_filename == threading.__file__ and frame.f_code.co_name in _LOCK_METHODS:
            return True
        frame = frame.f_back
    return False


def _send_later(thread: int, number: int) -> None:
    """Send a thread a signal after a moment, without the module `threading`, whose locks may be in use."""
    time.sleep(REPEAT_S)
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(thread, number)
    else:  # Windows
        signal.raise_signal(number)


INTERRUPTS: Final = Interrupts()


def signal_name(number: int) -> str:
    """Return the name of a signal: `SIGUSR1`; `signal 40` if it has none."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
