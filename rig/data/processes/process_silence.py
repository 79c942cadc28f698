"""The silence of another process, counted so that a busy machine does not look like a hanging process."""

import time
from pathlib import Path

from firmware_host import computer_load

MIN_STARVED_FRACTION = 0.5  # of a tick spent waiting for a processor: above it, silence says nothing about the process
MAX_RUN_FRACTION = 0.05  # of a tick for which a starved thread that is ready to run has run
WAITING = ("R", "D")  # of a thread: ready to run, or waiting for swapped memory
NS_PER_S = 1e9

_Times = dict[str, tuple[float, float]]  # by thread: seconds on a processor, seconds waiting for one


class Silence:
    """A counter of the intervals (ticks) without a sign of life from the process `pid`.

    Ticks are counted, not seconds, because the counting process may itself be delayed. A tick is ignored if the thread
    that is expected to answer (`thread`, any if None) mostly waited for a processor, as Linux shows (proc(5)).

    On a busy machine the limit of a silence grows by at most LARGEST_LOAD_FACTOR, and ignored ticks extend it by at
    most the factor `spared`, because the arm must not be left alone for longer.
    """

    def __init__(self, pid: int, *, spared: int, thread: int | None = None) -> None:
        self._tasks = Path(f"/proc/{pid}/task")
        self._main = str(pid)
        self._thread = None if thread is None else str(thread)
        self._spared = spared
        self.ticks = 0
        self._all_ticks = 0
        self._times: _Times = {}
        self._looked_s = 0.0

    def heard(self) -> None:
        """Reset the count after a sign of life."""
        self.ticks = self._all_ticks = 0

    def tick(self, unheard: bool = False) -> None:
        """Count one more interval without a sign of life.

        Call this at even intervals. With `unheard`, an answer has arrived but is unread, and the tick is ignored.
        """
        self._all_ticks += 1
        # The first tick of a silence means nothing yet; after the second, the process' threads are examined.
        starved = self._all_ticks > 1 and self._is_starved(has_previous=self._all_ticks > 2)
        self.ticks += not (starved or unheard)

    def lasts_over(self, limit: float) -> bool:
        """Return whether more than `limit` ticks were counted, or more than `limit` × `spared` with the ignored ones.

        So that the wait ends in any case, `spared` times as many ticks of any kind suffice. The `limit` is that of a
        machine with a processor for every program; it is multiplied by the machine's load.
        """
        if max(self.ticks, self._all_ticks / self._spared) <= limit:
            return False
        stretched = limit * (1.0 if self._is_stopped() else computer_load.load_factor())
        return self.ticks > stretched or self._all_ticks > self._spared * stretched

    def _is_stopped(self) -> bool:
        """Return whether a signal has stopped the process, so its silence is not due to the machine."""
        return _state(self._tasks / self._main) == "T"

    def _is_starved(self, has_previous: bool) -> bool:
        """Return whether the process waited for a processor since the last call; False at the first call.

        The system counts a wait only when it has ended, so a thread that is ready and has not run counts as waiting.
        """
        now_s = time.monotonic()
        elapsed_s, before = now_s - self._looked_s, self._times
        self._looked_s, self._times = now_s, _times(self._tasks)
        return has_previous and any(
            waited_s - before[thread][1] > MIN_STARVED_FRACTION * elapsed_s
            or (ran_s - before[thread][0] < MAX_RUN_FRACTION * elapsed_s and _state(self._tasks / thread) in WAITING)
            for thread, (ran_s, waited_s) in self._times.items()
            if thread in before and self._thread in (None, thread)
        )


def _times(tasks: Path) -> _Times:
    """Return the times, s, that each thread ran and waited for a processor; empty if the system does not state them."""
    times: _Times = {}
    try:
        for task in tasks.iterdir():
            ran_ns, waited_ns, _ = (task / "schedstat").read_text().split()
            times[task.name] = int(ran_ns) / NS_PER_S, int(waited_ns) / NS_PER_S
    except (OSError, ValueError):
        pass  # not Linux, or a thread that has ended meanwhile
    return times


def _state(task: Path) -> str:
    try:
        return (task / "stat").read_text(errors="replace").rpartition(")")[2].split()[0]
    except (OSError, IndexError):
        return ""
