"""TCP wires between the rig and its simulated laboratory, on an address of their own, with faults."""

import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from random import Random

from support.laboratories.worlds import fresh_host

ARM_PORTS = {"dashboard": 29999, "primary": 30001, "secondary": 30002, "script": 30003, "rtde": 30004}
RESET = struct.pack("ii", 1, 0)  # SO_LINGER: hang up without a farewell

Damage = Callable[[bytes], bytes]


class Wire:
    """A relay from a port at `host` to one of the far end, whose bytes can be delayed or damaged."""

    def __init__(self, host: str, port: int, far: tuple[str, int]) -> None:
        self._far = far
        self._open: list[tuple[socket.socket, socket.socket]] = []  # the rig's end, the far one
        self._half_closed: set[socket.socket] = set()
        self.stalled = threading.Event()  # takes nothing more in, either way
        self.refusing = False
        self.delay_s = 0.0
        self.damage: Damage | None = None
        self.delivered: list[tuple[float, bytes]] | None = None  # to the rig, with the monotonic time; None: not kept
        self._listener = socket.create_server((host, port))
        threading.Thread(target=self._accept, daemon=True).start()

    def half_close(self) -> None:
        """Let the far end announce that it will send no more, while it continues to listen."""
        for near, _ in self._open:
            self._half_closed.add(near)
            with suppress(OSError):
                near.shutdown(socket.SHUT_WR)

    def hang_up(self) -> None:
        """Reset every connection, towards both ends."""
        pairs = self._open
        self._open = []
        for wire_end in (end for pair in pairs for end in pair):
            with suppress(OSError):
                wire_end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
                wire_end.shutdown(socket.SHUT_RDWR)
            wire_end.close()

    def heal(self) -> None:
        """Remove all faults for the connections to come."""
        self.damage, self.delay_s, self.refusing = None, 0.0, False
        self.stalled.clear()
        self._half_closed.clear()

    def close(self) -> None:
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self.hang_up()
        self.stalled.clear()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                try:
                    if self.refusing:
                        raise ConnectionRefusedError
                    far = socket.create_connection(self._far)
                except OSError:
                    near.close()
                    continue
                self._open.append((near, far))
                for source, sink, to_rig in ((near, far, False), (far, near, True)):
                    source.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    threading.Thread(target=self._pass_on, args=(source, sink, to_rig), daemon=True).start()

    def _pass_on(self, source: socket.socket, sink: socket.socket, to_rig: bool) -> None:
        with suppress(OSError):
            while data := source.recv(65536):
                while self.stalled.is_set():
                    time.sleep(0.005)
                if to_rig and self.delay_s:
                    time.sleep(self.delay_s)
                if to_rig and self.damage is not None:
                    data = self.damage(data)
                if to_rig and sink in self._half_closed:
                    continue
                sink.sendall(data)
                if to_rig and self.delivered is not None:
                    self.delivered.append((time.monotonic(), data))
        with suppress(OSError):
            sink.shutdown(socket.SHUT_RDWR)


@contextmanager
def wires(far_host: str, ports: Mapping[str, int]) -> Iterator[tuple[str, dict[str, Wire]]]:
    """Yield a wire for each of these ports of `far_host` by name, and the address of the wires."""
    host = fresh_host()
    running = {name: Wire(host, port, (far_host, port)) for name, port in ports.items()}
    try:
        yield host, running
    finally:
        for wire in running.values():
            wire.close()


def losing(fraction: float, seed: int) -> Damage:
    """Return a damage that loses the fraction `fraction` of the bytes."""
    random = Random(seed)
    return lambda data: bytes(byte for byte in data if random.random() >= fraction)


def flipping(fraction: float, seed: int) -> Damage:
    """Return a damage that flips one bit in the fraction `fraction` of the bytes."""
    random = Random(seed)
    return lambda data: bytes(
        byte ^ (1 << random.randrange(8)) if random.random() < fraction else byte for byte in data
    )


def repeating(fraction: float, seed: int) -> Damage:
    """Return a damage that repeats the fraction `fraction` of the pieces."""
    random = Random(seed)
    return lambda data: data * 2 if random.random() < fraction else data
