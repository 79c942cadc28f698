"""Encoding and decoding of frames, as `protocol.py` describes them."""

from collections import OrderedDict
from collections.abc import Callable
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from firmware_host.protocol import (
    MESSAGE_BY_CODE,
    MESSAGE_BY_NAME,
    METHODS,
    MODES,
    OVERHEAD,
    PAYLOAD_MAX,
    PROTOCOL_VERSION,
    QUANTITIES,
    SOLUTION_STATUSES,
    Message,
)
from firmware_host.stuffing import stuff, unstuff

_BLOCK_MAX = PAYLOAD_MAX + OVERHEAD + 1
_RECENT_FRAMES = 200  # more than a buffer in between repeats, and fewer than the range of their sequence
# The first meaningless value by field. Fields with a name for unknown values (`unknown`) accept all.
_INVALID_FROM = {
    "mode": len(MODES),
    "method": len(METHODS),
    "status": len(SOLUTION_STATUSES),
    "quantity": len(QUANTITIES),
    "written_unix_s": 253_402_300_800,  # the year 10 000
}
_LIMITS = {
    message.name: tuple((field.name, _INVALID_FROM[field.name]) for field in fields if field.name in _INVALID_FROM)
    for message in MESSAGE_BY_NAME.values()
    for fields in [(*message.fields, *message.items)]
}
_CRC_OF_INTACT = 0x2144DF1C  # CRC of any bytes followed by their own CRC


class Frame(NamedTuple):
    """A received frame: fixed fields by name, and the bytes of its items."""

    name: str
    sequence: int
    values: dict[str, Any]
    content: bytes

    @property
    def items(self) -> np.ndarray[Any, Any]:
        """The items as a structured array of the table's layout; an empty one for a message without items."""
        dtype = MESSAGE_BY_NAME[self.name].item_dtype
        return np.frombuffer(self.content, dtype) if dtype.itemsize else np.empty(0)


def encode(name: str, sequence: int, values: dict[str, Any] | None = None, items: np.ndarray | None = None) -> bytes:
    """Return the bytes of one frame, delimiter included. Raise ValueError if the payload exceeds `PAYLOAD_MAX`."""
    message = MESSAGE_BY_NAME[name]
    values = values or {}
    flat: list[Any] = []
    for field in message.fields:
        value = values[field.name]
        if field.rows:
            flat.extend(np.ravel(value).tolist())
        else:
            flat.append(value.encode("ascii") if isinstance(value, str) else value)
    payload = message.head.pack(*flat)
    if items is not None:
        payload += np.ascontiguousarray(items, message.item_dtype).tobytes()
    if len(payload) > PAYLOAD_MAX:
        raise ValueError(f"{name}: payload of {len(payload)} bytes, at most {PAYLOAD_MAX} fit a frame")
    body = bytes((message.code, sequence)) + payload
    return stuff(body + crc32(body).to_bytes(4, "little")) + b"\0"


class _Layout(NamedTuple):
    """The data needed to decode the frames of one message, computed once."""

    name: str
    head: Callable[[bytes, int], tuple[Any, ...]]
    name_values: Callable[[tuple[Any, ...]], dict[str, Any]]
    items_offset: int
    item_size: int
    min_size: int  # bytes of a body without items
    limits: tuple[tuple[str, int], ...]

    @classmethod
    def make(cls, message: Message) -> "_Layout":
        offset, size = 2 + message.head.size, message.item_dtype.itemsize
        min_size = OVERHEAD + message.head.size
        return cls(
            message.name, message.head.unpack_from, message.name_values, offset, size, min_size, _LIMITS[message.name]
        )


_LAYOUTS = {code: _Layout.make(message) for code, message in MESSAGE_BY_CODE.items()}


def decode(block: bytes) -> Frame | None:
    """Decode one COBS block, without its delimiter; return None if it is damaged or unknown, or has invalid values.

    An identity of another protocol version is returned with only the two fields that every version has.
    """
    body = unstuff(block) if len(block) <= _BLOCK_MAX else None
    if body is None or len(body) < OVERHEAD or crc32(body) != _CRC_OF_INTACT or body[0] not in _LAYOUTS:
        return None
    name, head, name_values, items_offset, item_size, min_size, limits = _LAYOUTS[body[0]]
    if name == "identity" and len(body) >= OVERHEAD + 2 and body[3] != PROTOCOL_VERSION:
        return Frame("identity", body[1], {"reply_to": body[2], "protocol": body[3]}, b"")
    length = len(body) - min_size
    if length < 0 or length % item_size if item_size else length != 0:
        return None
    values = name_values(head(body, 2))
    if item_size and values.get("count", length // item_size) != length // item_size:
        return None
    frame = Frame(name, body[1], values, body[items_offset:-4])
    for field, limit in limits:
        if values[field] >= limit if field in values else np.any(frame.items[field] >= limit):
            return None
    return frame


class FrameReader:
    """The parser of a byte stream in chunks of any size, with counts of lost and repeated frames.

    `lost` is exact as long as fewer than 256 frames are lost in a row; the samples' own sequence numbers show any
    loss. A frame equal to one of the latest, including sequence and CRC, counts as repeated by the line.
    """

    def __init__(self) -> None:
        self._rest = b""
        self._expected: int | None = None  # sequence of the next frame
        self._recent: OrderedDict[bytes, None] = OrderedDict()  # blocks of the latest frames, except identities
        self._identity = b""  # block of the latest identity
        self.damaged = 0  # number of blocks that did not decode
        self.lost = 0  # number of missing frames, by their sequence
        self.repeated = 0  # number of repeated frames
        self.byte_count = 0

    def expect_restart(self) -> None:
        """Accept that the sender restarts: its next frame continues no sequence."""
        self._expected = None
        self._recent.clear()
        self._identity = b""

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that `data` completes, without repetitions."""
        self.byte_count += len(data)
        *blocks, rest = (self._rest + data).split(b"\0")
        self._rest = rest[: _BLOCK_MAX + 1]  # at most one byte beyond the longest frame, which suffices to reject noise
        frames = []
        for block in blocks:
            if not block:
                continue
            frame = decode(block)
            if frame is None:
                self.damaged += 1
            elif self._is_repeated(block, frame):
                self.repeated += 1
            else:
                if self._expected is not None:
                    self.lost += (frame.sequence - self._expected) & 0xFF
                self._expected = frame.sequence + 1 & 0xFF
                frames.append(frame)
        return frames

    def _is_repeated(self, block: bytes, frame: Frame) -> bool:
        """Return whether the line repeats a frame.

        An idle board sends the same identity every 256 frames, and after a reset; so an identity is compared only with
        the latest one, and is new if it has the expected sequence number.
        """
        if frame.name == "identity":
            is_repeated = block == self._identity and frame.sequence != self._expected
            self._identity = block
            return is_repeated
        if block in self._recent:
            return True
        self._recent[block] = None
        if len(self._recent) > _RECENT_FRAMES:
            self._recent.popitem(last=False)
        return False
