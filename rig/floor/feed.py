"""The floor's page as its server is handed it: the history is looked at every second, in a thread of its own."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import func, select

from rig.errors import Refused
from rig.floor import shown
from rig.history import schema, stations
from rig.history.place import Place
from rig.history.store import History, open_history
from rig.page.feed import frame_of

LOOK_S = 1.0


class FloorFeed:
    """All that is shown; `history` says whether it answers."""

    ended = False

    def __init__(self, label: str) -> None:
        self._lock = threading.Lock()
        self._shown: dict[str, Any] = {"history": {"label": label, "silent": None}}
        self._changed: dict[str, Any] = {}

    def put(self, sections: dict[str, Any]) -> None:
        """Show sections; what is as before is no news."""
        with self._lock:
            for name, section in sections.items():
                if self._shown.get(name) != section:
                    self._shown[name] = self._changed[name] = section

    def silent(self, why: str | None) -> None:
        """The history does not answer, and why; None when it does."""
        self.put({"history": {**self._shown["history"], "silent": why}})

    def whole(self) -> bytes:
        """Everything, for a browser that has nothing yet."""
        with self._lock:
            return frame_of("all", self._shown)

    def news(self) -> bytes | None:
        """What has changed since the last time, None if nothing has."""
        with self._lock:
            changed, self._changed = self._changed, {}
        return frame_of("some", changed) if changed else None


@contextmanager
def looking(place: Place) -> Iterator[FloorFeed]:
    """A feed that is kept up to date for the length of the `with` block; the history is only read."""
    feed, over = FloorFeed(place.label), threading.Event()
    thread = threading.Thread(target=_look, args=(place, feed, over), name="floor", daemon=True)
    thread.start()
    try:
        yield feed
    finally:
        over.set()
        thread.join(LOOK_S)


def _look(place: Place, feed: FloorFeed, over: threading.Event) -> None:
    while not over.is_set():
        try:
            with open_history(place) as history:
                _follow(history, feed, over)
        except Exception as error:  # the page says it, and goes on trying
            feed.silent(error.what if isinstance(error, Refused) else f"{type(error).__name__}: {error}")
            over.wait(LOOK_S)


def _follow(history: History, feed: FloorFeed, over: threading.Event) -> None:
    before: Any = None
    while not over.is_set():
        today = datetime.now(UTC).date()
        feed.put({"rigs": shown.rigs(stations.heard(history.engine))})
        entered = today, _entered(history)
        if entered != before:  # trends of a long history take longer than a second
            before, pasts = entered, history.calibrations()
            feed.put(
                {
                    "today": shown.todays(pasts, today),
                    "standards": shown.standards(pasts),
                    "recalls": shown.recalls(pasts, today),
                }
            )
        feed.silent(None)
        over.wait(LOOK_S)


def _entered(history: History) -> tuple[int, int]:
    """What tells whether anything was entered: rows are only added."""
    counts = (select(func.count()).select_from(table) for table in (schema.calibration, schema.voided))
    with history.engine.connect() as connection:
        calibrations, voided = (int(connection.scalar(question) or 0) for question in counts)
    return calibrations, voided
