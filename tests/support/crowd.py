"""How busy this machine was while a limit ran: what is late may be late by that, and a limit says nothing beyond it."""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rig.data.silence import crowding
from support.waiting import wait_for

LOOK_S = 0.02


class Crowd:
    """The greatest `crowding` so far, and for how long whoever looked was held up itself."""

    def __init__(self) -> None:
        self.greatest, self.held_up_s = crowding(), 0.0

    def look(self, late_s: float) -> None:
        """Once more, so much later than was meant."""
        self.greatest = max(self.greatest, crowding())
        self.held_up_s += late_s

    def stretched(self, limit_s: float) -> float:
        """A limit of a quiet machine: the rig stretches its own by the crowd, and the crowd holds up what follows."""
        return limit_s * self.greatest**2 + self.held_up_s


@contextmanager
def watched_crowd() -> Iterator[Crowd]:
    """Looks at the machine all the time inside."""
    crowd, over = Crowd(), threading.Event()

    def watch() -> None:
        before_s = time.monotonic()
        while not over.wait(LOOK_S):
            now_s = time.monotonic()
            crowd.look(now_s - before_s - LOOK_S)
            before_s = now_s

    watching = threading.Thread(target=watch, name="crowd", daemon=True)
    watching.start()
    try:
        yield crowd
    finally:
        over.set()
        watching.join()


def soon(condition: Callable[[], object], what: str, limit_s: float) -> None:
    """Wait until `condition` is true, which on a quiet machine it is within `limit_s`."""
    began_s = time.monotonic()
    with watched_crowd() as crowd:
        wait_for(condition, what)
    assert time.monotonic() - began_s < crowd.stretched(limit_s), f"it took too long: {what}"


def has_the_machine() -> bool:
    """Whether nobody else is busy on this machine, or only those who come after this process."""
    return os.nice(0) < 0 or os.getloadavg()[0] <= (os.cpu_count() or 1)


@contextmanager
def timed(limit_s: float, times: list[tuple[float, float]]) -> Iterator[None]:
    """Adds to `times` how long what is inside took, and how long it may: `limit_s`, or more on a crowded machine."""
    began_s = time.monotonic()
    with watched_crowd() as crowd:
        yield
    times.append((time.monotonic() - began_s, limit_s if has_the_machine() else crowd.stretched(limit_s)))


def kept(times: list[tuple[float, float]]) -> bool:
    """Whether each of these is as short as it has to be."""
    return all(took_s <= limit_s for took_s, limit_s in times)


def told(times: list[tuple[float, float]]) -> str:
    """The times in words."""
    return ", ".join(f"{took_s:.2f} s (limit {limit_s:.1f})" for took_s, limit_s in times)
