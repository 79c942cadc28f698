"""A bus of servos at a port of this computer, for programs that only need a port."""

import selectors
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

from rig.world.board.pty_port import PtyPort
from rig.world.board.serial_line import SerialLine
from rig.world.servo.bus import SimulatedBus

TICK_S = 0.002  # the world looks at its servos at least this often


class Port(Protocol):
    """The host's end of the line; `path` is the port to open."""

    path: str

    def tick(self) -> None: ...
    def close(self) -> None: ...


class TcpPort:
    """A port at socket://, for one client at a time.

    Bytes arrive at once. Through a pseudo-terminal a kernel thread carries them, which may get no processor for longer
    than an answer may take.
    """

    def __init__(self, line: SerialLine, selector: selectors.BaseSelector) -> None:
        self._line, self._selector = line, selector
        self._listening = socket.create_server(("127.0.0.1", 0))
        self._client: socket.socket | None = None
        self.path = f"socket://127.0.0.1:{self._listening.getsockname()[1]}"
        selector.register(self._listening, selectors.EVENT_READ, self._accept)

    def _accept(self, events: int) -> None:
        self._hang_up()
        self._client, _ = self._listening.accept()
        self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._selector.register(self._client, selectors.EVENT_READ, self._ready)

    def _ready(self, events: int) -> None:
        data = b""
        if self._client is not None:
            with suppress(OSError):
                data = self._client.recv(4096)
        if data:
            self._line.send_to_device(data, None)
        else:
            self._hang_up()

    def tick(self) -> None:
        """Pass on the bytes that the servos sent."""
        if self._line.fresh and self._client is not None and (data := self._line.read_as_host(None)):
            with suppress(OSError):
                self._client.sendall(data)

    def _hang_up(self) -> None:
        if self._client is not None:
            self._selector.unregister(self._client)
            self._client.close()
            self._client = None

    def close(self) -> None:
        """Hang up, and stop listening."""
        self._hang_up()
        self._selector.unregister(self._listening)
        self._listening.close()


class BusOnALine:
    """A bus at the port `port`; `live` simulates it for a while, in the caller's thread.

    `now`: the time of its servos; `move_on` advances it, if it does not pass by itself.
    """

    def __init__(
        self,
        make: Callable[[Callable[[], float]], SimulatedBus],
        now: Callable[[], float],
        move_on: Callable[[], None],
        *,
        pty: bool,
    ) -> None:
        self._selector, self._now, self._move_on = selectors.DefaultSelector(), now, move_on
        self.bus = make(now)
        self.line = SerialLine(lambda: self.bus, seed=3)
        self._port: Port | None = (PtyPort if pty else TcpPort)(self.line, self._selector)
        self.port = self._port.path

    def live(self, duration_s: float) -> None:
        """Serve the port for `duration_s` of wall time; received bytes are read before the watchdog can expire."""
        ends_s = time.monotonic() + duration_s
        while time.monotonic() < ends_s:
            self._move_on()
            wait_s = self.bus.due_s() - self._now()
            if self._port is not None:
                for key, events in self._selector.select(max(0.0, min(wait_s, TICK_S))):
                    key.data(events)
            else:
                time.sleep(TICK_S)
            self.bus.advance()
            self.line.tick()
            if self._port is not None:
                self._port.tick()

    def pull_out(self) -> None:
        """Take the converter out of the host: the port is gone."""
        if self._port is not None:
            self._port.close()
            self._port = None

    def close(self) -> None:
        """Close the port."""
        self.pull_out()
        self._selector.close()
