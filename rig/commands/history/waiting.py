"""The wait for an answer that may never come, such as that of a frozen database."""

from collections.abc import Callable
from threading import Thread
from typing import TypeVar

T = TypeVar("T")


def await_answer(work: Callable[[], T], within_s: float | None = None) -> T:
    """Return the result of `work`, from a thread of its own; pass on its exception.

    Raise TimeoutError if it takes longer than `within_s`, s. Ctrl-C takes effect immediately. A late thread is
    abandoned and ends with the process, because a library that waits for its server cannot be interrupted.
    """
    from concurrent.futures import Future  # here, as `rig --help` does not need it

    answer: Future[T] = Future()

    def carry_out() -> None:
        try:
            answer.set_result(work())
        except BaseException as error:
            answer.set_exception(error)

    Thread(target=carry_out, daemon=True).start()
    return answer.result(within_s)
