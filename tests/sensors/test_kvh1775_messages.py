"""The KVH 1775's messages: the interface document's sample, all formats, and whatever a wire does to them."""

from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.sensors.errors import SensorError
from rig.sensors.kvh1775.kvh_messages import (
    MESSAGE_BYTES,
    BuiltInTest,
    Format,
    MessageReader,
    encode,
    encode_one,
    encode_test,
)
from rig.sensors.kvh1775.message_numbering import MessageCounter

# ICD 56-0298 Rev. B, p. 51.
SAMPLE = bytes.fromhex("FE81FF55 37A96A6E 38586C1F B75BF862 BF803E78 BB650D28 3B0A37AC 77 3D 0028 4BFA34D8")
INTERVAL_US = 1000
WHERE = "sensors.outer: the KVH 1775 on /dev/ttyUSB1"
FORMATS: tuple[Format, ...] = ("A", "B", "C")


def stream(name: Format, count: int, first: int = 0, start_us: int = 0) -> bytes:
    """`count` messages that follow each other, each unlike the others."""
    numbers = np.arange(first, first + count)
    return encode(
        name,
        rotation=np.column_stack([numbers, -numbers, numbers % 7]) * 1e-6,
        acceleration_g=np.column_stack([numbers % 11, numbers % 13, numbers]) * 1e-3,
        sequence=numbers % 128,
        temperature=numbers % 3000,
        time_us=(start_us + numbers * INTERVAL_US) % 2**32,
        fourth=numbers % 5,
    )


def test_the_interface_documents_sample() -> None:
    (message,) = MessageReader().feed(SAMPLE).messages
    assert message["rotation"].tolist() == pytest.approx([2.019593e-5, 5.159911e-5, -1.311125e-5], rel=1e-6)
    assert message["acceleration_g"].tolist() == pytest.approx([-1.0019064, -0.0034950, 0.0021090], rel=1e-4)
    assert (message["status"], message["sequence"], message["temperature"]) == (0x77, 61, 40)
    again = encode(
        "A", rotation=message["rotation"], acceleration_g=message["acceleration_g"], sequence=61, temperature=40
    )
    assert again == SAMPLE, "the CRC too"


@pytest.mark.parametrize("name", FORMATS)
def test_one_message_without_arrays_is_the_same(name: Format) -> None:
    rotation, acceleration_g = [1.234567891e-5, -0.1, -0.0], [0.3, 1e-9, -1.0019064]
    tail = {"sequence": 77, "status": 0x73, "temperature": -40, "time_us": 4_000_000_000, "fourth": 31.26}
    arrays = encode(name, rotation=rotation, acceleration_g=acceleration_g, **tail)
    assert encode_one(name, rotation, acceleration_g, **tail) == arrays


def test_the_all_good_built_in_test_of_the_manual() -> None:
    sent = bytes.fromhex("FE8100AA 7F7F7F7F7F7F 23")  # p. 29
    assert encode_test(b"\x7f" * 6) == sent
    assert MessageReader().feed(sent).tests == (BuiltInTest(b"\x7f" * 6),)
    assert not BuiltInTest(b"\x7f\x7f\x7e\x7f\x7f\x7f\x7f\x7f").passed


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("piece", [1, 3, 41, 1000])
def test_pieces_of_any_size(name: Format, piece: int) -> None:
    data, reader = stream(name, 50), MessageReader()
    read = [reader.feed(data[at : at + piece]).messages for at in range(0, len(data), piece)]
    messages = np.concatenate(read)
    assert messages["sequence"].tolist() == list(range(50))
    assert (messages["format"] == name.encode()).all()
    assert messages["rotation"][:, 0] == pytest.approx(np.arange(50) * 1e-6)


garbage = st.one_of(st.binary(max_size=40), st.integers(4, 35).map(lambda length: SAMPLE[:length]))


@pytest.mark.slow
@given(st.lists(st.one_of(st.sampled_from(FORMATS), st.just("test"), garbage), max_size=20))
def test_whatever_stands_between_them_costs_no_whole_message(parts: list[Format | str | bytes]) -> None:
    sent = b""
    wanted = []
    for number, part in enumerate(parts):
        if isinstance(part, bytes):
            sent += part
        elif part == "test":
            sent += encode_test(b"\x7f" * 8)
        else:
            sent += stream(cast(Format, part), 1, number)
            wanted.append(number % 128)
    found = MessageReader().feed(sent + bytes(50))
    assert found.messages["sequence"].tolist() == wanted
    assert len(found.tests) == parts.count("test")


