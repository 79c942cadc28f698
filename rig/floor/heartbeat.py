"""A station's heartbeat, which writes the station's state to a shared history, in a thread that delays nothing.

If the history does not answer, the thread tries again. The station works without the history, and meanwhile the floor
shows the station as silent.
"""

import platform
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rig.batch.status import Now, last
from rig.history import stations
from rig.history.storage.address import HistoryAddress
from rig.history.store import open_history

if TYPE_CHECKING:
    from sqlalchemy import Engine

HEARTBEAT_S = 1.0
RETRY_S = 5.0  # wait after a history that did not answer
LAST_STATE_S = 2.0  # time for writing the last state


class Heartbeat:
    """The writer of a station's state."""

    def __init__(self, rig: str, address: HistoryAddress, now: Now) -> None:
        self._rig, self._address, self._now = rig, address, now
        self._changed = threading.Event()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="heartbeat", daemon=True)

    def hear(self, now: Now) -> None:
        """Handle a change of the station; write a new state at once."""
        news = now.state != self._now.state or now.part != self._now.part
        self._now = now
        if news:
            self._changed.set()

    def start(self) -> None:
        """Start writing."""
        self._thread.start()

    def close(self) -> None:
        """Write the last state, and end."""
        self._now = last(self._now)
        self._over.set()
        self._changed.set()
        self._thread.join(LAST_STATE_S)

    def _beat(self) -> None:
        """Write the state again and again until the station ends; open the history again after an error."""
        while True:
            try:
                with open_history(self._address) as history:
                    stations.make_table(history.engine)
                    if self._write_until_over(history.engine):
                        return
            except Exception:  # any error: no part of the station depends on it
                if self._over.wait(RETRY_S):
                    return

    def _write_until_over(self, engine: "Engine") -> bool:
        """Write the station's state regularly, and at once after a change; return True after the last state."""
        while True:
            over = self._over.is_set()
            self._changed.clear()
            stations.tell(engine, self._rig, platform.node(), self._now.json())
            if over:
                return True
            self._changed.wait(HEARTBEAT_S)


@contextmanager
def heartbeat(rig: str, address: HistoryAddress, now: Now) -> Iterator[Heartbeat]:
    """Send the heartbeat of a station on a `rig` during the block; a killed process leaves no last state."""
    beating = Heartbeat(rig, address, now)
    beating.start()
    try:
        yield beating
    finally:
        beating.close()
