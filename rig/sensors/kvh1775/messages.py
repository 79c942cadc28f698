"""The KVH 1775's binary messages: bytes to arrays and back. Pure.

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
# One message without its CRC: header, rotation, acceleration, and these.
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

MESSAGE_BYTES: Mapping[Format, int] = MappingProxyType({name: each.itemsize for name, each in _LAYOUTS.items()})

# A message of any format. `rotation` is an angle or a rate and `temperature` in whole degrees or hundredths, as the
# instrument is set; `time_us` counts modulo 2³² and is 0 where the format has none. `fourth` is format C's: temperature
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

# zlib's CRC is the same polynomial run over bits the other way round, so it is fed reversed bytes. Over a message with
# its CRC the ICD's register ends at zero, which zlib, inverting, shows as ones.
_BITS_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_CRC_RIGHT = 0xFFFFFFFF


@dataclass(frozen=True, slots=True)
class BuiltInTest:
    """What the instrument says of itself, six bytes or on request eight; each good one is `GOOD_TEST_BYTE`."""

    values: bytes

    @property
    def passed(self) -> bool:
        """Whether nothing is wrong."""
        return all(value == GOOD_TEST_BYTE for value in self.values)


@dataclass(frozen=True, slots=True)
class Decoded:
    """What bytes held: `messages` (n,) MESSAGE_DTYPE in order, and built-in tests."""

    messages: NDArray[Any]
    tests: tuple[BuiltInTest, ...]


class MessageReader:
    """Finds messages in bytes that come in pieces of any size. Only what its CRC or sum proves whole is handed on.

    After damage it looks for the next header from the byte after the last one, so a damaged message costs no other.
    """

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> Decoded:
        """What is complete with these bytes."""
        data = self._rest + data
        backwards = memoryview(data.translate(_BITS_REVERSED))
        starts: dict[bytes, list[int]] = {header: [] for header in _HEADERS.values()}
        tests: list[BuiltInTest] = []
        place = 0
        while (found := _ANY_HEADER.search(data, place)) is not None:
            header, begun = found.group(), found.start()
            length = _LENGTHS[header]
            place = begun
            if place + length > len(data):
                break
            if header in starts:
                for end in range(begun + length, len(data) + 1, length):  # as a rule the next is of the same format
                    # Zeros behind a shorter message leave its CRC as it is: the header has to say that this is none.
                    if crc32(backwards[place:end]) != _CRC_RIGHT or not data.startswith(header, place):
                        break
                    starts[header].append(place)
                    place = end
            elif sum(data[begun : begun + length - 1]) % 256 == data[begun + length - 1]:
                tests.append(BuiltInTest(data[begun + _HEADER_BYTES : begun + length - 1]))
                place += length
            if place == begun:  # damaged
                place += 1
        else:
            place = max(place, len(data) - _HEADER_BYTES + 1)  # a header may have begun
        self._rest = data[place:]
        return Decoded(_decoded(data, starts), tuple(tests))


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
    """One message, or many of arrays (n, 3) and (n,), as the instrument sends them; the simulated one's half."""
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
    """The bytes of one message, without arrays; `tail` holds every other field of the format, and may hold more."""
    packer, fields = _PACKERS[name]
    data = packer.pack(_HEADERS[name], *rotation, *acceleration_g, *[tail[field] for field in fields])
    return data + _crc(data.translate(_BITS_REVERSED))


def encode_test(values: bytes) -> bytes:
    """A built-in test of six or eight bytes."""
    data = _TEST_HEADERS[_TEST_BYTES.index(len(values))] + values
    return data + bytes([sum(data) % 256])


def _at(data: bytes, places: NDArray[np.intp], layout: np.dtype[Any]) -> NDArray[Any]:
    """What stands at these places (n,); as a rule one behind the other, which needs no copy."""
    if places[-1] - places[0] == (len(places) - 1) * layout.itemsize:
        return np.frombuffer(data, layout, len(places), int(places[0]))
    octets = np.frombuffer(data, np.uint8)
    found: NDArray[Any] = octets[places[:, None] + np.arange(layout.itemsize)].view(layout)[:, 0]
    return found


def _crc(backwards: bytes | memoryview) -> bytes:
    return (crc32(backwards) ^ _CRC_RIGHT).to_bytes(4, "little").translate(_BITS_REVERSED)


def _decoded(data: bytes, starts: Mapping[bytes, list[int]]) -> NDArray[Any]:
    """The messages that begin at these places, of each header, in the order they came."""
    parts, places = [], []
    for name, header in _HEADERS.items():
        if not starts[header]:
            continue
        at = np.array(starts[header])
        sent = _at(data, at, _LAYOUTS[name])
        part = np.zeros(len(at), MESSAGE_DTYPE)
        part["format"] = name
        for field in _FIELDS[name]:
            part[field] = sent[field]
        parts.append(part)
        places.append(at)
    if not parts:
        return np.zeros(0, MESSAGE_DTYPE)
    if len(parts) == 1:
        return parts[0]
    return np.concatenate(parts)[np.argsort(np.concatenate(places), kind="stable")]
