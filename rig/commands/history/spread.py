"""Who solves where: one after another here, in processes of this computer, or on the workers of a Dask scheduler.

One rule holds everywhere: a worker that dies costs what it had in hand, and no other recording.
"""

import signal
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, suppress
from multiprocessing import get_context
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Protocol

from rig.commands.history.again_work import Task
from rig.errors import Fault
from rig.history.again.answer import Answer, Unsolved

if TYPE_CHECKING:
    from distributed import Client

LOOK_S = 1.0  # between two looks at a cluster that answers nothing
WITHOUT_WORKERS_S = 30.0  # who starts new ones needs a while
AHEAD = 2  # recordings for each thread of a cluster: one in hand, and one that waits beside it

Solve = Callable[[Task], Answer]
Answered = tuple[Task, Answer]


class Hands(Protocol):
    """Workers, and what they have in hand."""

    @property
    def busy(self) -> bool:
        """Whether something is in hand."""
        ...

    def room(self) -> int:
        """How many more they take now. Raises Fault `cluster_lost` when there is nobody any more."""
        ...

    def give(self, solve: Solve, task: Task) -> None:
        """Give them one more."""
        ...

    def answers(self) -> Iterator[Answered]:
        """What has come, after waiting for a moment if need be. Raises Fault `cluster_lost`."""
        ...


def one_by_one(tasks: Iterable[Task], solve: Solve) -> Iterator[Answered]:
    """The answers, solved here in this order."""
    for task in tasks:
        try:
            yield task, solve(task)
        except Exception as error:  # a defect at one recording costs no other
            yield task, _failed(error)


def spread(tasks: Iterable[Task], solve: Solve, hands: Hands) -> Iterator[Answered]:
    """The answers as they come; only as many are handed out as `hands` have room for. Raises Fault `cluster_lost`."""
    waiting = deque(tasks)
    while waiting or hands.busy:
        for _ in range(min(hands.room(), len(waiting))):
            hands.give(solve, waiting.popleft())
        yield from hands.answers()


class Processes(AbstractContextManager["Processes"]):
    """`count` processes of this computer, each a pool of its own: one that dies takes no other with it."""

    def __init__(self, count: int) -> None:
        self._idle = [_new_process() for _ in range(count)]
        self._in_hand: dict[Future[Answer], tuple[Task, ProcessPoolExecutor]] = {}

    def __exit__(self, *_: object) -> None:
        for pool in (*self._idle, *(pool for _, pool in self._in_hand.values())):
            pool.shutdown(cancel_futures=True)

    @property
    def busy(self) -> bool:
        """Whether one of them solves."""
        return bool(self._in_hand)

    def room(self) -> int:
        """How many of them are idle."""
        return len(self._idle)

    def give(self, solve: Solve, task: Task) -> None:
        """Give it to an idle one."""
        pool = self._idle.pop()
        self._in_hand[pool.submit(solve, task)] = task, pool

    def answers(self) -> Iterator[Answered]:
        """What has come; in the place of one that died there is a new one."""
        for future in wait(self._in_hand, timeout=LOOK_S, return_when=FIRST_COMPLETED).done:
            task, pool = self._in_hand.pop(future)
            dead = isinstance(future.exception(), BrokenProcessPool)
            self._idle.append(_new_process() if dead else pool)
            yield task, _answer_of(future)


class Cluster:
    """The workers of a Dask scheduler, those that come later too."""

    def __init__(self, client: "Client") -> None:
        self._client = client
        self._in_hand: dict[str, Task] = {}
        self._done: SimpleQueue[Any] = SimpleQueue()  # of Dask's futures
        self._futures: dict[str, Any] = {}  # which Dask would forget without
        self._seen_s = time.monotonic()

    @property
    def busy(self) -> bool:
        """Whether the scheduler has something that has not come back."""
        return bool(self._in_hand)

    def threads(self) -> dict[str, int]:
        """How many threads each worker has, by its address. Raises Fault `cluster_lost`."""
        if self._client.status == "running":
            with suppress(OSError, RuntimeError):
                found: dict[str, int] = self._client.nthreads()  # type: ignore[no-untyped-call]
                return found
        raise _lost("the scheduler does not answer any more")

    def room(self) -> int:
        """Some for each thread, less what is in hand. Raises Fault `cluster_lost` when all have been gone for long."""
        threads, now_s = sum(self.threads().values()), time.monotonic()
        if threads:
            self._seen_s = now_s
        elif now_s - self._seen_s > WITHOUT_WORKERS_S:
            raise _lost(f"the scheduler has had no worker for {WITHOUT_WORKERS_S:g} s")
        return max(0, AHEAD * threads - len(self._in_hand))

    def give(self, solve: Solve, task: Task) -> None:
        """Give it to whichever worker the scheduler chooses."""
        future: Any = self._client.submit(solve, task, pure=False)
        self._futures[future.key], self._in_hand[future.key] = future, task
        future.add_done_callback(self._done.put)

    def answers(self) -> Iterator[Answered]:
        """What has come within a moment."""
        try:
            future = self._done.get(timeout=LOOK_S)
        except Empty:
            return
        del self._futures[future.key]
        yield self._in_hand.pop(future.key), _answer_of(future)


def _new_process() -> ProcessPoolExecutor:
    # Not forked: this process may have threads. Its environment, which says one thread for linear algebra (rig/cli.py),
    # is handed on.
    return ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_leave_endings_to_the_parent)


def _answer_of(future: Any) -> Answer:
    """The answer of a future, a process's or Dask's, that is done."""
    if future.cancelled():
        raise _lost("the scheduler has gone away with what it had in hand")
    error = future.exception()
    if error is None:
        answer: Answer = future.result()
        return answer
    if isinstance(error, BrokenProcessPool) or type(error).__name__ == "KilledWorker":
        return Unsolved("lost", "the worker that had it in hand died")
    return _failed(error)


def _failed(error: BaseException) -> Unsolved:
    return Unsolved("failed", f"{type(error).__name__}: {error}")


def _lost(what: str) -> Fault:
    return Fault("cluster_lost", what, "Start it again; the same command then goes on with what is left")


def _leave_endings_to_the_parent() -> None:
    """Ctrl-C reaches every process of a terminal: the recording in hand is finished, and the parent says the rest."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
