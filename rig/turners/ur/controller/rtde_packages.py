"""The packages of RTDE, port 30004: big-endian size (u16), type (one letter) and payload (the maker's guide)."""

import struct
from collections.abc import Iterator

PORT = 30004
VERSION = 2
HEADER = struct.Struct(">HB")


def package(kind: str, payload: bytes) -> bytes:
    """Return the bytes of one package."""
    return HEADER.pack(HEADER.size + len(payload), ord(kind)) + payload


def packages(buffer: bytearray) -> Iterator[tuple[str, bytes]]:
    """Yield type and payload of complete packages, and remove these from the start of `buffer`.

    Raise `ConnectionError` for bytes that are no package.
    """
    while len(buffer) >= HEADER.size:
        size, kind = HEADER.unpack_from(buffer)
        if size < HEADER.size:
            raise ConnectionError("this is not RTDE")  # nothing that follows can be trusted
        if len(buffer) < size:
            return
        payload = bytes(buffer[HEADER.size : size])
        del buffer[:size]
        yield chr(kind), payload
