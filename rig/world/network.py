"""The sockets of the world's sessions: one listener for each port, one connection for each client, one selector."""

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

BACKLOG_BYTES = 1 << 16  # bytes that a client may leave unread before it loses packages
UNPACED_LAG = inf  # lag of a client for which the world does not wait
INDEPENDENCE_S = 0.3  # wall time after which a client's question no longer depends on the last answer
GATHER_S = 0.002  # wall time for which a gathering port collects bytes while more ticks are due


class ClientSession(Protocol):
    """The world's side of one connection: bytes in, bytes out, and a call at every tick."""

    @property
    def closing(self) -> bool:
        """Whether to close the connection once everything has been sent."""
        ...

    @property
    def dialogue(self) -> bool:
        """Whether each of the client's questions depends on the previous answer."""

    def greeting(self) -> bytes: ...
    def receive(self, data: bytes) -> bytes: ...
    def tick(self) -> bytes: ...
    def handle_close(self) -> None: ...


class ClientConnection:
    """The connection of one accepted client."""

    def __init__(self, network: "Network", peer: socket.socket, session: ClientSession, port: "PortListener") -> None:
        self._network, self._peer, self.session, self.listener = network, peer, session, port
        self._unsent = bytearray()
        self.due = b""  # bytes of past ticks that the client's wire cannot take yet
        self._delivered_s = 0.0  # wall time
        self._ticks = 0
        self._wire = Wire(network.sockets.count_unread(peer), port.lag_s, time.monotonic)
        self._last_read_s = time.monotonic()
        peer.setblocking(False)
        with suppress(OSError):
            peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.wait_s = 0.0  # the wait that the last `deliver` returned
        self._watched = 0  # the selector's events

    @property
    def client(self) -> str:
        """The client's address in words."""
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
        """Read the client's bytes; close the connection if the client has closed it. Return whether more may come."""
        try:
            data = self._peer.recv(65536)
        except BlockingIOError:
            return False
        except OSError:
            data = b""
        if not data:
            self.close()
            return False
        last_read_s, self._last_read_s = self._last_read_s, time.monotonic()
        if self.session.dialogue and self._last_read_s - last_read_s < INDEPENDENCE_S:
            self._network.on_dialogue()
        self.send(self.session.receive(data))
        if self.session.closing:  # `send` does not check this if there is nothing to send
            self.watch()
            return False
        return True

    def tick(self) -> None:
        """Simulate a tick of the session and queue the bytes that it sends; `deliver` sends them."""
        self._ticks += 1
        self.due = (b"" if self.listener.silent else self.due) + self.session.tick()

    def deliver(self, idle: bool, patient: bool) -> float:
        """Send the bytes of past ticks, unless `patient` is set and the client lags too far.

        Return the wall time to wait for the client, s; 0 if it does not lag too far, or if not `patient`. `idle` is as
        in `Network.deliver`.
        """
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
        """Send as much as possible now and keep the rest. Drop whole packages if the client does not read."""
        if not data or self.listener.silent:
            return
        self._wire.record_send(self._ticks * TICK_S)
        if not self._unsent:
            try:
                written = self._peer.send(data)
            except BlockingIOError:
                written = 0
            except OSError:
                return  # it has hung up; `read` notices that after the client's last bytes
            data = data[written:]
        if data and len(self._unsent) < BACKLOG_BYTES:
            self._unsent += data
        self.watch()

    def _flush(self) -> None:
        try:
            written = self._peer.send(self._unsent)
        except BlockingIOError:
            return
        except OSError:
            written = len(self._unsent)
        del self._unsent[:written]
        self.watch()

    def watch(self) -> None:
        """Tell the selector which events this connection waits for; close it if its session ends and all is sent."""
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
            self.session.handle_close()


class PortListener:
    """A listening port. At most `limit` clients are connected at a time; a further client is disconnected at once.

    A client may lag `lag_s` of virtual time before the world waits for it. While more ticks are due, a port that
    `gathers` sends the bytes of several ticks together, as a USB adapter does, because every packet wakes its reader.
    """

    def __init__(
        self,
        network: "Network",
        address: tuple[str, int],
        new_session: Callable[[], ClientSession],
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
    def connections(self) -> list[ClientConnection]:
        return [connection for connection in self._network.connections if connection.listener is self]

    def open(self) -> None:
        """Start listening. Raise Refused `port_in_use` if the address is not available."""
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
        """Accept a client, or hang up on it if the limit is reached."""
        if self._socket is None:  # closed while this event was waiting
            return
        try:
            peer, _ = self._socket.accept()
        except OSError:
            return
        for connection in self.connections:
            # The end of an old connection may arrive after the new one begins.
            while not self.silent and connection.read():
                pass
        if len(self.connections) >= self._limit:
            peer.close()
            return
        connection = ClientConnection(self._network, peer, self._new_session(), self)
        self._network.connections.append(connection)
        connection.greet()

    def set_silent(self, silent: bool) -> None:
        """Make the port silent, or end the silence. A silent port sends and reads nothing; connections remain open."""
        self.silent = silent
        for connection in self.connections:
            connection.watch()

    def hang_up(self) -> None:
        """Close every connection, but continue to listen."""
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
        # select() waits to the microsecond. epoll rounds up to whole milliseconds: when virtual time runs faster,
        # packets would come in bursts, and a client that keeps only the newest packet would miss some.
        self.selector = selectors.SelectSelector()
        self.sockets = SocketTable()
        self.listeners: list[PortListener] = []
        self.connections: list[ClientConnection] = []

    def listen(
        self,
        host: str,
        port: int,
        new_session: Callable[[], ClientSession],
        *,
        limit: int = 16,
        lag_s: float = UNPACED_LAG,
        gathers: bool = False,
    ) -> PortListener:
        listener = PortListener(self, (host, port), new_session, limit=limit, lag_s=lag_s, gathers=gathers)
        self.listeners.append(listener)
        return listener

    def poll(self, timeout_s: float | None) -> None:
        """Serve all sockets with events; wait at most `timeout_s` for the first."""
        for key, events in self.selector.select(timeout_s):
            key.data(events)

    def tick(self) -> None:
        """Simulate a tick of every session, and queue the bytes that they send."""
        for connection in tuple(self.connections):
            connection.tick()

    def deliver(self, idle: bool = True, patient: bool = True) -> float:
        """Send the bytes of past ticks to every client that can take them; return the time to wait for others, s.

        A tick is over when this returns 0. `idle`: the next tick is not due yet, so that bytes need not be collected.
        `patient`: wait for clients that lag behind, which no real controller or board would do.
        """
        due = [connection for connection in self.connections if connection.due]
        return max([connection.deliver(idle, patient) for connection in due], default=0.0)

    def describe_lagging_clients(self) -> str:
        """Return the clients that lag, in words. Any thread may call this."""
        behind = [connection.client for connection in tuple(self.connections) if connection.wait_s > 0.0]
        return ", ".join(behind) or "no client"

    def close(self) -> None:
        for listener in self.listeners:
            listener.close()
        self.selector.close()
        self.sockets.close()
