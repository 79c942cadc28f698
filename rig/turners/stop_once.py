"""A stop that is made once, in a thread of its own: what every turner's stop has, however it is made."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class StopOutcome:
    """Whether the turner was seen at rest, in words; `remedy` is empty where nothing is left to do."""

    at_rest: bool
    what: str
    remedy: str = ""


class StopOnce:
    """Makes a stop when `begin` is first called; later calls change nothing.

    `stopped` makes it and says what came of it, in less than 1 s, in a thread called `name`. No interrupt of the caller
    breaks it off. `not_ended` is the outcome should it fail itself.
    """

    def __init__(self, name: str, stopped: Callable[[], StopOutcome], not_ended: StopOutcome) -> None:
        self._stopped = stopped
        self._starting = threading.Lock()
        self._thread = threading.Thread(target=self._stop, name=name)
        self._ended = threading.Event()
        self._outcome = not_ended

    @property
    def begun(self) -> bool:
        """Whether a stop has been asked for."""
        return self._thread.ident is not None

    def begin(self) -> None:
        """Begin to stop, and return at once."""
        with self._starting:
            if not self.begun:
                self._thread.start()

    def outcome(self) -> StopOutcome:
        """Stop if that has not begun, and wait for the result; less than 1 s.

        An interrupt meanwhile is raised when the result is there. (An event, because `join`, once interrupted, takes
        the thread for ended in Python 3.11.)
        """
        self.begin()
        interrupt = None
        while not self._ended.is_set():
            try:
                self._ended.wait()
            except KeyboardInterrupt as impatient:
                interrupt = impatient
        if interrupt is not None:
            raise interrupt
        return self._outcome

    def _stop(self) -> None:
        try:
            self._outcome = self._stopped()
        finally:
            self._ended.set()


@contextmanager
def stopping_on_error(stop: Callable[[], StopOutcome]) -> Iterator[None]:
    """Stop before whatever ends the block early goes on to the caller."""
    try:
        yield
    except BaseException:
        stop()
        raise


def tell_of_stop(error: BaseException, stop: Callable[[], StopOutcome]) -> None:
    """Stop, and add to the error on whose account how that ended."""
    try:
        outcome = stop()
    except KeyboardInterrupt:  # one more, on the way out; the stop has ended by now
        outcome = stop()
    error.add_note(". ".join(filter(None, (outcome.what, outcome.remedy))))
