"""A page in a browser that receives the events of an invented run; as a program, until it is killed."""

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

from rig.motion.turner_state import ArmState, RuntimeState
from rig.page.about import About
from rig.page.page_state import PageState
from rig.page.rows import Look
from rig.page.server.control import Control
from rig.page.server.feed import Feed
from rig.page.server.serving import PageAddress, serving
from rig.station.events import ArmSeen, HandSeen, Progress, RunEvent, SamplesTaken, StepFinished, StepStarted
from support.page.browser import text
from support.page.scripted_runs import ABOUT, before_it_moves, look, moving, plan_demo
from support.processes.waiting import wait_for

AGAIN_S = 0.2  # interval of events in a run
GOING_ON = (StepStarted, StepFinished, Progress, SamplesTaken)


class Telling:
    """Events for a page in a browser, and the words that it must then show.

    As in a real run, newer samples and states follow after a moving arm or a hand, until all is `silent`, or only
    `repeating` the last ones.
    """

    def __init__(self, driver: Chrome, feed: Feed) -> None:
        self._driver, self._feed = driver, feed
        self._telling = threading.Lock()
        self._samples: SamplesTaken | None = None
        self._seen: ArmSeen | HandSeen | None = None
        self.times = 0  # that newer ones came
        self.silent, self.repeating = threading.Event(), threading.Event()

    def __call__(self, *events: Any) -> None:
        with self._telling:
            for event in events:
                self._feed.event(event)
                if isinstance(event, SamplesTaken):
                    self._samples = event
                elif isinstance(event, ArmSeen | HandSeen):
                    self._seen = event if goes_on(event) else None
                elif not isinstance(event, GOING_ON):
                    self._seen = None

    def look(self, sweeps: int) -> None:
        self._feed.look(look(plan_demo(), sweeps))

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
                if self._seen is None:
                    continue
                if not self.repeating.is_set():
                    self._seen, self._samples = later(self._seen), more(self._samples)
                    self.times += 1
                if self._samples is not None:
                    self._feed.event(self._samples)
                self._feed.event(self._seen)


def goes_on(state: ArmSeen | HandSeen) -> bool:
    """Return whether more events follow: an arm's program runs, a servo is held, or a hand is used."""
    return not (
        isinstance(state, ArmSeen)
        and isinstance(state.state, ArmState)
        and state.state.runtime_state != RuntimeState.PLAYING
    )


def later(latest: ArmSeen | HandSeen) -> ArmSeen | HandSeen:
    """Return the same state a moment later."""
    if isinstance(latest, HandSeen):
        return replace(latest, time_s=latest.time_s + AGAIN_S)
    state: Any = latest.state
    return replace(latest, state=replace(state, time_s=state.time_s + AGAIN_S))


def more(samples: SamplesTaken | None) -> SamplesTaken | None:
    """Return one more sample of each sensor with the same reading."""
    if samples is None:
        return None
    return SamplesTaken(tuple(replace(sensor, samples=sensor.samples + 1) for sensor in samples.sensors))


@contextmanager
def showing(
    driver: Chrome, folder: Path, *, token: bool = True, may_answer: bool = True, about: About = ABOUT
) -> Iterator[Telling]:
    """Yield a page that has been loaded and has received no events yet."""
    feed = Feed(PageState(replace(about, may_answer=may_answer)))
    with serving(feed, Control(may_answer=may_answer), folder, PageAddress(port=0)) as url:
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
    """Serve a page, print its address, and send it movements without end."""
    feed = Feed(PageState(ABOUT))
    with (
        tempfile.TemporaryDirectory() as folder,
        serving(feed, Control(may_answer=False), Path(folder), PageAddress(port=0)) as url,
    ):
        print(url, flush=True)
        for _ in count():
            events: list[RunEvent] = [*before_it_moves(plan_demo()), *moving(plan_demo(), 60.0)]
            for event in events:
                feed.event(event)
                if isinstance(event, Progress):
                    time.sleep(0.05)


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))
    main()
