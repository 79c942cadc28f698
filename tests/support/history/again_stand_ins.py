"""What stands in for solving, where who solves is what is tested. A module that worker processes can import."""

import os
import signal
import time
from pathlib import Path

from rig.commands.history.again_work import Task
from rig.data.run_folder import RESULT
from rig.history.again.answer import Answer, RecomputedResult

DEADLY, WAITING = "deadly", "waiting"


def task(key: str, *places: Path) -> Task:
    """Recordings of nothing, by the name of the answer."""
    return Task(key, (), tuple(("bench", str(each)) for each in places), (), None)


def told(task: Task) -> Answer:
    """An answer at once: what the worker is, and how many threads its linear algebra may have."""
    return RecomputedResult(task.key, (str(os.getpid()), os.environ.get("OPENBLAS_NUM_THREADS", "")), ())


def deadly(task: Task) -> Answer:
    """As `told`; one recording kills whoever solves it."""
    if task.key == DEADLY:
        os.kill(os.getpid(), signal.SIGKILL)
    return told(task)


def failing(task: Task) -> Answer:
    """As `told`; one recording meets a defect of the program."""
    if task.key == DEADLY:
        raise ZeroDivisionError("a defect")
    return told(task)


def waiting(task: Task) -> Answer:
    """As `told`; some wait until there is a result in their folder."""
    if task.key.startswith(WAITING):
        deadline_s = time.monotonic() + 60
        while not (Path(task.places[0][1]) / RESULT).exists() and time.monotonic() < deadline_s:
            time.sleep(0.02)
    return told(task)
