"""Frames by the host's codec, the firmware's and PyPI's: what is sent comes back, what is damaged does not."""

import subprocess
from itertools import pairwise
from pathlib import Path
from struct import calcsize
from typing import Any
from zlib import crc32

import numpy as np
import pytest
from cobs import cobs
from hypothesis import example, given
from hypothesis import strategies as st

from firmware_host import protocol, stuffing
from firmware_host.frames import FrameReader, decode, encode
from firmware_host.protocol import MESSAGES, Message
from support.board.damaged_stream import carry, transmission
from support.board.host_frames import CReceiver, decode_in_c, encode_in_c
from support.paths import FIRMWARE

LIMITS = {
    "u8": (0, 2**8 - 1),
    "u16": (0, 2**16 - 1),
    "u32": (0, 2**32 - 1),
    "u64": (0, 2**64 - 1),
    "i16": (-(2**15), 2**15 - 1),
}


OF_A_TABLE = {
    "mode": protocol.MODES,
    "method": protocol.METHODS,
    "status": protocol.SOLUTION_STATUSES,
    "quantity": protocol.QUANTITIES,
}
YEAR_10000_S = 253_402_300_800


def value_of(kind: str) -> st.SearchStrategy[Any]:
    """Any value a field of this kind can hold."""
    if kind in LIMITS:
        return st.integers(*LIMITS[kind])
    if kind in ("f32", "f64"):
        return st.floats(width=32, allow_nan=False)
    if kind == "vector_f32":
        return st.tuples(*[st.floats(width=32, allow_nan=False)] * 3)
    if kind == "matrix_f32":
        return st.tuples(*[value_of("vector_f32")] * 3)
    size = int(protocol.KINDS[kind][0].removesuffix("s"))
    return st.binary(min_size=size, max_size=size)


@st.composite
def messages(draw: st.DrawFn) -> tuple[Message, int, dict[str, Any], np.ndarray | None]:
    """Any message with any contents that fit."""
    message = draw(st.sampled_from(MESSAGES))
    values = {field.name: draw(value_of(field.kind)) for field in message.fields}
    for name in OF_A_TABLE.keys() & values.keys():
        values[name] = draw(st.integers(0, len(OF_A_TABLE[name]) - 1))
    if "written_unix_s" in values:
        values["written_unix_s"] %= YEAR_10000_S
    items = None
    if message.items:
        room = (protocol.PAYLOAD_MAX - message.head.size) // message.item_dtype.itemsize
        count = draw(st.integers(0, room))
        size = count * message.item_dtype.itemsize
        items = np.frombuffer(bytearray(draw(st.binary(min_size=size, max_size=size))), message.item_dtype)
        for name in OF_A_TABLE.keys() & set(message.item_dtype.names or ()):
            items[name] %= len(OF_A_TABLE[name])
        if "count" in values:
            values["count"] = count
    if message.name == "identity":
        values["protocol"] = protocol.PROTOCOL_VERSION
    return message, draw(st.integers(0, 255)), values, items


Sent = tuple[Message, int, dict[str, Any], np.ndarray | None]


def wire_of(sent: Sent) -> bytes:
    message, sequence, values, items = sent
    return encode(message.name, sequence, values, items)


def by_packages(wire: bytes) -> tuple[int, int, bytes] | None:
    """Type, sequence and payload of a block by PyPI's cobs and the standard library; None when it is damaged."""
    try:
        body = cobs.decode(wire)
    except cobs.DecodeError:
        return None
    if not 6 <= len(body) <= protocol.PAYLOAD_MAX + 6 or crc32(body[:-4]).to_bytes(4, "little") != body[-4:]:
        return None
    return body[0], body[1], body[2:-4]


# One message through every pair of codecs


@pytest.mark.slow
@given(messages())
def test_every_message_comes_back_as_it_was_sent(sent: Sent) -> None:
    message, sequence, values, items = sent
    (frame,) = FrameReader().feed(wire_of(sent))
    assert (frame.name, frame.sequence, frame.values) == (message.name, sequence, values)
    assert frame.items.tobytes() == (b"" if items is None else items.tobytes())


@pytest.mark.slow
@given(messages())
def test_host_firmware_and_packages_read_and_write_the_same_frame(sent: Sent) -> None:
    wire = wire_of(sent)
    read = decode_in_c(wire[:-1])
    assert read is not None and read == by_packages(wire[:-1])
    assert read[:2] == (sent[0].code, sent[1])
    assert encode_in_c(*read) == wire


@pytest.mark.slow
@given(st.integers(0, 255), st.integers(0, 255), st.binary(max_size=protocol.PAYLOAD_MAX))
@example(1, 0, bytes(protocol.PAYLOAD_MAX))
@example(255, 255, b"\xff" * protocol.PAYLOAD_MAX)
def test_any_payload_is_framed_alike(kind: int, sequence: int, payload: bytes) -> None:
    body = bytes((kind, sequence)) + payload
    body += crc32(body).to_bytes(4, "little")
    wire = encode_in_c(kind, sequence, payload)
    assert wire == cobs.encode(body) + b"\0" == stuffing.stuff(body) + b"\0"
    assert decode_in_c(wire[:-1]) == by_packages(wire[:-1]) == (kind, sequence, payload)


