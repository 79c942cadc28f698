"""Analysis of the recording after each measuring step, in a process of its own (`rig.page.live_analysis`)."""

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

WRITING_DELAY_S = 0.6  # until an event is written to the file
MAX_TIME_FRACTION = 0.1  # for analysis: a recording of hours takes long to read
MAX_EXIT_S = 5.0


class Lookout:
    """A listener to the run's events that wakes the thread of the analysis."""

    def __init__(self) -> None:
        self.wanted = threading.Event()
        self.over = threading.Event()
        self._raw = True

    def event(self, event: RunEvent) -> None:
        """Request an analysis after a finished step."""
        match event:
            case PhaseStarted(_, _, sensors):
                self._raw = "calibrated" not in sensors.values()
            case StepFinished(_, _, Sweep() | Rest() | Dwell(), _) if self._raw:
                self.wanted.set()


@contextmanager
def looking_out(folder: Path, feed: Feed) -> Iterator[Lookout]:
    """Run the analysis during the block, and show its results by `feed`.

    If its process fails, a message on stderr says so; the page then lacks these results, and the run continues.
    """
    lookout = Lookout()
    command = [sys.executable, "-P", "-m", "rig.page.live_analysis", str(folder)]
    try:  # In a session of its own, so that Ctrl-C reaches only the run.
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
        thread.join(MAX_EXIT_S)
        for pipe in pipes:
            with suppress(OSError):  # the last question may not have been sent
                pipe.close()


def _ask(questions: TextIO, answers: TextIO, lookout: Lookout, feed: Feed) -> None:
    why = "its process has ended"
    try:
        _follow(questions, answers, lookout, feed)
    except Exception as error:  # any error: no part of the run depends on it
        why = f"{type(error).__name__}: {error}"
    if not lookout.over.is_set():
        _say_that_it_ended(why)


def _say_that_it_ended(why: str) -> None:
    what = "The page shows no new observations and parameters until the verdict"
    say(f"{what} ({why}). The run continues.", sys.stderr)


def _follow(questions: TextIO, answers: TextIO, lookout: Lookout, feed: Feed) -> None:
    """Request an analysis whenever one is due; return at the end, or if no answer comes."""
    while lookout.wanted.wait() and not lookout.over.wait(WRITING_DELAY_S):
        lookout.wanted.clear()
        start_s = time.monotonic()
        questions.write("\n")
        questions.flush()
        line = answers.readline()
        if not line.endswith("\n"):
            return
        document = json.loads(line)
        if "observations" in document:
            feed.look(Look(**document))
        if lookout.over.wait((time.monotonic() - start_s) * (1 / MAX_TIME_FRACTION - 1)):
            return
