"""Signals that end a command from outside, but first stop the arm."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from rig.data.processes.ending_signals import ENDING_SIGNALS, INTERRUPTS, MEANT_SIGNALS, OTHER_SIGNALS, signal_name

_HANGING_UP = getattr(signal, "SIGHUP", None)
_PRINTING_BEHIND = getattr(signal, "SIGTTOU", None)


def end_by_interrupt() -> None:
    """Make every signal that ends or suspends a process raise KeyboardInterrupt from now on.

    By default a closed terminal, Ctrl-\\, Ctrl-Z or another such signal ends or suspends this process while the arm
    goes on moving.
    """
    INTERRUPTS.allow()
    INTERRUPTS.send_lost_again()
    for number in MEANT_SIGNALS:
        # A script's `&` starts programs that ignore Ctrl-C, which must stop an arm all the same. A run that is to
        # outlive its terminal ignores only SIGHUP (nohup).
        if number != _HANGING_UP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _interrupt)
    for number in OTHER_SIGNALS:
        if signal.getsignal(number) == signal.SIG_DFL:  # a signal that is handled or ignored already has a use
            signal.signal(number, _interrupt)
    # A terminal that blocks output in the background (`stty tostop`) would suspend a run that prints its progress.
    if _PRINTING_BEHIND is not None and signal.getsignal(_PRINTING_BEHIND) == signal.SIG_DFL:
        signal.signal(_PRINTING_BEHIND, signal.SIG_IGN)


def ignore_endings() -> None:
    """Ignore from now on every signal that ends a process, except a kill."""
    for number in ENDING_SIGNALS:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def ending_by_interrupt() -> Iterator[None]:
    """Make signals raise KeyboardInterrupt in the block as `end_by_interrupt` does, then restore the handlers."""
    changed = ENDING_SIGNALS if _PRINTING_BEHIND is None else (*ENDING_SIGNALS, _PRINTING_BEHIND)
    before = {number: signal.getsignal(number) for number in changed}
    report = sys.unraisablehook
    end_by_interrupt()
    try:
        yield
    finally:
        sys.unraisablehook = report
        for number, handler in before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)


def _interrupt(number: int, frame: FrameType | None) -> None:
    INTERRUPTS.hear(number, frame, "" if number in MEANT_SIGNALS else f"interrupted by {signal_name(number)}")
