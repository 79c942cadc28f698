"""Waiting for something that may never answer, such as a database that has frozen."""

from collections.abc import Callable
from threading import Thread
from typing import TypeVar

T = TypeVar("T")


def answer_of(work: Callable[[], T], within_s: float | None = None) -> T:
    """What `work` returns, or raises, from a thread of its own. Raises TimeoutError when it takes longer.

    So Ctrl-C is heard at once, whatever the thread waits for. One that is late is left behind, and ends with the
    process: a library that waits for its server cannot be told to stop.
    """
    from concurrent.futures import Future  # not at once: `rig --help` has no use for it

    answer: Future[T] = Future()

    def carry_out() -> None:
        try:
            answer.set_result(work())
        except BaseException as error:
            answer.set_exception(error)

    Thread(target=carry_out, daemon=True).start()
    return answer.result(within_s)
