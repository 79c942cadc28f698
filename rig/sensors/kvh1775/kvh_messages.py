"""The KVH 1775's binary messages: decoding to arrays, and encoding. Pure.

Source: ICD 56-0298 Rev. B, tables 5-1 to 5-9 (formats A, B, C and their CRC) and section 5.3 (built-in test).
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from struct import Struct
from types import MappingProxyType
from typing import Any, Literal
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

Format = Literal["A", "B", "C"]

SEQUENCE_NUMBERS = 128
ALL_VALID = 0x77  # bits 0–2 gyroscope x y z, 4–6 accelerometer x y z
GOOD_TEST_BYTE = 0x7F

_HEAD = [("header", "V4"), ("rotation", ">f4", (3,)), ("acceleration_g", ">f4", (3,))]
_TAIL = [("status", "u1"), ("sequence", "u1")]
_LAYOUTS: Mapping[Format, np.dtype[Any]] = MappingProxyType(
    {
        "A": np.dtype([*_HEAD, *_TAIL, ("temperature", ">i2"), ("crc", ">u4")]),
        "B": np.dtype([*_HEAD, ("time_us", ">u4"), *_TAIL, ("temperature", ">i2"), ("crc", ">u4")]),
        "C": np.dtype([*_HEAD, ("fourth", ">f4"), *_TAIL, ("crc", ">u4")]),
    }
)
_HEADERS: Mapping[Format, bytes] = MappingProxyType(
    {"A": b"\xfe\x81\xff\x55", "B": b"\xfe\x81\xff\x56", "C": b"\xfe\x81\xff\x57"}
)
# One message without its CRC: header, rotation, acceleration, and these fields.
_PACKERS: Mapping[Format, tuple[Struct, tuple[str, ...]]] = MappingProxyType(
    {
        "A": (Struct(">4s6fBBh"), ("status", "sequence", "temperature")),
        "B": (Struct(">4s6fIBBh"), ("time_us", "status", "sequence", "temperature")),
        "C": (Struct(">4s7fBB"), ("fourth", "status", "sequence")),
    }
)
_TEST_HEADERS = (b"\xfe\x81\x00\xaa", b"\xfe\x81\x00\xab")
_TEST_BYTES = (6, 8)
_LENGTHS = {
    **{header: _LAYOUTS[name].itemsize for name, header in _HEADERS.items()},
    **{header: len(header) + count + 1 for header, count in zip(_TEST_HEADERS, _TEST_BYTES, strict=True)},
}
_ANY_HEADER = re.compile(b"|".join(re.escape(header) for header in _LENGTHS))
_HEADER_BYTES = 4

MESSAGE_BYTES: Mapping[Format, int] = MappingProxyType({name: layout.itemsize for name, layout in _LAYOUTS.items()})

# A message of any format. `rotation` is an angle or a rate and `temperature` in whole degrees or hundredths, as the
# instrument is set; `time_us` counts modulo 2³² and is 0 in formats without it. `fourth` is format C's: temperature
# and magnetic field x, y, z in turn, by the sequence number modulo 4.
MESSAGE_DTYPE = np.dtype(
    [
        ("format", "S1"),
        ("rotation", "<f4", (3,)),
        ("acceleration_g", "<f4", (3,)),
        ("time_us", "<u4"),
        ("fourth", "<f4"),
        ("status", "u1"),
        ("sequence", "u1"),
        ("temperature", "<i2"),
    ]
)

_FIELDS = {
    name: [field for field in MESSAGE_DTYPE.names or () if field in (layout.names or ())]
    for name, layout in _LAYOUTS.items()
}

# zlib's CRC is the same polynomial with the opposite bit order, so its input bytes are reversed. Over a message with
# its CRC the ICD's register ends at zero; zlib inverts it to ones.
_BITS_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_CRC_RIGHT = 0xFFFFFFFF


@dataclass(frozen=True, slots=True)
class BuiltInTest:
    """The instrument's test result of six bytes, or eight on request; a byte is `GOOD_TEST_BYTE` if its test passed."""

    values: bytes

    @property
    def passed(self) -> bool:
        """Whether all bytes of the built-in test report success."""
        return all(value == GOOD_TEST_BYTE for value in self.values)


@dataclass(frozen=True, slots=True)
class MessageBatch:
    """The contents of decoded bytes: `messages` (n,) of MESSAGE_DTYPE in order, and results of built-in `tests`."""

    messages: NDArray[Any]
    tests: tuple[BuiltInTest, ...]


