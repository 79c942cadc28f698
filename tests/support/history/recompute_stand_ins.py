"""Stand-ins for solutions, in tests of the workers. A module that worker processes can import."""

import os
import signal
import time
from pathlib import Path

from rig.commands.history.recompute_worker import Task
from rig.data.run_folder import RESULT
from rig.history.recompute.result_comparison import Answer, RecomputedResult

DEADLY, WAITING = "deadly", "waiting"


def task(key: str, *folders: Path) -> Task:
    """Return a task without recordings, named by its answer."""
    return Task(key, (), tuple(("bench", str(folder)) for folder in folders), (), None)


def answer_at_once(task: Task) -> Answer:
    """Answer at once with the worker's process and the threads of its linear algebra."""
    return RecomputedResult(task.key, (str(os.getpid()), os.environ.get("OPENBLAS_NUM_THREADS", "")), ())


def deadly(task: Task) -> Answer:
    """Answer as scripted; one recording kills its worker."""
    if task.key == DEADLY:
        os.kill(os.getpid(), signal.SIGKILL)
    return answer_at_once(task)


def failing(task: Task) -> Answer:
    """Answer as scripted; one recording raises an unexpected exception."""
    if task.key == DEADLY:
        raise ZeroDivisionError("a defect")
    return answer_at_once(task)


def waiting(task: Task) -> Answer:
    """Answer as scripted; some wait until their folder has a result."""
    if task.key.startswith(WAITING):
        deadline_s = time.monotonic() + 60
        while not (Path(task.places[0][1]) / RESULT).exists() and time.monotonic() < deadline_s:
            time.sleep(0.02)
    return answer_at_once(task)
