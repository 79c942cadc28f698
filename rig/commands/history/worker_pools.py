"""The places where recordings are solved: this process, processes of this computer, or workers of a Dask scheduler.

If a worker dies, only the recording that it was solving is lost.
"""

import logging
import signal
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager, suppress
from multiprocessing import get_context
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Protocol

from rig.commands.history.recompute_worker import Task
from rig.errors import Fault, Refused
from rig.history.recompute.result_comparison import Answer, Unsolved

if TYPE_CHECKING:
    from distributed import Client

POLL_S = 1.0  # of a cluster that does not answer
NEW_WORKERS_S = 30.0  # time to start new ones
THREAD_RECORDINGS = 2  # for each thread of a cluster: one in progress, and one that waits

Solve = Callable[[Task], Answer]
SolvedTask = tuple[Task, Answer]


class Workers(Protocol):
    """Workers that solve recordings; a task is one recording to solve."""

    @property
    def busy(self) -> bool:
        """Whether a recording is being solved."""
        ...

    def room(self) -> int:
        """Return the number of tasks that the workers can still take. Raise Fault `cluster_lost` without a worker."""
        ...

    def give(self, solve: Solve, task: Task) -> None:
        """Give the workers one more recording to solve."""
        ...

    def answers(self) -> Iterator[SolvedTask]:
        """Yield the answers that have arrived; wait a moment if no answer has. Raise Fault `cluster_lost`."""
        ...


def solve_one_by_one(tasks: Iterable[Task], solve: Solve) -> Iterator[SolvedTask]:
    """Solve the tasks in this process, in their order, and yield the answers."""
    for task in tasks:
        try:
            yield task, solve(task)
        except Exception as error:  # a defect at one recording must not cost the others
            yield task, _describe_defect(error)


def distribute(tasks: Iterable[Task], solve: Solve, workers: Workers) -> Iterator[SolvedTask]:
    """Solve the tasks by `workers`, and yield the answers as they arrive.

    The workers get no more tasks than they can take. Raise Fault `cluster_lost`.
    """
    waiting = deque(tasks)
    while waiting or workers.busy:
        for _ in range(min(workers.room(), len(waiting))):
            workers.give(solve, waiting.popleft())
        yield from workers.answers()


class Processes(AbstractContextManager["Processes"]):
    """Processes of this computer, each in a pool of its own, so that the crash of one affects no other process."""

    def __init__(self, count: int) -> None:
        self._idle = [_new_process() for _ in range(count)]
        self._in_hand: dict[Future[Answer], tuple[Task, ProcessPoolExecutor]] = {}

    def __exit__(self, *_: object) -> None:
        for pool in (*self._idle, *(pool for _, pool in self._in_hand.values())):
            pool.shutdown(cancel_futures=True)

    @property
    def busy(self) -> bool:
        """Whether a worker is solving a task."""
        return bool(self._in_hand)

    def room(self) -> int:
        """Return the number of idle workers."""
        return len(self._idle)

    def give(self, solve: Solve, task: Task) -> None:
        """Give the task to an idle worker."""
        pool = self._idle.pop()
        self._in_hand[pool.submit(solve, task)] = task, pool

    def answers(self) -> Iterator[SolvedTask]:
        """Yield the answers that have arrived; a process that died is replaced by a new one."""
        for future in wait(self._in_hand, timeout=POLL_S, return_when=FIRST_COMPLETED).done:
            task, pool = self._in_hand.pop(future)
            dead = isinstance(future.exception(), BrokenProcessPool)
            self._idle.append(_new_process() if dead else pool)
            yield task, _read_answer(future)


class Cluster:
    """The workers of a Dask scheduler, including those that join later."""

    def __init__(self, client: "Client") -> None:
        self._client = client
        self._in_hand: dict[str, Task] = {}
        self._done: SimpleQueue[Any] = SimpleQueue()  # of Dask's futures
        self._futures: dict[str, Any] = {}  # Dask forgets futures that are not referenced
        self._seen_s = time.monotonic()

    @property
    def busy(self) -> bool:
        """Whether the scheduler has an unanswered task."""
        return bool(self._in_hand)

    def threads(self) -> dict[str, int]:
        """Return the number of threads of each worker, by the worker's address. Raise Fault `cluster_lost`."""
        if self._client.status == "running":
            with suppress(OSError, RuntimeError):
                threads: dict[str, int] = self._client.nthreads()
                return threads
        raise _cluster_lost("the scheduler does not answer any more")

    def room(self) -> int:
        """Return the number of further tasks that the cluster can take: a few per thread, minus those in progress.

        Raise Fault `cluster_lost` if the scheduler does not answer, or has had no worker for `NEW_WORKERS_S`.
        """
        threads, now_s = sum(self.threads().values()), time.monotonic()
        if threads:
            self._seen_s = now_s
        elif now_s - self._seen_s > NEW_WORKERS_S:
            raise _cluster_lost(f"the scheduler has had no worker for {NEW_WORKERS_S:g} s")
        return max(0, THREAD_RECORDINGS * threads - len(self._in_hand))

    def give(self, solve: Solve, task: Task) -> None:
        """Give the task to a worker that the scheduler chooses."""
        future: Any = self._client.submit(solve, task, pure=False)
        self._futures[future.key], self._in_hand[future.key] = future, task
        future.add_done_callback(self._done.put)

    def answers(self) -> Iterator[SolvedTask]:
        """Wait a moment for an answer, and yield it if one arrives."""
        try:
            future = self._done.get(timeout=POLL_S)
        except Empty:
            return
        del self._futures[future.key]
        yield self._in_hand.pop(future.key), _read_answer(future)


def _new_process() -> ProcessPoolExecutor:
    # Not forked: this process may have threads. Its environment, which says one thread for linear algebra (rig/cli.py),
    # is handed on.
    return ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_ignore_interrupts)


def _read_answer(future: Any) -> Answer:
    """Return the answer of a finished future, of a process or of Dask. Raise Fault `cluster_lost` if cancelled."""
    if future.cancelled():
        raise _cluster_lost("the scheduler has ended with unfinished tasks")
    error = future.exception()
    if error is None:
        answer: Answer = future.result()
        return answer
    if isinstance(error, BrokenProcessPool) or type(error).__name__ == "KilledWorker":
        return Unsolved("lost", "the worker that was solving it died")
    return _describe_defect(error)


def _describe_defect(error: BaseException) -> Unsolved:
    return Unsolved("failed", f"{type(error).__name__}: {error}")


def _cluster_lost(what: str) -> Fault:
    return Fault("cluster_lost", what, "Start it again; the same command then continues with the remaining recordings")


def _ignore_interrupts() -> None:
    """Ignore Ctrl-C in a worker, so that the parent stops only after the recording is finished."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def connect_client(address: str) -> Iterator["Client"]:
    """Yield a client, connected to the scheduler at `address`. Raise Refused `missing_extra`, `no_cluster`."""
    from rig.errors.extras import requiring

    with requiring("dask"):
        from distributed import Client
    try:
        client = Client(address, timeout="5s")
    except (OSError, ValueError) as error:
        raise Refused(
            "no_cluster", f"no Dask scheduler answers at {address} ({error})", "Start one with `dask scheduler`"
        ) from error
    for name in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # the fault `cluster_lost` says it in one line
    with client:
        yield client
