"""What the board remembers: the old record or the new one, wherever the power fails."""

import ctypes
import random
import struct
from collections.abc import Callable
from dataclasses import dataclass
from zlib import crc32

import pytest

from support.board.host_board import core
from support.board.host_flash import PAGE_BYTES, PAGES, HostFlash

SEAL, CONSTANT_SEAL, OLD_SEAL = 0x334C4143, 0x324C4143, 0x314C4143  # those of before: of firmware 0.8.0 and 0.2.1
RECORD_BYTES = 189
WRITE_OPERATIONS = 26  # one erase, twenty-five doublewords
HEAD_BYTES = 61  # of a record, before its matrix; those of 0.2.1 have three scale factors there
CONSTANT_BYTES = 109  # of a record, before what temperature changes; those of 0.8.0 end there


class Store:
    """core/calibration/store.h for one sensor, with records as bytes; their sequence number is apart."""

    def __init__(self, sensor: int = 0) -> None:
        self.sensor = sensor
        self._core = core()
        for name in ("store_read", "store_write", "store_erase"):
            getattr(self._core, name).restype = ctypes.c_bool

    def read(self) -> bytes | None:
        """The record without its sequence number."""
        numbered = self.read_numbered()
        return None if numbered is None else numbered[1]

    def read_numbered(self) -> tuple[int, bytes] | None:
        buffer = ctypes.create_string_buffer(RECORD_BYTES)
        if not self._core.store_read(self.sensor, buffer):
            return None
        return struct.unpack_from("<I", buffer.raw, 2)[0], buffer.raw[:2] + bytes(4) + buffer.raw[6:]

    def write(self, record: bytes) -> bool:
        return bool(self._core.store_write(self.sensor, ctypes.create_string_buffer(record, RECORD_BYTES)))

    def erase(self) -> bool:
        return bool(self._core.store_erase(self.sensor))


def record(rng: random.Random) -> bytes:
    """Any content."""
    return rng.randbytes(2) + bytes(4) + rng.randbytes(RECORD_BYTES - 6)


def slot(sequence: int, content: bytes) -> bytes:
    """How a whole record lies in flash."""
    body = content[:2] + struct.pack("<I", sequence) + content[6:] + bytes(3)
    return body + struct.pack("<II", SEAL, crc32(body))


@dataclass(frozen=True)
class Old:
    """A record of another layout: its content, how it lies in flash, and how it is read today."""

    content: bytes
    seal: int
    read: bytes

    def slot(self, sequence: int) -> bytes:
        body = self.content[:2] + struct.pack("<I", sequence) + self.content[6:] + bytes(3)
        return body + struct.pack("<II", self.seal, crc32(body))


def constant_record(rng: random.Random) -> Old:
    """One that firmware 0.8.0 wrote: it holds at its own temperature and knows no other."""
    content = record(rng)[:CONSTANT_BYTES]
    return Old(content, CONSTANT_SEAL, content + 2 * content[HEAD_BYTES - 4 : HEAD_BYTES] + bytes(72))


def diagonal_record(rng: random.Random) -> Old:
    """One that firmware 0.2.1 wrote, with three scale factors in the place of a matrix."""
    head, numbers = record(rng)[:HEAD_BYTES], (1.1, 1.2, 1.3, 0.1, -0.2, 0.3)
    kx, ky, kz, *bias = numbers
    whole = head + struct.pack("<12f", kx, 0, 0, 0, ky, 0, 0, 0, kz, *bias)
    return Old(head + struct.pack("<6f", *numbers), OLD_SEAL, whole + 2 * head[-4:] + bytes(72))


Made = Callable[[random.Random], Old]
of_before = pytest.mark.parametrize("made", [constant_record, diagonal_record])


@pytest.fixture
def flash() -> HostFlash:
    return HostFlash()


def test_nothing_is_stored_in_erased_flash_and_nothing_in_noise(flash: HostFlash) -> None:
    rng = random.Random(1)
    assert Store().read() is None
    for _ in range(200):
        flash.put(0, rng.randbytes(PAGE_BYTES))
        flash.put(1, rng.randbytes(PAGE_BYTES))
        assert Store().read() is None


