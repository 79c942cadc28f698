"""A page in a browser that is told of a run which nobody made. As a program: one that is told until it is killed."""

import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

from selenium.webdriver import Chrome

from rig.motion.state import ArmState, RuntimeState
from rig.page.about import About
from rig.page.control import Control
from rig.page.feed import Feed
from rig.page.page_state import Shown
from rig.page.rows import Look
from rig.page.serving import Address, serving
from rig.station.events import ArmSeen, Progress, RunEvent, SamplesTaken, StepFinished, StepStarted
from support.browser import text
from support.told_runs import ABOUT, before_it_moves, look, moving, planned
from support.waiting import wait_for

AGAIN_S = 0.2  # a run that goes on tells so all the time
GOING_ON = (StepStarted, StepFinished, Progress, SamplesTaken)


class Telling:
    """Events for a page in a browser, and the words it must show then.

    The last place of an arm that moves is told again and again, as a run does, until it falls `silent`.
    """

    def __init__(self, driver: Chrome, feed: Feed) -> None:
        self._driver, self._feed = driver, feed
        self._telling = threading.Lock()
        self._last: ArmSeen | None = None
        self.silent = threading.Event()

    def __call__(self, *events: Any) -> None:
        with self._telling:
            for event in events:
                self._feed.event(event)
                if isinstance(event, ArmSeen) and isinstance(event.state, ArmState):
                    self._last = event if event.state.runtime_state == RuntimeState.PLAYING else None
                elif not isinstance(event, GOING_ON):
                    self._last = None

    def look(self, sweeps: int) -> None:
        self._feed.look(look(planned(), sweeps))

    def observed(self, rows: list[dict[str, Any]]) -> None:
        self._feed.look(Look(rows, []))

    def word(self, expected: str) -> None:
        wait_for(
            lambda: text(self._driver, "state-word") == expected, f"{expected}, not {text(self._driver, 'state-word')}"
        )
        assert text(self._driver, "sign")

    def go_on(self) -> None:
        while not self.silent.wait(AGAIN_S):
            with self._telling:
                if self._last is not None:
                    self._feed.event(self._last)


@contextmanager
def showing(
    driver: Chrome, folder: Path, *, token: bool = True, may_answer: bool = True, about: About = ABOUT
) -> Iterator[Telling]:
    """A page that has been loaded and told nothing yet."""
    feed = Feed(Shown(replace(about, may_answer=may_answer)))
    with serving(feed, Control(may_answer=may_answer), folder, Address(port=0)) as url:
        driver.get(url if token else url.split("#")[0])
        telling = Telling(driver, feed)
        thread = threading.Thread(target=telling.go_on, daemon=True)
        thread.start()
        try:
            yield telling
        finally:
            telling.silent.set()
            thread.join()


def main() -> None:
    """Serve a page, print its address, and tell of movements without an end."""
    feed = Feed(Shown(ABOUT))
    with (
        tempfile.TemporaryDirectory() as folder,
        serving(feed, Control(may_answer=False), Path(folder), Address(port=0)) as url,
    ):
        print(url, flush=True)
        for _ in count():
            events: list[RunEvent] = [*before_it_moves(planned()), *moving(planned(), 60.0)]
            for event in events:
                feed.event(event)
                if isinstance(event, Progress):
                    time.sleep(0.05)


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))
    main()