class MessageReader:
    """The parser of a byte stream in blocks of any size, which returns only messages with the right CRC or sum.

    After damage it searches from the byte after the bad header, so no other message is lost.
    """

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> MessageBatch:
        """Add received bytes; return the messages and built-in test results that are now complete."""
        data = self._rest + data
        backwards = memoryview(data.translate(_BITS_REVERSED))
        starts: dict[bytes, list[int]] = {header: [] for header in _HEADERS.values()}
        tests: list[BuiltInTest] = []
        position = 0
        while (match := _ANY_HEADER.search(data, position)) is not None:
            header, start = match.group(), match.start()
            length = _LENGTHS[header]
            position = start
            if position + length > len(data):
                break
            if header in starts:
                for end in range(start + length, len(data) + 1, length):  # the next message usually has the same format
                    # Zeros after a shorter message leave its CRC unchanged, so the header must match too.
                    if crc32(backwards[position:end]) != _CRC_RIGHT or not data.startswith(header, position):
                        break
                    starts[header].append(position)
                    position = end
            elif sum(data[start : start + length - 1]) % 256 == data[start + length - 1]:
                tests.append(BuiltInTest(data[start + _HEADER_BYTES : start + length - 1]))
                position += length
            if position == start:  # damaged
                position += 1
        else:
            position = max(position, len(data) - _HEADER_BYTES + 1)  # keep the start of a possible header
        self._rest = data[position:]
        return MessageBatch(_gather_messages(data, starts), tuple(tests))


def encode(
    name: Format,
    *,
    rotation: Any,
    acceleration_g: Any,
    sequence: Any,
    status: Any = ALL_VALID,
    temperature: Any = 0,
    time_us: Any = 0,
    fourth: Any = 0.0,
) -> bytes:
    """Return the bytes of one message, or of many from arrays (n, 3) and (n,), as the instrument sends them."""
    fields: dict[str, Any] = {
        "rotation": rotation,
        "acceleration_g": acceleration_g,
        "sequence": sequence,
        "status": status,
        "temperature": temperature,
        "time_us": time_us,
        "fourth": fourth,
    }
    layout = _LAYOUTS[name]
    messages = np.zeros(max(np.size(sequence), 1), layout)
    messages["header"] = np.void(_HEADERS[name])
    for field in fields.keys() & set(layout.names or ()):
        messages[field] = fields[field]
    size = layout.itemsize
    data = messages.tobytes()
    backwards = memoryview(data.translate(_BITS_REVERSED))
    return b"".join(
        data[start : start + size - 4] + _crc(backwards[start : start + size - 4])
        for start in range(0, len(data), size)
    )


def encode_one(name: Format, rotation: Sequence[float], acceleration_g: Sequence[float], **tail: float) -> bytes:
    """Return the bytes of one message, without arrays; `tail` contains the other fields of the format."""
    packer, fields = _PACKERS[name]
    data = packer.pack(_HEADERS[name], *rotation, *acceleration_g, *[tail[field] for field in fields])
    return data + _crc(data.translate(_BITS_REVERSED))


def encode_test(values: bytes) -> bytes:
    """Return the message of a built-in test of six or eight bytes."""
    data = _TEST_HEADERS[_TEST_BYTES.index(len(values))] + values
    return data + bytes([sum(data) % 256])


def _view_records(data: bytes, starts: NDArray[np.intp], layout: np.dtype[Any]) -> NDArray[Any]:
    """Return the records (n,) that start at `starts` (n,), without a copy if they are contiguous."""
    if starts[-1] - starts[0] == (len(starts) - 1) * layout.itemsize:
        return np.frombuffer(data, layout, len(starts), int(starts[0]))
    octets = np.frombuffer(data, np.uint8)
    records: NDArray[Any] = octets[starts[:, None] + np.arange(layout.itemsize)].view(layout)[:, 0]
    return records


def _crc(backwards: bytes | memoryview) -> bytes:
    return (crc32(backwards) ^ _CRC_RIGHT).to_bytes(4, "little").translate(_BITS_REVERSED)


def _gather_messages(data: bytes, starts: Mapping[bytes, list[int]]) -> NDArray[Any]:
    """Decode the messages and return them in stream order; `starts` maps each header to its byte positions."""
    parts: list[NDArray[Any]] = []
    part_positions: list[NDArray[np.intp]] = []
    for name, header in _HEADERS.items():
        if not starts[header]:
            continue
        positions = np.array(starts[header])
        sent = _view_records(data, positions, _LAYOUTS[name])
        part = np.zeros(len(positions), MESSAGE_DTYPE)
        part["format"] = name
        for field in _FIELDS[name]:
            part[field] = sent[field]
        parts.append(part)
        part_positions.append(positions)
    if not parts:
        return np.zeros(0, MESSAGE_DTYPE)
    if len(parts) == 1:
        return parts[0]
    return np.concatenate(parts)[np.argsort(np.concatenate(part_positions), kind="stable")]
