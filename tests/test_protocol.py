"""The link's frames: what is encoded comes back, what is damaged does not."""

from itertools import pairwise
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
import pytest
from cobs import cobs
from hypothesis import given
from hypothesis import strategies as st

from firmware_host import protocol
from firmware_host.c_header import c_header
from firmware_host.protocol import MESSAGES, FrameReader, Message, encode

HEADER = Path(protocol.__file__).parent / "firmware" / "core" / "protocol.h"

LIMITS = {
    "u8": (0, 2**8 - 1),
    "u16": (0, 2**16 - 1),
    "u32": (0, 2**32 - 1),
    "u64": (0, 2**64 - 1),
    "i16": (-(2**15), 2**15 - 1),
}


def value_of(kind: str) -> st.SearchStrategy[Any]:
    """Any value a field of this kind can hold."""
    if kind in LIMITS:
        return st.integers(*LIMITS[kind])
    if kind in ("f32", "f64"):
        return st.floats(width=32, allow_nan=False)
    if kind == "vector_f32":
        return st.tuples(*[st.floats(width=32, allow_nan=False)] * 3)
    size = int(protocol.KINDS[kind][0].removesuffix("s"))
    return st.binary(min_size=size, max_size=size)


@st.composite
def messages(draw: st.DrawFn) -> tuple[Message, int, dict[str, Any], np.ndarray | None]:
    """Any message with any contents that fit."""
    message = draw(st.sampled_from(MESSAGES))
    values = {field.name: draw(value_of(field.kind)) for field in message.fields}
    items = None
    if message.items:
        room = (protocol.PAYLOAD_MAX - message.head.size) // message.item_dtype.itemsize
        count = draw(st.integers(0, room))
        size = count * message.item_dtype.itemsize
        items = np.frombuffer(draw(st.binary(min_size=size, max_size=size)), message.item_dtype)
        if "count" in values:
            values["count"] = count
    if message.name == "identity":
        values["protocol"] = protocol.PROTOCOL_VERSION
    return message, draw(st.integers(0, 255)), values, items


def test_the_committed_c_header_is_the_one_the_table_generates() -> None:
    assert HEADER.read_text() == c_header(), "run `make -C firmware_host/firmware header`"


def test_codes_and_names_are_unique() -> None:
    for table in (MESSAGES, protocol.ERRORS):
        assert len({entry.code for entry in table}) == len(table) == len({entry.name for entry in table})


@given(messages())
def test_every_message_comes_back_as_it_was_sent(sent: tuple[Message, int, dict[str, Any], np.ndarray | None]) -> None:
    message, sequence, values, items = sent
    (frame,) = FrameReader().feed(encode(message.name, sequence, values, items))
    assert (frame.name, frame.sequence, frame.values) == (message.name, sequence, values)
    assert frame.items.tobytes() == (b"" if items is None else items.tobytes())


@given(st.lists(messages(), min_size=1, max_size=5), st.lists(st.integers(0, 2000), max_size=8))
def test_frames_survive_any_chopping_of_the_stream(sent: list[Any], cuts: list[int]) -> None:
    stream = b"".join(encode(message.name, sequence, values, items) for message, sequence, values, items in sent)
    edges = [0, *sorted(min(cut, len(stream)) for cut in cuts), len(stream)]
    reader = FrameReader()
    received = [frame for start, end in pairwise(edges) for frame in reader.feed(stream[start:end])]
    assert [frame.name for frame in received] == [message.name for message, *_ in sent]
    assert reader.damaged == 0


@given(messages(), st.data())
def test_a_flipped_bit_costs_at_most_the_frame_it_is_in_and_never_makes_a_wrong_one(
    sent: Any, data: st.DataObject
) -> None:
    message, sequence, values, items = sent
    good = encode(message.name, sequence, values, items)
    bit = data.draw(st.integers(0, 8 * len(good) - 1))
    bad = bytearray(good)
    bad[bit // 8] ^= 1 << bit % 8
    reader = FrameReader()
    received = reader.feed(b"\0" + bytes(bad) + b"\0" + good)
    assert [(frame.name, frame.sequence, frame.values) for frame in received] == [(message.name, sequence, values)]
    assert reader.damaged >= 1


def test_noise_without_a_delimiter_does_not_pile_up() -> None:
    reader = FrameReader()
    for _ in range(100):
        assert reader.feed(b"\x55" * 100) == []
    assert reader.damaged > 0
    assert [frame.name for frame in reader.feed(b"\0" + encode("stop", 1))] == ["stop"]


def test_an_identity_of_another_version_still_tells_its_version() -> None:
    body = bytes((2, 0, 9, protocol.PROTOCOL_VERSION + 1)) + b"a layout of the future"
    block = cobs.encode(body + crc32(body).to_bytes(4, "little")) + b"\0"
    (frame,) = FrameReader().feed(block)
    assert frame.values == {"reply_to": 9, "protocol": protocol.PROTOCOL_VERSION + 1}


@pytest.mark.parametrize("payload", [b"", b"\1\2", b"\0" * 20])
def test_a_payload_of_the_wrong_length_is_damage(payload: bytes) -> None:
    body = bytes((8, 0)) + payload  # samples: 19 bytes and whole items of 12
    assert protocol.decode(cobs.encode(body + crc32(body).to_bytes(4, "little"))) is None


def test_a_payload_too_long_for_a_frame_is_refused() -> None:
    with pytest.raises(ValueError, match="at most 240"):
        encode(
            "report", 0, dict.fromkeys((f.name for f in protocol.MESSAGES[9].fields), 0), np.zeros(50, "<u4,<u4,<u4")
        )
