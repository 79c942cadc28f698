"""The connections to the page: how many there may be, for how long without a request, and which gives way to another.

Every one takes a descriptor of the process that moves the arm, and anybody on this computer can open one. Those that
have not shown the token are strangers: one too many closes the oldest of the address that has the most.
"""

import asyncio
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from uvicorn.protocols.http.h11_impl import H11Protocol

STRANGERS = 96  # connections that have not shown the token
KNOWN = 64  # connections that have
REQUEST_S = 5.0  # within which a whole request's headers are there
Client = tuple[str, int]  # address and port


class Connections:
    """The connections of one server, all in its event loop."""

    def __init__(self, request_s: float = REQUEST_S) -> None:
        self._request_s = request_s
        self._strangers: dict[Client, asyncio.WriteTransport] = {}  # the oldest first
        self._known: dict[Client, asyncio.WriteTransport] = {}
        self._deadlines: dict[Client, asyncio.TimerHandle] = {}

    def made(self, client: Client, transport: asyncio.WriteTransport) -> None:
        """A connection is there; where there are too many, another is closed for it."""
        if len(self._strangers) >= STRANGERS:
            most = Counter(address for address, _ in self._strangers).most_common(1)[0][0]
            oldest = next(each for each in self._strangers if each[0] == most)
            self._strangers[oldest].abort()
            self.lost(oldest)
        self._strangers[client] = transport
        self._limit(client, transport)

    def lost(self, client: Client) -> None:
        """Forget a client that is gone, or as good as gone."""
        self._strangers.pop(client, None)
        self._known.pop(client, None)
        if (deadline := self._deadlines.pop(client, None)) is not None:
            deadline.cancel()

    @contextmanager
    def answering(self, client: Client, *, known: bool) -> Iterator[None]:
        """A request of it has come whole, and is answered in this block."""
        if (deadline := self._deadlines.pop(client, None)) is not None:
            deadline.cancel()
        if known and len(self._known) < KNOWN and client in self._strangers:
            self._known[client] = self._strangers.pop(client)
        try:
            yield
        finally:
            transport = self._strangers.get(client) or self._known.get(client)
            if transport is not None:
                self._limit(client, transport)

    def _limit(self, client: Client, transport: asyncio.WriteTransport) -> None:
        self._deadlines[client] = asyncio.get_running_loop().call_later(self._request_s, transport.abort)


def counted(connections: Connections) -> "type[H11Protocol]":
    """The server's protocol, whose connections are counted."""
    from uvicorn.protocols.http.h11_impl import H11Protocol

    class Counted(H11Protocol):
        _peer: Client

        def connection_made(self, transport: Any) -> None:
            self._peer = client_of(transport.get_extra_info("peername"))
            connections.made(self._peer, transport)
            super().connection_made(transport)

        def connection_lost(self, exc: Exception | None) -> None:
            connections.lost(self._peer)
            super().connection_lost(exc)

    return Counted


def client_of(peer: Any) -> Client:
    """Address and port, of a socket's peer (an IPv6 one has more) or of what ASGI tells; nobody's when it has gone."""
    return (str(peer[0]), int(peer[1])) if peer else ("", 0)