def damage(data: bytes, size: int, rng: np.random.Generator, faults: int) -> bytes:
    """`faults` of all kinds, at least two messages apart: bits turned, bytes lost, bytes that came from nowhere."""
    places = rng.choice(np.arange(1, len(data) // (3 * size)), faults, replace=False) * 3 * size
    last = 0
    pieces = []
    for place in np.sort(places + rng.integers(0, size, faults)).tolist():
        pieces.append(data[last:place])
        kind, length = rng.integers(3), int(rng.integers(1, 12))
        if kind == 0:
            pieces.append(bytes(byte ^ int(rng.integers(1, 256)) for byte in data[place : place + 1]))
            last = place + 1
        elif kind == 1:
            last = place + length
        else:
            pieces.append(rng.bytes(length))
            last = place
    return b"".join([*pieces, data[last:]])


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_of_a_hundred_thousand_damaged_here_and_there_none_is_wrong_and_no_other_is_lost(name: Format) -> None:
    count, faults = 100_000, 5000
    sent, size = stream(name, count), MESSAGE_BYTES[name]
    spoilt = damage(sent, size, np.random.default_rng(3), faults)
    reader = MessageReader()
    read = [reader.feed(spoilt[at : at + 4096]).messages for at in range(0, len(spoilt), 4096)]
    messages = np.concatenate(read)
    counter = MessageCounter(WHERE, INTERVAL_US, timed=name == "B")
    numbers, times_us = counter.count(messages)
    whole = MessageReader().feed(sent).messages[numbers]
    assert (messages == whole).all(), "what was accepted is what was sent"
    assert (times_us == numbers * INTERVAL_US).all()
    lost = count - len(messages)
    assert 0 < lost <= 1.1 * faults
    assert counter.lost == numbers[-1] + 1 - len(messages)


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("missing", [0, 1, 2, 126, 127])
def test_losses_below_128_in_a_row_are_counted(name: Format, missing: int) -> None:
    messages = MessageReader().feed(stream(name, 400)).messages
    kept = np.delete(messages, slice(200, 200 + missing))
    counter = MessageCounter(WHERE, INTERVAL_US, timed=name == "B", host_jitter_s=0.0)
    counter.count(kept[:200])
    numbers, times_us = counter.count(kept[200:], silent_s=(missing + 1) * INTERVAL_US * 1e-6)
    assert counter.lost == missing
    assert numbers.tolist() == list(range(200 + missing, 400))
    assert times_us.tolist() == [number * INTERVAL_US for number in range(200 + missing, 400)]


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("missing", [128, 129, 255, 256, 1000])
def test_losses_of_128_and_more_are_refused(name: Format, missing: int) -> None:
    messages = MessageReader().feed(stream(name, 2000)).messages
    counter = MessageCounter(WHERE, INTERVAL_US, timed=name == "B", host_jitter_s=0.0)
    counter.count(messages[:200])
    with pytest.raises(SensorError) as caught:
        counter.count(messages[200 + missing :], silent_s=(missing + 1) * INTERVAL_US * 1e-6)
    assert caught.value.name == "kvh_gap_ambiguous" and caught.value.what.startswith(f"{WHERE}: ")


def test_the_microseconds_are_counted_on_past_their_wrap() -> None:
    start_us = 2**32 - 5 * INTERVAL_US - 17  # 71.6 min after the instrument was switched on
    messages = MessageReader().feed(stream("B", 1000, start_us=start_us)).messages
    assert messages["time_us"][-1] < messages["time_us"][0]
    counter = MessageCounter(WHERE, INTERVAL_US, timed=True)
    times_us = np.concatenate([counter.count(part)[1] for part in np.array_split(messages, 9)])
    assert times_us.tolist() == [start_us + number * INTERVAL_US for number in range(1000)]
    assert counter.lost == 0


def test_a_sequence_that_its_microseconds_contradict_is_refused() -> None:
    messages = MessageReader().feed(stream("B", 20)).messages
    messages["time_us"][10:] += 3 * INTERVAL_US
    with pytest.raises(SensorError) as caught:
        MessageCounter(WHERE, INTERVAL_US, timed=True).count(messages)
    assert caught.value.name == "kvh_time_contradicts" and caught.value.what.startswith(f"{WHERE}: ")
