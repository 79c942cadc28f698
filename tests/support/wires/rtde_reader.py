"""A plain RTDE client that keeps only the newest packet, like many clients, and may be slow."""

import select
import socket
import struct

from support.processes.waiting import PATIENCE_S

TIMESTAMP = struct.Struct(">HBBd")  # size, type, recipe, the one variable asked for


def package(kind: str, payload: bytes) -> bytes:
    return struct.pack(">HB", 3 + len(payload), ord(kind)) + payload


class RtdeReader:
    """A client that receives the controller's time stamps at `rate_hz` by the controller's clock."""

    def __init__(self, host: str, rate_hz: float = 125.0) -> None:
        self._socket = socket.create_connection((host, 30004), PATIENCE_S)
        self._socket.sendall(package("V", struct.pack(">H", 2)))
        self._receive(4)
        self._socket.sendall(package("O", struct.pack(">d", rate_hz) + b"timestamp"))
        self._receive(4 + len("DOUBLE"))
        self._socket.sendall(package("S", b""))
        self._receive(4)

    def _receive(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            data += self._socket.recv(size - len(data))
        return data

    def newest_s(self) -> float:
        """Wait for packets, take all there are, and return the time stamp of the last; the others are lost."""
        data = self._receive(TIMESTAMP.size)
        while len(data) % TIMESTAMP.size or self._waiting():
            data += self._socket.recv(65536)
        return float(TIMESTAMP.unpack(data[-TIMESTAMP.size :])[3])

    def _waiting(self) -> bool:
        return bool(select.select([self._socket], [], [], 0.0)[0])

    def close(self) -> None:
        self._socket.close()