def test_a_record_comes_back_as_written_and_the_next_one_replaces_it(flash: HostFlash) -> None:
    rng = random.Random(2)
    store = Store()
    for sequence in range(1, 6):
        content = record(rng)
        assert store.write(content)
        assert store.read_numbered() == (sequence, content)


def test_a_record_lies_in_flash_as_described(flash: HostFlash) -> None:
    content = record(random.Random(3))
    assert Store().write(content)
    assert flash.contents(0).rstrip(b"\xff") == slot(1, content)


@pytest.mark.parametrize("sensor", range(3))
def test_a_write_is_one_erase_of_the_other_slot_then_each_doubleword_once_the_seal_last(
    flash: HostFlash, sensor: int
) -> None:
    rng = random.Random(4)
    for page in (2 * sensor, 2 * sensor + 1, 2 * sensor):
        flash.power_up()
        assert Store(sensor).write(record(rng))
        assert len(flash.operations) == WRITE_OPERATIONS
        erase, *programs = flash.operations
        assert (erase.page, erase.value) == (page, None)
        assert [(p.page, p.offset) for p in programs] == [(page, 8 * i) for i in range(25)]
        seal = programs[-1].value
        assert seal is not None and seal & 0xFFFFFFFF == SEAL


def test_sensors_do_not_see_each_others_records(flash: HostFlash) -> None:
    contents = [record(random.Random(i)) for i in range(3)]
    for sensor, content in enumerate(contents):
        assert Store(sensor).write(content)
    assert [Store(sensor).read() for sensor in range(3)] == contents
    assert Store(1).erase()
    assert [Store(sensor).read() for sensor in range(3)] == [contents[0], None, contents[2]]


@pytest.mark.parametrize("sequence", [0xFFFFFFFE, 0xFFFFFFFF, 0x7FFFFFFF])
def test_the_newest_record_is_found_across_the_wrap_of_its_sequence(flash: HostFlash, sequence: int) -> None:
    rng = random.Random(5)
    flash.put(1, slot(sequence, record(rng)))
    for k in range(1, 4):
        content = record(rng)
        assert Store().write(content)
        assert Store().read_numbered() == ((sequence + k) % 2**32, content)


@pytest.mark.one_in(3)
@pytest.mark.slow
@pytest.mark.parametrize("before", range(3))
def test_a_cut_at_any_operation_of_a_write_leaves_the_old_record_or_the_new_one(flash: HostFlash, before: int) -> None:
    """`before` records were written earlier. Every operation, many ways to leave the cells."""
    news = 0
    for lasts in range(WRITE_OPERATIONS):
        for seed in range(80):
            rng = random.Random(1000 * lasts + seed)
            flash = HostFlash()
            old = None
            for _ in range(before):
                old = record(rng)
                assert Store().write(old)
            new = record(rng)
            flash.power_up(lasts, rng)
            assert not Store().write(new) and flash.failed
            flash.power_up()
            found = Store().read()
            assert found in (old, new)
            news += found == new
            last = record(rng)
            assert Store().write(last) and Store().read() == last
    assert 0 < news < 80, "only the seal may make the new record"


@pytest.mark.thorough
@pytest.mark.slow
def test_two_cuts_in_a_row_leave_what_was_there_or_the_newest(flash: HostFlash) -> None:
    for first in range(WRITE_OPERATIONS):
        for second in range(WRITE_OPERATIONS):
            for seed in range(12):
                rng = random.Random((first * 100 + second) * 100 + seed)
                flash = HostFlash()
                assert Store().write(record(rng))
                flash.power_up(first, rng)
                assert not Store().write(record(rng))
                flash.power_up()
                after_first, newest = Store().read(), record(rng)
                flash.power_up(second, rng)
                assert not Store().write(newest)
                flash.power_up()
                assert Store().read() in (after_first, newest)
                assert after_first is not None


