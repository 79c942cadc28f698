"""Sockets around sessions: a listener for each port, a connection for each client, one selector for all."""

import selectors
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from math import inf
from typing import Protocol

from rig.errors import Refused
from rig.world.clock import TICK_S
from rig.world.wire import SocketTable, Wire

BACKLOG_BYTES = 1 << 16  # a client that does not read loses packages beyond this
UNPACED = inf  # the lag of a client that nobody waits for
ALONE_S = 0.3  # wall time after which a client's next question follows from no answer before it
GATHER_S = 0.002  # wall time for which a gathering wire keeps bytes together while the world has more to do


class Session(Protocol):
    """What one client talks to: bytes in, bytes out, and a turn at every tick."""

    @property
    def closing(self) -> bool:
        """Close the connection once everything has been sent."""
        ...

    @property
    def dialogue(self) -> bool:
        """Whether a client speaks with it by question and answer, each waiting for the one before."""

    def greeting(self) -> bytes: ...
    def receive(self, data: bytes) -> bytes: ...
    def tick(self) -> bytes: ...
    def closed(self) -> None: ...


class Connection:
    """One accepted client."""

    def __init__(self, network: "Network", peer: socket.socket, session: Session, listener: "Listener") -> None:
        self._network, self._peer, self.session, self.listener = network, peer, session, listener
        self._unsent = bytearray()
        self.due = b""  # what ticks made for this client and its wire does not take yet
        self._delivered_s = 0.0  # wall time
        self._ticks = 0
        self._wire = Wire(network.sockets.unread(peer), listener.lag_s, time.monotonic)
        self._asked_s = time.monotonic()  # or accepted
        peer.setblocking(False)
        with suppress(OSError):
            peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.wait_s = 0.0  # that the last `deliver` asked for
        self._watched = 0  # the events the selector looks for

    @property
    def client(self) -> str:
        """Who it is, in words."""
        try:
            (host, port), (_, own_port) = self._peer.getpeername(), self._peer.getsockname()
        except OSError:
            return "a client that has hung up"
        return f"client {host}:{port} of port {own_port}"

    def greet(self) -> None:
        self.watch()
        self.send(self.session.greeting())

    def ready(self, events: int) -> None:
        if events & selectors.EVENT_WRITE:
            self._flush()
        if events & selectors.EVENT_READ:
            self.read()

    def read(self) -> bool:
        """Take what the client has said, and close when it has hung up; whether there may be more."""
        try:
            data = self._peer.recv(65536)
        except BlockingIOError:
            return False
        except OSError:
            data = b""
        if not data:
            self.close()
            return False
        asked_s, self._asked_s = self._asked_s, time.monotonic()
        if self.session.dialogue and self._asked_s - asked_s < ALONE_S:
            self._network.on_dialogue()
        self.send(self.session.receive(data))
        if self.session.closing:  # which `send` does not see when there is nothing to say
            self.watch()
            return False
        return True

    def tick(self) -> None:
        """The session's turn; what it has to say goes out as soon as `deliver` finds the wire free."""
        self._ticks += 1
        self.due = (b"" if self.listener.silent else self.due) + self.session.tick()

    def deliver(self, idle: bool, patient: bool) -> float:
        """Send what ticks made, unless `patient` and the client is too far behind: then the wall time to wait."""
        if self.listener.silent:
            return 0.0
        if self.listener.gathers and not idle and time.monotonic() - self._delivered_s < GATHER_S:
            return 0.0
        wait_s = self.wait_s = self._wire.wait_s(self._ticks * TICK_S) if patient else 0.0
        if wait_s <= 0.0:
            due, self.due = self.due, b""
            self._delivered_s = time.monotonic()
            self.send(due)
        return wait_s

    def send(self, data: bytes) -> None:
        """Send as much as goes now, keep the rest; whole packages are dropped when the client does not read."""
        if not data or self.listener.silent:
            return
        self._wire.sent(self._ticks * TICK_S)
        if not self._unsent:
            try:
                sent = self._peer.send(data)
            except BlockingIOError:
                sent = 0
            except OSError:
                return  # it has hung up; reading meets that after what it said before
            data = data[sent:]
        if data and len(self._unsent) < BACKLOG_BYTES:
            self._unsent += data
        self.watch()

    def _flush(self) -> None:
        try:
            sent = self._peer.send(self._unsent)
        except BlockingIOError:
            return
        except OSError:
            sent = len(self._unsent)
        del self._unsent[:sent]
        self.watch()

    def watch(self) -> None:
        """Look for what this connection waits for now."""
        if self.session.closing and not self._unsent:
            self.close()
            return
        events = (selectors.EVENT_READ | (selectors.EVENT_WRITE if self._unsent else 0)) * (not self.listener.silent)
        if events == self._watched:
            return
        selector = self._network.selector
        if self._watched and events:
            selector.modify(self._peer, events, self.ready)
        elif events:
            selector.register(self._peer, events, self.ready)
        else:
            selector.unregister(self._peer)
        self._watched = events

    def close(self) -> None:
        if self in self._network.connections:
            self._network.connections.remove(self)
            if self._watched:
                self._network.selector.unregister(self._peer)
            self._peer.close()
            self.session.closed()


