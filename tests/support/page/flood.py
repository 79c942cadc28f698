"""Harmful connections to the operator's page."""

import socket
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from urllib.parse import urlsplit

from support.processes.waiting import PATIENCE_S


@contextmanager
def open_request(url: str, path: str, more: str = "", *, source: str = "") -> Iterator[socket.socket]:
    """Send a request, and leave its answer unread."""
    parts = urlsplit(url)
    address = (parts.hostname or "", parts.port or 0)
    with closing(socket.create_connection(address, 10, (source, 0) if source else None)) as connection:
        connection.sendall(f"GET {path} HTTP/1.1\r\nHost: {parts.netloc}\r\n{more}\r\n".encode())
        yield connection


@contextmanager
def half_a_request(url: str, *, source: str = "") -> Iterator[socket.socket]:
    """Open a connection whose request never ends."""
    parts = urlsplit(url)
    address = (parts.hostname or "", parts.port or 0)
    with closing(socket.create_connection(address, 10, (source, 0) if source else None)) as connection:
        with suppress(ConnectionError):
            connection.sendall(b"GET / HTTP/1.1\r\n")
        yield connection


def alive(connection: socket.socket) -> bool:
    """Return whether the other side still holds the connection."""
    connection.setblocking(False)
    try:
        return connection.recv(1 << 16) != b""
    except BlockingIOError:
        return True
    except ConnectionError:
        return False


@contextmanager
def flood(url: str, connections: int) -> Iterator[None]:
    """Hold `connections` incomplete requests during the block; open each again that is closed."""
    parts = urlsplit(url)
    address = (parts.hostname or "", parts.port or 0)
    over, full = threading.Event(), threading.Event()

    def attack() -> None:
        sockets: list[socket.socket] = []
        while not over.is_set():
            with suppress(OSError):
                sockets.append(socket.create_connection(address, 1))
                sockets[-1].sendall(b"GET / HTTP/1.1\r\n")
            if len(sockets) >= connections:
                full.set()
                over.wait(0.05)
                gone = [connection for connection in sockets if not alive(connection)]
                for connection in gone:
                    connection.close()
                sockets = [connection for connection in sockets if connection.fileno() >= 0]
        for connection in sockets:
            connection.close()

    thread = threading.Thread(target=attack, daemon=True)
    thread.start()
    try:
        full.wait(PATIENCE_S)  # without the limits fewer would be possible
        yield
    finally:
        over.set()
        thread.join(PATIENCE_S)
