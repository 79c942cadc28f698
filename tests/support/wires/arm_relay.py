"""A relay between the arm's driver and the simulated controller, on an address of its own: a wire that can stall."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from support.laboratories.worlds import fresh_host

PORTS = (29999, 30001, 30003, 30004, 8077)  # the last: a Robot API, where the tests have one
PACKET_BYTES, SLOW_S = 256, 0.02  # a slowed connection is soon far behind


class ArmRelay:
    """A relay at `host`. While `stalled` is set it reads nothing, in either direction.

    While `slow` is set, the connections that were open at `slow_down` pass on fewer bytes than they get.
    """

    def __init__(self, far_host: str, host: str | None = None) -> None:
        self.host = host or fresh_host()
        self.stalled, self.slow = threading.Event(), threading.Event()
        self._slowed: list[socket.socket] = []
        self._far_host = far_host
        self._sockets: list[socket.socket] = []
        for port in PORTS:
            listener = socket.create_server((self.host, port))
            self._sockets.append(listener)
            threading.Thread(target=self._accept, args=(listener, port), daemon=True).start()

    def slow_down(self) -> None:
        """Pass on fewer bytes than arrive over the connections open now, until `slow` is cleared."""
        self._slowed = [*self._sockets]
        self.slow.set()

    def _accept(self, listener: socket.socket, port: int) -> None:
        with suppress(OSError):
            while True:
                near, _ = listener.accept()
                far = socket.create_connection((self._far_host, port))
                self._sockets += [near, far]
                for source, sink in ((near, far), (far, near)):
                    source.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    threading.Thread(target=self._pass_on, args=(source, sink), daemon=True).start()

    def _pass_on(self, source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(PACKET_BYTES):
                if self.slow.is_set() and source in self._slowed:
                    threading.Event().wait(SLOW_S)
                while self.stalled.is_set():
                    threading.Event().wait(0.005)
                sink.sendall(data)
        with suppress(OSError):
            sink.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        for connection in self._sockets:
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            connection.close()


@contextmanager
def relay(far_host: str, host: str | None = None) -> Iterator[ArmRelay]:
    running = ArmRelay(far_host, host)
    try:
        yield running
    finally:
        running.close()