class Listener:
    """A port that listens. `limit` bounds the clients at a time: further ones are hung up on at once.

    A client may be `lag_s` of the world's time behind before the world waits for it. While the world has more to do, a
    port that `gathers` hands on several ticks' bytes in one go, as a USB adapter does: every packet wakes its reader.
    """

    def __init__(
        self,
        network: "Network",
        address: tuple[str, int],
        new_session: Callable[[], Session],
        *,
        limit: int,
        lag_s: float,
        gathers: bool,
    ) -> None:
        self._network, self._address = network, address
        self.port = address[1]
        self._new_session, self._limit, self.lag_s, self.gathers = new_session, limit, lag_s, gathers
        self.silent = False
        self._socket: socket.socket | None = None
        self.open()

    @property
    def connections(self) -> list[Connection]:
        return [connection for connection in self._network.connections if connection.listener is self]

    def open(self) -> None:
        """Start listening. Raises `Refused` when the address cannot be had."""
        if self._socket is not None:
            return
        host, port = self._address
        listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind(self._address)
            listening.listen(16)
        except OSError as error:
            listening.close()
            raise Refused(
                "port_in_use",
                f"the simulated laboratory cannot listen on {host}:{port} ({error.strerror})",
                "Give it a port above 1023, a PolyScope X's in arm.robot_api_port"
                if isinstance(error, PermissionError)
                else "End the other simulation, or give this one another loopback address in arm.host and board.port",
            ) from None
        listening.setblocking(False)
        self._network.selector.register(listening, selectors.EVENT_READ, self._accept)
        self._socket = listening

    def _accept(self, events: int) -> None:
        if self._socket is None:  # closed while this event was waiting
            return
        try:
            peer, _ = self._socket.accept()
        except OSError:
            return
        for connection in self.connections:
            while not self.silent and connection.read():  # its end may be known only after this one's beginning
                pass
        if len(self.connections) >= self._limit:
            peer.close()
            return
        connection = Connection(self._network, peer, self._new_session(), self)
        self._network.connections.append(connection)
        connection.greet()

    def set_silent(self, silent: bool) -> None:
        """Let a silent port send and read nothing; the connections stay open."""
        self.silent = silent
        for connection in self.connections:
            connection.watch()

    def hang_up(self) -> None:
        """Close every connection; go on listening."""
        for connection in self.connections:
            connection.close()

    def close(self) -> None:
        """Close every connection and stop listening."""
        self.hang_up()
        if self._socket is not None:
            self._network.selector.unregister(self._socket)
            self._socket.close()
            self._socket = None


class Network:
    """All listeners of the world. `on_dialogue` is called whenever a client has asked something."""

    def __init__(self, on_dialogue: Callable[[], None]) -> None:
        self.on_dialogue = on_dialogue
        # select() waits to the microsecond; epoll rounds up to whole milliseconds, which sends packets in bursts
        # when virtual time runs faster, and a client that keeps only the newest packet then misses some.
        self.selector = selectors.SelectSelector()
        self.sockets = SocketTable()
        self.listeners: list[Listener] = []
        self.connections: list[Connection] = []

    def listen(
        self,
        host: str,
        port: int,
        new_session: Callable[[], Session],
        *,
        limit: int = 16,
        lag_s: float = UNPACED,
        gathers: bool = False,
    ) -> Listener:
        listener = Listener(self, (host, port), new_session, limit=limit, lag_s=lag_s, gathers=gathers)
        self.listeners.append(listener)
        return listener

    def poll(self, timeout_s: float | None) -> None:
        """Serve whatever the sockets have; wait at most `timeout_s` for the first."""
        for key, events in self.selector.select(timeout_s):
            key.data(events)

    def tick(self) -> None:
        """Give every session its turn."""
        for connection in tuple(self.connections):
            connection.tick()

    def deliver(self, idle: bool = True, patient: bool = True) -> float:
        """Send what ticks made to every client whose wire is free; the wall time to wait for the others.

        A tick is over when this returns 0. `idle`: the next one is not due yet, so that nothing is gathered any longer.
        `patient`: clients that are behind are waited for, as no real controller and no real board does.
        """
        due = [connection for connection in self.connections if connection.due]
        return max([connection.deliver(idle, patient) for connection in due], default=0.0)

    def waited_for(self) -> str:
        """The clients that are behind, in words; any thread may ask."""
        behind = [connection.client for connection in tuple(self.connections) if connection.wait_s > 0.0]
        return ", ".join(behind) or "no client"

    def close(self) -> None:
        for listener in self.listeners:
            listener.close()
        self.selector.close()
        self.sockets.close()
