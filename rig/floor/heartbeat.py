"""A station's heartbeat: tells a shared history what it does, from a thread of its own that holds nothing up.

A history that does not answer is tried again; a station works on without it, and the floor sees that it is silent.
"""

import platform
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rig.batch.status import Now, last
from rig.history import stations
from rig.history.storage.address import Place
from rig.history.store import open_history

if TYPE_CHECKING:
    from sqlalchemy import Engine

BEAT_S = 1.0
AGAIN_S = 5.0  # after the history has not answered
LAST_BEAT_S = 2.0  # that the last word may take


class Heartbeat:
    """What the station says of itself."""

    def __init__(self, rig: str, place: Place, now: Now) -> None:
        self._rig, self._place, self._now = rig, place, now
        self._changed = threading.Event()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="heartbeat", daemon=True)

    def hear(self, now: Now) -> None:
        """What the station does has changed; a new state is told at once."""
        news = now.state != self._now.state or now.part != self._now.part
        self._now = now
        if news:
            self._changed.set()

    def start(self) -> None:
        """Begin to tell."""
        self._thread.start()

    def close(self) -> None:
        """Tell the last state, and end."""
        self._now = last(self._now)
        self._over.set()
        self._changed.set()
        self._thread.join(LAST_BEAT_S)

    def _beat(self) -> None:
        while True:
            try:
                with open_history(self._place) as history:
                    stations.make_table(history.engine)
                    if self._tells(history.engine):
                        return
            except Exception:  # whatever it is, nothing of the station depends on it
                if self._over.wait(AGAIN_S):
                    return

    def _tells(self, engine: "Engine") -> bool:
        """Tell until it is over, which is True then."""
        while True:
            over = self._over.is_set()
            self._changed.clear()
            stations.tell(engine, self._rig, platform.node(), self._now.json())
            if over:
                return True
            self._changed.wait(BEAT_S)


@contextmanager
def heartbeat(rig: str, place: Place, now: Now) -> Iterator[Heartbeat]:
    """The heartbeat of a station on a `rig` for the length of the `with` block; a killed one just stops."""
    beating = Heartbeat(rig, place, now)
    beating.start()
    try:
        yield beating
    finally:
        beating.close()
