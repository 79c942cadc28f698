"""Connections to the page: their number, their time-outs, and the one to close if there are too many.

A connection takes a descriptor of the process that moves the arm, and anyone on this computer can open one. Connections
without the token are strangers. If there are too many strangers, the address with the most of them loses its oldest
connection.
"""

import asyncio
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from uvicorn.protocols.http.h11_impl import H11Protocol

MAX_STRANGERS = 96  # connections that have not shown the token
MAX_TRUSTED = 64  # connections that have
MAX_REQUEST_S = 5.0  # for the complete headers of a request
Client = tuple[str, int]  # address and port


class Connections:
    """The connections of one server, all in its event loop."""

    def __init__(self, request_s: float = MAX_REQUEST_S) -> None:
        self._request_s = request_s
        self._strangers: dict[Client, asyncio.WriteTransport] = {}  # the oldest first
        self._trusted: dict[Client, asyncio.WriteTransport] = {}
        self._deadlines: dict[Client, asyncio.TimerHandle] = {}

    def add(self, client: Client, transport: asyncio.WriteTransport) -> None:
        """Add a connection; if there are too many without the token, close an older one of these."""
        if len(self._strangers) >= MAX_STRANGERS:
            most = Counter(address for address, _ in self._strangers).most_common(1)[0][0]
            oldest = next(client for client in self._strangers if client[0] == most)
            self._strangers[oldest].abort()
            self.lost(oldest)
        self._strangers[client] = transport
        self._limit(client, transport)

    def lost(self, client: Client) -> None:
        """Remove a client that has gone."""
        self._strangers.pop(client, None)
        self._trusted.pop(client, None)
        if (deadline := self._deadlines.pop(client, None)) is not None:
            deadline.cancel()

    @contextmanager
    def answering(self, client: Client, *, has_token: bool) -> Iterator[None]:
        """Suspend a client's time limit while its request is answered; a client with the token becomes trusted."""
        if (deadline := self._deadlines.pop(client, None)) is not None:
            deadline.cancel()
        if has_token and len(self._trusted) < MAX_TRUSTED and client in self._strangers:
            self._trusted[client] = self._strangers.pop(client)
        try:
            yield
        finally:
            transport = self._strangers.get(client) or self._trusted.get(client)
            if transport is not None:
                self._limit(client, transport)

    def _limit(self, client: Client, transport: asyncio.WriteTransport) -> None:
        self._deadlines[client] = asyncio.get_running_loop().call_later(self._request_s, transport.abort)


def counting_protocol(connections: Connections) -> "type[H11Protocol]":
    """Return a protocol for the server that counts its connections."""
    from uvicorn.protocols.http.h11_impl import H11Protocol

    class Counted(H11Protocol):
        _peer: Client

        def connection_made(self, transport: Any) -> None:
            self._peer = client_of(transport.get_extra_info("peername"))
            connections.add(self._peer, transport)
            super().connection_made(transport)

        def connection_lost(self, exc: Exception | None) -> None:
            connections.lost(self._peer)
            super().connection_lost(exc)

    return Counted


def client_of(peer: Any) -> Client:
    """Return a peer's address and port, from a socket or ASGI (IPv6 has more fields); empty if the peer has gone."""
    return (str(peer[0]), int(peer[1])) if peer else ("", 0)
