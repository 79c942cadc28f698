"""Every way to end a command from outside, made to stop the arm first."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

# Left alone, a closed terminal, Ctrl-\ and Ctrl-Z would end or suspend this process while the arm goes on moving.
ENDING_SIGNALS: Final = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP")
    if hasattr(signal, name)  # Windows has the first two
)
_HANGING_UP = getattr(signal, "SIGHUP", None)


def end_by_interrupt() -> None:
    """Let every ending signal raise KeyboardInterrupt from now on."""
    for number in ENDING_SIGNALS:
        # A script's `&` starts programs that ignore Ctrl-C: an arm must stop by it all the same. That a run is to
        # outlive its terminal is said by ignoring SIGHUP alone (nohup).
        if number != _HANGING_UP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _interrupt)


def ignore_endings() -> None:
    """Let nothing but a kill end this process from outside any more."""
    for number in ENDING_SIGNALS:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def ending_by_interrupt() -> Iterator[None]:
    """Let every ending signal raise KeyboardInterrupt for the length of the block, and then do what it did before."""
    before = {number: signal.getsignal(number) for number in ENDING_SIGNALS}
    end_by_interrupt()
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)


def _interrupt(*_: Any) -> None:
    raise KeyboardInterrupt
