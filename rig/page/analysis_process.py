"""Has the recording looked at after each step that measures, by a process of its own (`rig.page.live_analysis`)."""

import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from rig.motion.steps import Dwell, Rest, Sweep
from rig.page.rows import Look
from rig.page.server.feed import Feed
from rig.station.events import PhaseStarted, RunEvent, StepFinished
from rig.station.plain_text import say

WRITTEN_S = 0.6  # after which an event is in the file
SHARE = 0.1  # of the time looking may take: a recording of hours is long to read
ENDING_S = 5.0


class Lookout:
    """A listener that wakes the thread which asks."""

    def __init__(self) -> None:
        self.wanted = threading.Event()
        self.over = threading.Event()
        self._raw = True

    def event(self, event: RunEvent) -> None:
        """Take an event, as a Listener does: a finished step is looked at."""
        match event:
            case PhaseStarted(_, _, sensors):
                self._raw = "calibrated" not in sensors.values()
            case StepFinished(_, _, Sweep() | Rest() | Dwell(), _) if self._raw:
                self.wanted.set()


@contextmanager
def looking_out(folder: Path, feed: Feed) -> Iterator[Lookout]:
    """A lookout for the length of the block; what it sees is shown by `feed`.

    A process that fails says so on stderr: the page goes without what it would see, and the run goes on.
    """
    lookout = Lookout()
    command = [sys.executable, "-P", "-m", "rig.page.live_analysis", str(folder)]
    try:  # In a session of its own: Ctrl-C is the run's.
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
        )
    except OSError as error:
        _say_that_it_ended(str(error))
        yield lookout
        return
    pipes = [pipe for pipe in (process.stdin, process.stdout) if pipe is not None]
    thread = threading.Thread(target=_ask, args=(*pipes, lookout, feed), name="lookout", daemon=True)
    thread.start()
    try:
        yield lookout
    finally:
        lookout.over.set()
        lookout.wanted.set()
        process.kill()
        process.wait()
        thread.join(ENDING_S)
        for pipe in pipes:
            with suppress(OSError):  # what it was asked last may never have reached it
                pipe.close()


def _ask(questions: TextIO, answers: TextIO, lookout: Lookout, feed: Feed) -> None:
    why = "its process has ended"
    try:
        _follow(questions, answers, lookout, feed)
    except Exception as error:  # whatever it may be: no part of the run hangs on it
        why = f"{type(error).__name__}: {error}"
    if not lookout.over.is_set():
        _say_that_it_ended(why)


def _say_that_it_ended(why: str) -> None:
    what = "The page shows no more of observations and parameters until the verdict"
    say(f"{what} ({why}). The run goes on.", sys.stderr)


def _follow(questions: TextIO, answers: TextIO, lookout: Lookout, feed: Feed) -> None:
    """Ask for what has come, whenever that is wanted; returns when all is over, or when nobody answers."""
    while lookout.wanted.wait() and not lookout.over.wait(WRITTEN_S):
        lookout.wanted.clear()
        asked_s = time.monotonic()
        questions.write("\n")
        questions.flush()
        line = answers.readline()
        if not line.endswith("\n"):
            return
        seen = json.loads(line)
        if "observations" in seen:
            feed.look(Look(**seen))
        if lookout.over.wait((time.monotonic() - asked_s) * (1 / SHARE - 1)):
            return