@pytest.mark.slow
@given(st.binary(max_size=254) | st.lists(st.integers(1, 9), max_size=254).map(bytes))
def test_every_way_to_unstuff_gives_the_same(block: bytes) -> None:
    assert stuffing.unstuff_in_python(block) == stuffing.unstuff_by_package(block)


@given(st.binary(max_size=260))
def test_noise_decodes_to_nothing(block: bytes) -> None:
    read = decode_in_c(block)
    assert read == by_packages(block)
    assert read is not None or decode(block) is None


@given(st.binary(min_size=2, max_size=242), st.data())
def test_a_damaged_frame_is_dropped_and_a_sound_one_decodes(body: bytes, data: st.DataObject) -> None:
    block = bytearray(cobs.encode(body + crc32(body).to_bytes(4, "little")))
    assert decode_in_c(bytes(block)) == (body[0], body[1], body[2:])
    bit = data.draw(st.integers(0, 8 * len(block) - 1))
    block[bit // 8] ^= 1 << bit % 8
    assert decode_in_c(bytes(block)) is None


# The layout of every message in C, as a compiler sees it


def test_the_c_structures_have_the_layout_of_the_table(tmp_path: Path) -> None:
    structs = {f"{m.name}_payload": m.fields for m in MESSAGES} | {f"{m.name}_item": m.items for m in MESSAGES}
    expected = []
    prints = []
    for struct_name, fields in structs.items():
        offset = 0
        for field in fields:
            size = calcsize("<" + protocol.KINDS[field.kind][0])
            expected.append(f"{struct_name}.{field.name} {offset} {size}")
            place = f"offsetof(struct {struct_name}, {field.name}), sizeof ((struct {struct_name} *)0)->{field.name}"
            prints.append(f'printf("{struct_name}.{field.name} %zu %zu\\n", {place});')
            offset += size
    source = ['#include "protocol.h"', "#include <stddef.h>", "#include <stdio.h>", "int main(void) {", *prints, "}"]
    (tmp_path / "layout.c").write_text("\n".join(source))
    subprocess.run(["gcc", "-I", FIRMWARE / "core" / "link", "-o", "layout", "layout.c"], cwd=tmp_path, check=True)
    printed = subprocess.run([tmp_path / "layout"], capture_output=True, text=True, check=True).stdout
    assert printed.splitlines() == expected


# Streams


@pytest.mark.slow
@given(
    st.lists(messages(), min_size=1, max_size=5, unique_by=lambda one: one[1]),
    st.lists(st.integers(0, 2000), max_size=8),
)
def test_frames_survive_any_chopping_of_the_stream(sent: list[Sent], cuts: list[int]) -> None:
    stream = b"".join(wire_of(one) for one in sent)
    edges = [0, *sorted(min(cut, len(stream)) for cut in cuts), len(stream)]
    reader, receiver = FrameReader(), CReceiver()
    received = [frame for start, end in pairwise(edges) for frame in reader.feed(stream[start:end])]
    received_in_c = [frame for start, end in pairwise(edges) for frame in receiver.feed(stream[start:end])]
    assert [frame.name for frame in received] == [message.name for message, *_ in sent]
    assert [frame[:2] for frame in received_in_c] == [(message.code, sequence) for message, sequence, *_ in sent]
    assert reader.damaged == receiver.damaged == 0


@pytest.mark.slow
@given(messages(), st.data())
def test_a_flipped_bit_costs_at_most_the_frame_it_is_in_and_never_makes_a_wrong_one(
    sent: Sent, data: st.DataObject
) -> None:
    message, sequence, values, _items = sent
    good = wire_of(sent)
    bit = data.draw(st.integers(0, 8 * len(good) - 1))
    bad = bytearray(good)
    bad[bit // 8] ^= 1 << bit % 8
    stream = b"\0" + bytes(bad) + b"\0" + good
    reader, receiver = FrameReader(), CReceiver()
    received = reader.feed(stream)
    assert [(frame.name, frame.sequence, frame.values) for frame in received] == [(message.name, sequence, values)]
    assert [frame[:2] for frame in receiver.feed(stream)] == [(message.code, sequence)]
    assert reader.damaged == receiver.damaged >= 1


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.parametrize("faults", [2500, 50_000])
def test_a_damaged_line_costs_what_it_touched_and_every_loss_is_counted(faults: int) -> None:
    outcome = carry(seed=faults, count=50_000, faults=faults)
    assert outcome.touched > 0.6 * min(faults, outcome.sent)
    for receiver in (outcome.host, outcome.firmware):
        assert (receiver.wrong, receiver.missed) == (0, 0)
        assert (receiver.accepted, receiver.refused) == (outcome.intact, outcome.damaged)
    assert outcome.frames_lost_by_sequence == outcome.frames_lost > 0
    assert outcome.samples_lost_by_sequence == outcome.samples_lost > 0


def test_a_count_that_starts_afresh_is_no_loss_when_it_was_announced() -> None:
    reader = FrameReader()
    reader.feed(encode("ack", 250, {"reply_to": 1}) + encode("ack", 1, {"reply_to": 1}))
    assert reader.lost == 6
    reader.expect_restart()
    reader.feed(encode("ack", 0, {"reply_to": 1}) + encode("ack", 2, {"reply_to": 1}))
    assert reader.lost == 7


@pytest.mark.slow
@pytest.mark.parametrize("mean_run", [30, 300, 3000])
def test_runs_of_bytes_that_come_twice_leave_every_frame_once_and_the_counts_exact(mean_run: int) -> None:
    """A twentieth of the bytes comes twice, in runs of less than a frame or of many."""
    random = np.random.default_rng(mean_run)
    sent = transmission(random, 5000)
    stream, arrived, at = b"".join(sent.wires), bytearray(), 0
    while at < len(stream):
        plain, run = (int(random.geometric(1 / mean)) for mean in (19 * mean_run, mean_run))
        arrived += stream[at : at + plain + run] + stream[at + plain : at + plain + run]
        at += plain + run
    reader = FrameReader()
    frames = [
        frame for begin in range(0, len(arrived), 700) for frame in reader.feed(bytes(arrived[begin : begin + 700]))
    ]
    blocks, whole = bytes(arrived).split(b"\0"), {wire[:-1] for wire in sent.wires}
    arrived_whole = whole.intersection(blocks)
    intact = [wire for wire in sent.wires if wire[:-1] in arrived_whole]
    assert [encode(frame.name, frame.sequence, frame.values, frame.items) for frame in frames] == intact
    assert reader.lost == len(sent.wires) - len(intact)
    assert reader.repeated == sum(block in whole for block in blocks) - len(intact) > 0


def identity(sequence: int, reply_to: int = 0) -> bytes:
    values = {"protocol": protocol.PROTOCOL_VERSION, "firmware": "1", "unique_id": bytes(12), "reset_cause": 1}
    return encode("identity", sequence, {"reply_to": reply_to, **values})


def test_an_idle_board_s_sign_of_life_is_the_same_again_after_256_frames_and_no_repetition() -> None:
    reader = FrameReader()
    for number in range(600):
        assert len(reader.feed(identity(number % 256))) == 1
    assert (reader.lost, reader.repeated) == (0, 0)
    assert reader.feed(identity(599 % 256)) == []
    assert (reader.lost, reader.repeated) == (0, 1)


def test_a_reset_board_s_first_words_are_no_repetition_of_those_it_greeted_with() -> None:
    reader = FrameReader()
    reader.feed(identity(0) + identity(1, reply_to=1) + encode("ack", 2, {"reply_to": 2}))
    assert [frame.sequence for frame in reader.feed(identity(0))] == [0]
    assert reader.repeated == 0


def test_noise_without_a_delimiter_does_not_pile_up() -> None:
    reader, receiver = FrameReader(), CReceiver()
    for _ in range(100):
        assert not reader.feed(b"\x55" * 100) and not receiver.feed(b"\x55" * 100)
    stream = b"\0" + encode("stop", 1)
    assert [frame.name for frame in reader.feed(stream)] == ["stop"]
    assert len(receiver.feed(stream)) == 1
    assert reader.damaged == receiver.damaged == 1


# Sound frames with unsound contents


def framed(body: bytes) -> bytes:
    return bytes(cobs.encode(body + crc32(body).to_bytes(4, "little")))


def test_an_identity_of_another_version_still_tells_its_version() -> None:
    body = bytes((2, 0, 9, protocol.PROTOCOL_VERSION + 1)) + b"a layout of the future"
    (frame,) = FrameReader().feed(framed(body) + b"\0")
    assert frame.values == {"reply_to": 9, "protocol": protocol.PROTOCOL_VERSION + 1}


@pytest.mark.parametrize(
    "body",
    [
        *(bytes((8, 0)) + payload for payload in (b"", b"\1\2", b"\0" * 20)),  # samples: 19 bytes and 12 each
        bytes((8, 0)) + bytes(19) + bytes(12),  # a count of 0 and one sample
        bytes((7, 0)) + b"ack and more",
        bytes((200, 0)),  # not in the table
        bytes((8, 0, 0, 2)) + bytes(17),  # samples of a third mode
        bytes((2, 0, 0, protocol.PROTOCOL_VERSION)) + bytes(25) + bytes(15) + b"\2",  # a sensor of a third quantity
        bytes((0x12, 0, 0, 0, 2)) + bytes(28),  # solved by a third method
        bytes((0x14, 0)) + bytes(49) + b"\xff" * 8 + bytes(52),  # written in a year nobody can name
    ],
)
def test_contents_the_table_does_not_know_are_damage(body: bytes) -> None:
    assert decode(framed(body)) is None


def test_a_payload_too_long_for_a_frame_is_refused() -> None:
    values = dict.fromkeys((f.name for f in protocol.MESSAGES[9].fields), 0)
    with pytest.raises(ValueError, match="at most 240"):
        encode("report", 0, values, np.zeros(50, "<u4,<u4,<u4"))
