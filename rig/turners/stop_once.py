"""A stop that runs once, in a thread of its own: the common part of the stops of all turners."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class StopOutcome:
    """The end of a stop: whether a state confirmed rest, a description, and a `remedy`, empty if none is needed."""

    at_rest: bool
    what: str
    remedy: str = ""


class StopOnce:
    """A stop that starts at the first call of `begin`; later calls change nothing.

    `stopped` stops the turner and returns the outcome in less than 1 s, in a thread called `name`, which an interrupt
    of the caller does not abort. `not_ended` is the outcome if `stopped` itself fails.
    """

    def __init__(self, name: str, stopped: Callable[[], StopOutcome], not_ended: StopOutcome) -> None:
        self._stopped = stopped
        self._starting = threading.Lock()
        self._thread = threading.Thread(target=self._stop, name=name)
        self._ended = threading.Event()
        self._outcome = not_ended

    @property
    def begun(self) -> bool:
        """Whether a stop has been requested."""
        return self._thread.ident is not None

    def begin(self) -> None:
        """Begin to stop, and return at once."""
        with self._starting:
            if not self.begun:
                self._thread.start()

    def outcome(self) -> StopOutcome:
        """Begin the stop unless it has begun, wait for its outcome, less than 1 s, and return the outcome.

        An interrupt during the stop is raised once the outcome is known. (In Python 3.11 an interrupted `join` takes
        the thread for ended, so an event is awaited.)
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
    """Stop the turner if the block raises an exception, before passing it on."""
    try:
        yield
    except BaseException:
        stop()
        raise


def stop_and_note(error: BaseException, stop: Callable[[], StopOutcome]) -> None:
    """Stop, and add the outcome as a note to the error that caused the stop."""
    try:
        outcome = stop()
    except KeyboardInterrupt:  # a further interrupt on the way out; the stop has ended by now
        outcome = stop()
    error.add_note(". ".join(filter(None, (outcome.what, outcome.remedy))))