@pytest.mark.one_in(3)
@pytest.mark.slow
@pytest.mark.parametrize("before", range(1, 4))
def test_a_cut_in_an_erase_leaves_the_newest_record_or_none_but_no_older_one(flash: HostFlash, before: int) -> None:
    for lasts in range(2):
        for seed in range(300):
            rng = random.Random(seed)
            flash = HostFlash()
            for _ in range(before):
                newest = record(rng)
                assert Store().write(newest)
            flash.power_up(lasts, rng)
            assert not Store().erase()
            flash.power_up()
            assert Store().read() in (newest, None)  # pyrefly: ignore[unbound-name]  # before > 0
            assert Store().erase() and Store().read() is None


def test_a_bit_that_flips_in_a_stored_record_brings_the_one_before_back(flash: HostFlash) -> None:
    rng = random.Random(6)
    old, new = record(rng), record(rng)
    assert Store().write(old) and Store().write(new)
    whole = flash.contents(1)
    for bit in range(8 * 200):
        damaged = int.from_bytes(whole, "little") ^ 1 << bit
        flash.put(1, damaged.to_bytes(PAGE_BYTES, "little"))
        assert Store().read() == old
    flash.put(1, whole)
    assert Store().read() == new
    flash.tear(1, 40)
    assert Store().read() == old


def test_a_write_that_does_not_read_back_is_reported_and_the_old_record_stays(flash: HostFlash) -> None:
    rng = random.Random(7)
    old = record(rng)
    assert Store().write(old)
    flash.worn = (1, 24)
    assert not Store().write(record(rng))
    assert Store().read() == old


def test_no_page_is_touched_but_the_sensors_own(flash: HostFlash) -> None:
    marks = [bytes([page]) * PAGE_BYTES for page in range(PAGES)]
    for page, mark in enumerate(marks):
        flash.put(page, mark)
    assert Store(1).write(record(random.Random(8))) and Store(1).erase()
    assert [flash.contents(page) for page in (0, 1, 4, 5)] == [marks[page] for page in (0, 1, 4, 5)]


# Records of firmware 0.8.0 and 0.2.1


@of_before
def test_an_old_record_is_read_whole_also_where_the_rest_of_its_page_is_torn(flash: HostFlash, made: Made) -> None:
    old = made(random.Random(9))
    whole = old.slot(7)
    flash.put(0, whole)
    assert Store().read_numbered() == (7, old.read)
    flash.tear(0, len(whole))
    assert Store().read_numbered() == (7, old.read)
    flash.tear(0, len(whole) - 8)
    assert Store().read() is None


@of_before
def test_the_newer_of_an_old_record_and_a_new_one_counts(flash: HostFlash, made: Made) -> None:
    rng = random.Random(10)
    old, new = made(rng), record(rng)
    flash.put(0, old.slot(7))
    flash.put(1, slot(8, new))
    assert Store().read() == new
    flash.put(1, slot(6, new))
    assert Store().read() == old.read


@of_before
def test_a_write_forgets_the_old_record_once_the_new_one_is_whole_so_that_no_older_image_corrects_by_it(
    flash: HostFlash, made: Made
) -> None:
    rng = random.Random(11)
    old, new = made(rng), record(rng)
    flash.put(0, old.slot(7))
    assert Store().write(new)
    assert flash.contents(0) == b"\xff" * PAGE_BYTES
    assert Store().read_numbered() == (8, new)
    assert Store().write(record(rng)) and Store().read_numbered() != (8, new)
    assert flash.contents(1)[: len(slot(8, new))] == slot(8, new), "a new record stays beside the newest"


@pytest.mark.slow
@of_before
def test_a_cut_while_the_first_record_of_today_is_written_leaves_the_old_one_or_the_new(
    flash: HostFlash, made: Made
) -> None:
    news = 0
    for lasts in range(WRITE_OPERATIONS + 1):
        for seed in range(40):
            rng = random.Random(1000 * lasts + seed)
            flash = HostFlash()
            old, new = made(rng), record(rng)
            flash.put(0, old.slot(7))
            flash.power_up(lasts, rng)
            Store().write(new)
            assert flash.failed
            flash.power_up()
            found = Store().read()
            assert found == new if lasts == WRITE_OPERATIONS else found in (old.read, new)
            news += found == new
    assert news >= 40
