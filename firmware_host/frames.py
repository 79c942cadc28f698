"""Frames to bytes and back, as `protocol.py` describes them."""

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
_REMEMBERED = 200  # frames: more than a buffer on the way hands on twice, and fewer than their sequence counts
# Of fields: values from here on mean nothing. Where an unknown one has a name (`unknown`), any will do.
_MEANINGLESS_FROM = {
    "mode": len(MODES),
    "method": len(METHODS),
    "status": len(SOLUTION_STATUSES),
    "quantity": len(QUANTITIES),
    "written_unix_s": 253_402_300_800,  # the year 10 000
}
_CHECKED = {
    message.name: tuple((each.name, _MEANINGLESS_FROM[each.name]) for each in fields if each.name in _MEANINGLESS_FROM)
    for message in MESSAGE_BY_NAME.values()
    for fields in [(*message.fields, *message.items)]
}
_CRC_OF_INTACT = 0x2144DF1C  # of any bytes followed by their own CRC


class Frame(NamedTuple):
    """A received frame: fixed fields by name, and the bytes of its items."""

    name: str
    sequence: int
    values: dict[str, Any]
    content: bytes

    @property
    def items(self) -> np.ndarray[Any, Any]:
        """The items as a structured array of the table's layout; of a message without any, an empty one."""
        dtype = MESSAGE_BY_NAME[self.name].item_dtype
        return np.frombuffer(self.content, dtype) if dtype.itemsize else np.empty(0)


def encode(name: str, sequence: int, values: dict[str, Any] | None = None, items: np.ndarray | None = None) -> bytes:
    """The bytes of one frame, delimiter included. Raises ValueError when the payload exceeds `PAYLOAD_MAX`."""
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
    """What decoding needs of a message, looked up once."""

    name: str
    head: Callable[[bytes, int], tuple[Any, ...]]
    named: Callable[[tuple[Any, ...]], dict[str, Any]]
    items_at: int
    item_size: int
    least: int  # bytes of a body without items
    checked: tuple[tuple[str, int], ...]

    @classmethod
    def of(cls, message: Message) -> "_Layout":
        at, size = 2 + message.head.size, message.item_dtype.itemsize
        least = OVERHEAD + message.head.size
        return cls(message.name, message.head.unpack_from, message.named, at, size, least, _CHECKED[message.name])


_LAYOUTS = {code: _Layout.of(message) for code, message in MESSAGE_BY_CODE.items()}


def decode(block: bytes) -> Frame | None:
    """One COBS block (without its delimiter) → frame; None when damaged or not in the table, or of no meaning there.

    An identity of another protocol version comes back with only the two fields every version has.
    """
    body = unstuff(block) if len(block) <= _BLOCK_MAX else None
    if body is None or len(body) < OVERHEAD or crc32(body) != _CRC_OF_INTACT or body[0] not in _LAYOUTS:
        return None
    name, head, named, items_at, item_size, least, checked = _LAYOUTS[body[0]]
    if name == "identity" and len(body) >= OVERHEAD + 2 and body[3] != PROTOCOL_VERSION:
        return Frame("identity", body[1], {"reply_to": body[2], "protocol": body[3]}, b"")
    length = len(body) - least
    if length < 0 or length % item_size if item_size else length != 0:
        return None
    values = named(head(body, 2))
    if item_size and values.get("count", length // item_size) != length // item_size:
        return None
    frame = Frame(name, body[1], values, body[items_at:-4])
    for field, limit in checked:
        if values[field] >= limit if field in values else np.any(frame.items[field] >= limit):
            return None
    return frame


class FrameReader:
    """Cuts a byte stream into frames, whatever the chunks it arrives in, and counts what is missing or came twice.

    `lost` is exact as long as fewer than 256 frames are lost in a row; the samples' own sequence tells any number. A
    frame that equals one of the latest, sequence, CRC and all, is that one again: the line has delivered it twice.
    """

    def __init__(self) -> None:
        self._rest = b""
        self._expected: int | None = None  # sequence of the next frame
        self._recent: OrderedDict[bytes, None] = OrderedDict()  # the latest frames' blocks, but for identities
        self._identity = b""  # the latest identity's block
        self.damaged = 0  # blocks that did not decode
        self.lost = 0  # frames missing between the first and the latest, by their sequence
        self.repeated = 0  # frames that had come before
        self.bytes_seen = 0

    def expect_restart(self) -> None:
        """The sender is about to start afresh: its next frame continues no sequence."""
        self._expected = None
        self._recent.clear()
        self._identity = b""

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that `data` completes, each once."""
        self.bytes_seen += len(data)
        *blocks, rest = (self._rest + data).split(b"\0")
        self._rest = rest[: _BLOCK_MAX + 1]  # of noise, or of another baud rate, no more than tells that it is no frame
        frames = []
        for block in blocks:
            if not block:
                continue
            frame = decode(block)
            if frame is None:
                self.damaged += 1
            elif self._came_before(block, frame):
                self.repeated += 1
            else:
                if self._expected is not None:
                    self.lost += (frame.sequence - self._expected) & 0xFF
                self._expected = frame.sequence + 1 & 0xFF
                frames.append(frame)
        return frames

    def _came_before(self, block: bytes, frame: Frame) -> bool:
        """Whether the line delivers a frame again.

        An idle board says the same again every 256 frames, and after a reset; so an identity is held against the
        latest one alone, and is new when its sequence has come round.
        """
        if frame.name == "identity":
            again = block == self._identity and frame.sequence != self._expected
            self._identity = block
            return again
        if block in self._recent:
            return True
        self._recent[block] = None
        if len(self._recent) > _REMEMBERED:
            self._recent.popitem(last=False)
        return False
