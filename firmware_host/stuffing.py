"""COBS for blocks shorter than 255 bytes, by the fastest available implementation.

Package `cobs` has an implementation in C if that could be compiled; its Python part takes six times as long as the loop
here.
"""

from types import BuiltinFunctionType

from cobs import cobs


def stuff(body: bytes) -> bytes:
    """Return `body` encoded by COBS, which contains no zeros; the delimiter is not appended."""
    return bytes(cobs.encode(body))


def unstuff_in_python(block: bytes) -> bytes | None:
    """Return the content of `block`, which is shorter than 255 bytes; None if it is damaged.

    Each code byte is the distance to the next code byte. Every code byte except the first also stands for a zero of the
    content.
    """
    if 0 in block:
        return None
    body = bytearray(block)
    position, end = 0, len(block)
    while position < end:
        distance = body[position]
        body[position] = 0
        position += distance
    del body[:1]
    return bytes(body) if position == end else None


def unstuff_by_package(block: bytes) -> bytes | None:
    """Return the content of `block`, of any length, by the package `cobs`; None if it is damaged."""
    try:
        body: bytes = cobs.decode(block)
    except cobs.DecodeError:
        return None
    return body


unstuff = unstuff_by_package if isinstance(cobs.decode, BuiltinFunctionType) else unstuff_in_python
