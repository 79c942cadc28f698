"""What a signal becomes: one interrupt, in a place where no lock is left taken by it."""

import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType, SimpleNamespace

import pytest

from rig.data.processes.ending_signals import ENDING_SIGNALS, Interrupts

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGUSR1"), reason="a signal of POSIX")


# No program can handle the first two, crashes are the next, and the last do nothing, or wait for a terminal.
OTHERS = ("KILL", "STOP", "SEGV", "ABRT", "BUS", "FPE", "ILL", "TRAP", "SYS", "PIPE", "XFSZ", "TTIN", "TTOU", "CHLD",
          "CONT", "WINCH", "URG")  # fmt: skip


@pytest.fixture
def interrupts() -> Iterator[Interrupts]:
    """What handles SIGUSR1."""
    made = Interrupts()

    def interrupt(number: int, frame: FrameType | None) -> None:
        made.hear(number, frame, "interrupted")

    before = signal.signal(signal.SIGUSR1, interrupt)
    yield made
    signal.signal(signal.SIGUSR1, before)


class Signalling:
    """A lock during whose taking a signal comes."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.acquire, self.release, self.locked = self._lock.acquire, self._lock.release, self._lock.locked

    def __enter__(self) -> bool:
        taken = self._lock.acquire()
        signal.raise_signal(signal.SIGUSR1)
        return taken

    def __exit__(self, *_: object) -> None:
        self._lock.release()


@pytest.mark.skipif(sys.platform != "linux", reason="which signals there are")
def test_every_signal_that_would_end_or_suspend_a_program_is_an_interrupt() -> None:
    assert set(ENDING_SIGNALS) == signal.valid_signals() - {getattr(signal, f"SIG{name}") for name in OTHERS}


def test_no_signal_leaves_a_lock_taken(interrupts: Interrupts) -> None:
    for _ in range(20):
        lock = Signalling()
        interrupts.allow()
        with pytest.raises(KeyboardInterrupt, match="interrupted"), threading.Condition(lock):  # pyrefly: ignore[bad-argument-type]  # all that a condition needs
            signal.pause()
        assert not lock.locked()


def test_a_burst_of_signals_is_one_interrupt(interrupts: Interrupts) -> None:
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGUSR1)
    for _ in range(3):
        signal.raise_signal(signal.SIGUSR1)
    interrupts.allow()
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGUSR1)


class Signalled:
    """An object during whose destruction a signal comes, whose exception Python then drops."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGUSR1)


def test_a_signal_during_a_destructor_is_not_lost(interrupts: Interrupts, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)
    interrupts.send_lost_again()
    with pytest.raises(KeyboardInterrupt, match="interrupted"):
        Signalled()
        signal.pause()


def test_other_exceptions_that_python_drops_are_reported(
    interrupts: Interrupts, monkeypatch: pytest.MonkeyPatch
) -> None:
    dropped = []
    monkeypatch.setattr(sys, "unraisablehook", lambda unraisable: dropped.append(unraisable.exc_type))
    interrupts.send_lost_again()
    interrupts.send_lost_again()  # as a second command in one process does
    sys.unraisablehook(SimpleNamespace(exc_type=ValueError, exc_value=ValueError()))  # all that it reads
    assert dropped == [ValueError]
