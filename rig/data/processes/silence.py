"""How long another process has been silent, counted so that a busy machine does not look like a process that hangs."""

import os
import time
from pathlib import Path

CROWDED = 5.0  # times a limit is given at most, once for each program a processor that wants to run
STARVED = 0.5  # of a tick spent waiting for a processor: more, and a silence in it says nothing about the process
STANDS = 0.05  # … or without having run for more than this, and still ready to run
HELD_UP = ("R", "D")  # states of a thread: ready to run, or waiting for memory that the system has put away
NS_PER_S = 1e9

_Times = dict[str, tuple[float, float]]  # by thread: seconds on a processor, seconds waiting for one


class Silence:
    """Counts the ticks without a sign of life from the process `pid`.

    Ticks and not seconds, because the one who counts may be held up itself; and no ticks in which the thread whose
    signs of life are waited for (`thread`, any where it is None) spent most of the time waiting for a processor. Where
    the system does not tell (proc(5) of Linux does) all ticks count. Of a process that somebody has stopped every tick
    counts. However busy the machine, a silence lasts at most `spared` times CROWDED times its limit: the arm is not to
    be left alone.
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
        """A sign of life."""
        self.ticks = self._all_ticks = 0

    def tick(self, unheard: bool = False) -> None:
        """Count that once more nothing was heard, or not yet: call this at even intervals.

        `unheard`: what it has said lies there, and whoever is to hear it has not come to it; that is not its silence.
        """
        self._all_ticks += 1
        # The first tick of a silence is nothing yet; only then is it worth a look at what the process does.
        starved = self._all_ticks > 1 and self._starved(known=self._all_ticks > 2)
        self.ticks += not (starved or unheard)

    def lasts_over(self, limit: float) -> bool:
        """Whether there were more than `limit` silent ticks, or far more when the machine was too busy to tell.

        The limit is that of a machine with a processor for everybody; it is stretched by the machine's `crowding`.
        """
        if max(self.ticks, self._all_ticks / self._spared) <= limit:
            return False
        stretched = limit * (1.0 if self._stopped() else crowding())
        return self.ticks > stretched or self._all_ticks > self._spared * stretched

    def _stopped(self) -> bool:
        """Whether somebody has stopped the process: then it is not the machine that keeps it silent."""
        return _state(self._tasks / self._main) == "T"

    def _starved(self, known: bool) -> bool:
        """Whether the process waited for a processor since the last call; False when that is not `known`.

        A thread that still waits is not counted as waiting by the system, but as ready to run without having run.
        """
        now_s = time.monotonic()
        elapsed_s, before = now_s - self._looked_s, self._times
        self._looked_s, self._times = now_s, _times(self._tasks)
        return known and any(
            waited_s - before[thread][1] > STARVED * elapsed_s
            or (ran_s - before[thread][0] < STANDS * elapsed_s and _state(self._tasks / thread) in HELD_UP)
            for thread, (ran_s, waited_s) in self._times.items()
            if thread in before and self._thread in (None, thread)
        )


def crowding() -> float:
    """How many programs a processor of this machine has to serve, 1 to CROWDED: what is late may be late by that.

    In the mean of the last minute, or now: after a quarter of a minute the mean tells of a quarter of a crowd.
    """
    if not hasattr(os, "getloadavg"):  # Windows
        return 1.0
    return min(max(max(os.getloadavg()[0], _runnable()) / (os.cpu_count() or 1), 1.0), CROWDED)


def _runnable() -> int:
    """How many threads of the machine run or wait for a processor now; 0 where proc(5) does not tell."""
    try:
        return int(Path("/proc/loadavg").read_text().split()[3].partition("/")[0])
    except (OSError, ValueError, IndexError):
        return 0


def _times(tasks: Path) -> _Times:
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
