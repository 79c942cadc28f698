"""The content of a page that does not show a run: sections, each a JSON value that is replaced as a unit."""

import threading
from typing import Any

from rig.page.server.feed import frame_of


class Sections:
    """The page's content, which one thread changes and the server's thread reads."""

    ended = False

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._shown: dict[str, Any] = {}
        self._changed: dict[str, Any] = {}

    def put(self, **sections: Any) -> None:
        """Replace sections; only changed sections are sent."""
        with self._lock:
            for name, section in sections.items():
                if name not in self._shown or self._shown[name] != section:
                    self._shown[name] = self._changed[name] = section

    def whole(self) -> bytes:
        """Return the complete content, for a new browser."""
        with self._lock:
            return frame_of("all", self._shown)

    def news(self) -> bytes | None:
        """Return the changes since the last call; None without changes."""
        with self._lock:
            changed = self._changed
            self._changed = {}
        return frame_of("some", changed) if changed else None
