"""What a page shows, by sections: each is anything that JSON knows, put there whole. For pages that are no run's."""

import threading
from typing import Any

from rig.page.server.feed import frame_of


class Sections:
    """What is shown, between the thread that puts it and the server's."""

    ended = False

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._shown: dict[str, Any] = {}
        self._changed: dict[str, Any] = {}

    def put(self, **sections: Any) -> None:
        """Show sections; what is as before is no news."""
        with self._lock:
            for name, section in sections.items():
                if name not in self._shown or self._shown[name] != section:
                    self._shown[name] = self._changed[name] = section

    def whole(self) -> bytes:
        """Everything, for a browser that has nothing yet."""
        with self._lock:
            return frame_of("all", self._shown)

    def news(self) -> bytes | None:
        """What has changed since the last time, None if nothing has."""
        with self._lock:
            changed, self._changed = self._changed, {}
        return frame_of("some", changed) if changed else None
