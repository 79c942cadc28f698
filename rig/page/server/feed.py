"""The feed from the run's thread to any number of browsers, which cannot delay it.

The run's thread changes the page's state and continues. The server's thread builds a frame of the changes ten times a
second and puts it into each browser's mailbox, which holds one frame. A browser that has not taken its last frame gets
none; later it gets the complete state.
"""

import asyncio
import json
import threading
import time
from collections.abc import AsyncGenerator, Callable
from typing import Any, Protocol

from rig.page.arrivals import Arrivals
from rig.page.page_state import PageState
from rig.page.rows import Look
from rig.station.events import RunEvent

FRAME_S = 0.1
HEARTBEAT_S = 0.8  # interval of messages if there is no news: a browser reports silence after 2 s
MAX_CLIENTS = 32  # browsers with the token
MAX_STRANGERS = 16  # browsers without the token


class Source(Protocol):
    """The content of a page: all of it, and its changes since the last request."""

    @property
    def ended(self) -> bool: ...

    def whole(self) -> bytes: ...

    def news(self) -> bytes | None: ...


class Feed:
    """The page's state, which the run's thread changes and the server's thread reads; a listener of the run's events.

    Every frame states how old its contents are.
    """

    def __init__(self, shown: PageState, now: Callable[[], float] = time.monotonic) -> None:
        self._shown, self._now = shown, now
        self._arrivals = Arrivals()
        self._lock = threading.Lock()
        self._sent = 0  # number of points already sent
        self._seen_at = ""  # wall-clock time of the last arrival, for people

    def event(self, event: RunEvent) -> None:
        """Change the state by an event without waiting."""
        with self._lock:
            before = self._shown.ended
            self._shown.take(event)
            if self._arrivals.take(event, self._now()):
                self._seen_at = _clock()
            if self._shown.ended and not before:
                self._shown.put("ended", {"at": _clock(), "seen_at": self._seen_at})

    def look(self, look: Look) -> None:
        """Show the analysis of the recording so far; any thread may call this."""
        with self._lock:
            self._shown.look(look)

    @property
    def ended(self) -> bool:
        """Whether the run is over."""
        return self._shown.ended

    def whole(self) -> bytes:
        """Return the complete state, for a new browser."""
        with self._lock:
            points = self._shown.history.since(0)
            return frame_of("all", {**self._shown.sections, "points": points, "age_s": self._ages_s()})

    def news(self) -> bytes | None:
        """Return the changes since the last call; None without changes."""
        with self._lock:
            shown = self._shown
            changed = shown.changed()
            if not changed and shown.history.end == self._sent:
                return None
            points = shown.history.since(self._sent)
            self._sent = shown.history.end
            return frame_of("some", {**changed, "points": points, "age_s": self._ages_s()})

    def _ages_s(self) -> dict[str, float]:
        return self._arrivals.ages_s(self._now())


class Mailbox:
    """A browser's mailbox: room for one frame."""

    def __init__(self) -> None:
        self._frame: bytes | None = None
        self._behind = True  # nothing has been sent yet
        self._news = asyncio.Event()
        self._news.set()
        self.closed = False

    def put(self, frame: bytes) -> None:
        """Store a frame. If the last one was not taken yet, drop both; `take` then returns the complete state."""
        self._behind = self._behind or self._frame is not None
        self._frame = None if self._behind else frame
        self._news.set()

    def close(self) -> None:
        """Close the mailbox; frames in it can still be taken."""
        self.closed = True
        self._news.set()

    async def take(self, feed: Source) -> bytes | None:
        """Return the next frame, or the complete state after a dropped one; None if closed and empty."""
        if not self.closed:
            await self._news.wait()
            self._news.clear()
        if self._behind:
            self._behind = False
            return feed.whole()
        frame, self._frame = self._frame, None
        return frame


class Broadcast:
    """The distribution of frames to the browsers' mailboxes, which runs only in the server's event loop."""

    def __init__(self, feed: Source) -> None:
        self._feed = feed
        self._mailboxes: dict[Mailbox, bool] = {}  # whether its browser has the token
        self._closing = False

    def full(self, *, has_token: bool) -> bool:
        """Return whether no further browser is admitted; the limits with and without the token are separate."""
        return sum(trusted == has_token for trusted in self._mailboxes.values()) >= (
            MAX_CLIENTS if has_token else MAX_STRANGERS
        )

    @property
    def over(self) -> bool:
        """Whether the run is over."""
        return self._feed.ended

    def post(self, frame: bytes) -> None:
        """Send one frame to all browsers."""
        for mailbox in self._mailboxes:
            mailbox.put(frame)

    async def run(self) -> None:
        """Send news ten times a second, until `close`."""
        idle_s = 0.0
        while not self._closing:
            await asyncio.sleep(FRAME_S)
            frame = self._feed.news()
            idle_s = 0.0 if frame is not None else idle_s + FRAME_S
            if frame is None and idle_s >= HEARTBEAT_S:
                frame, idle_s = b": here\n\n", 0.0
            if frame is not None:
                self.post(frame)

    async def close(self, within_s: float) -> None:
        """Send the last changes, and wait at most `within_s` until all browsers have received them."""
        self._closing = True
        if (frame := self._feed.news()) is not None:
            self.post(frame)
        for mailbox in self._mailboxes:
            mailbox.close()
        deadline_s = asyncio.get_running_loop().time() + within_s
        while self._mailboxes and asyncio.get_running_loop().time() < deadline_s:
            await asyncio.sleep(FRAME_S / 4)

    async def frames(self, *, has_token: bool = True) -> AsyncGenerator[bytes, None]:
        """Yield the frames for one browser, with or without the token: the complete state, then changes."""
        mailbox = Mailbox()
        self._mailboxes[mailbox] = has_token
        if self._closing:
            mailbox.close()
        try:
            while True:
                frame = await mailbox.take(self._feed)
                if frame is not None:
                    yield frame
                elif mailbox.closed:
                    return
        finally:
            self._mailboxes.pop(mailbox, None)


def _clock() -> str:
    return time.strftime("%H:%M:%S")


def frame_of(name: str, document: dict[str, Any]) -> bytes:
    """Return a server-sent event. JSON has no NaN, which becomes null; invalid characters become "?"."""
    try:
        text = json.dumps(document, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    except ValueError:
        text = json.dumps(_finite(document), ensure_ascii=False, separators=(",", ":"))
    return f"event: {name}\ndata: {text}\n\n".encode(errors="replace")


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    return [_finite(item) for item in value] if isinstance(value, (list, tuple)) else value
