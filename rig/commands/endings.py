"""Every way to end a command from outside, made to stop the arm first."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from rig.data.processes.ending_signals import ENDING_SIGNALS, INTERRUPTS, MEANT_SIGNALS, OTHER_SIGNALS, signal_name

_HANGING_UP = getattr(signal, "SIGHUP", None)
_PRINTING_BEHIND = getattr(signal, "SIGTTOU", None)


def end_by_interrupt() -> None:
    """Let every ending signal raise KeyboardInterrupt from now on.

    Left alone, a closed terminal, Ctrl-\\, Ctrl-Z or any other of them would end or suspend this process while the arm
    goes on moving.
    """
    INTERRUPTS.allow()
    for number in MEANT_SIGNALS:
        # A script's `&` starts programs that ignore Ctrl-C: an arm must stop by it all the same. That a run is to
        # outlive its terminal is said by ignoring SIGHUP alone (nohup).
        if number != _HANGING_UP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _interrupt)
    for number in OTHER_SIGNALS:
        if signal.getsignal(number) == signal.SIG_DFL:  # whoever handles or ignores one has a use for it
            signal.signal(number, _interrupt)
    # A terminal that lets nobody print in the background (`stty tostop`) would suspend a run by its own progress.
    if _PRINTING_BEHIND is not None and signal.getsignal(_PRINTING_BEHIND) == signal.SIG_DFL:
        signal.signal(_PRINTING_BEHIND, signal.SIG_IGN)


def ignore_endings() -> None:
    """Let nothing but a kill end this process from outside any more."""
    for number in ENDING_SIGNALS:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def ending_by_interrupt() -> Iterator[None]:
    """Let every ending signal raise KeyboardInterrupt for the length of the block, and then do what it did before."""
    changed = ENDING_SIGNALS if _PRINTING_BEHIND is None else (*ENDING_SIGNALS, _PRINTING_BEHIND)
    before = {number: signal.getsignal(number) for number in changed}
    end_by_interrupt()
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)


def _interrupt(number: int, frame: FrameType | None) -> None:
    INTERRUPTS.hear(number, frame, "" if number in MEANT_SIGNALS else f"interrupted by {signal_name(number)}")
