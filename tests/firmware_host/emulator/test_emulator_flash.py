"""The emulated chip's flash: erased and programmed as the manual says, torn by a power cut, kept without power."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from firmware_host.emulator.chip.flash_memory import (
    DOUBLEWORD_BYTES,
    FLASH_BYTES,
    PAGE_BYTES,
    STORE_OFFSET,
    STORE_PAGES,
    FlashMemory,
)
from firmware_host.emulator.machine import EmulatedBoard
from firmware_host.errors import BoardError
from support.board import tiny_firmware

FIRST_PAGE = STORE_OFFSET // PAGE_BYTES
PROGERR, PGAERR, SIZERR, PGSERR = 1 << 3, 1 << 5, 1 << 6, 1 << 7

PRELUDE = f"""
#define PAGE {FIRST_PAGE}u
#define STORE {0x0800_0000 + STORE_OFFSET:#x}u
#define ACR REG(0x40022000)
#define KEYR REG(0x40022008)
#define SR REG(0x40022010)
#define CR REG(0x40022014)
#define ECCR REG(0x40022018)
#define PG 1u
#define PER 2u
#define STRT (1u << 16)
#define LOCK (1u << 31)
static void wait(void) {{ while (SR & 1u << 16); }}
static void unlock(void) {{ KEYR = 0x45670123; KEYR = 0xCDEF89AB; }}
__attribute__((unused)) static void erase(uint32_t page) {{ CR = PER | page << 3; CR |= STRT; wait(); CR = 0; }}
__attribute__((unused)) static void program(uint32_t offset, uint32_t low, uint32_t high)
{{
    CR = PG;
    REG(STORE + offset) = low;
    REG(STORE + offset + 4) = high;
    wait();
    CR = 0;
}}
__attribute__((unused)) static void put_word(uint32_t word) {{ for (int i = 0; i < 4; i++) put(word >> 8 * i); }}
"""


@dataclass
class Chip:
    """A flash, and the symbols of the program in it."""

    flash: FlashMemory
    elf: bytes

    def run(self, duration_s: float) -> bytes:
        """Power up for so long. Returns what the program sent."""
        board = self.power_up()
        board.advance(duration_s)
        return board.take_sent()

    def power_up(self) -> EmulatedBoard:
        return tiny_firmware.power_up(self.flash, self.elf)


def chip(body: str, folder: Path, store: bytes = b"", torn: frozenset[int] = frozenset(), outside: str = "") -> Chip:
    """A chip whose program unlocks the flash and then does `body`; `store` is in the pages that it can write."""
    source = f"{PRELUDE} {outside} int main(void) {{ setup(); unlock(); {body} for (;;); }}"
    image, elf = tiny_firmware.build(source, folder)
    return Chip(FlashMemory(image, store, torn), elf)


def words(sent: bytes) -> list[int]:
    return [int.from_bytes(sent[i : i + 4], "little") for i in range(0, len(sent), 4)]


@pytest.mark.slow
def test_what_is_programmed_is_there_after_a_power_cycle(tmp_path: Path) -> None:
    body = "put_word(REG(STORE)); put_word(REG(STORE + 4)); if (REG(STORE) == ~0u) program(0, 0x01234567, 0x89ABCDEF);"
    one = chip(body, tmp_path)
    assert words(one.run(0.002)) == [0xFFFF_FFFF, 0xFFFF_FFFF]
    assert words(one.run(0.002)) == [0x0123_4567, 0x89AB_CDEF]


def test_an_erased_page_is_all_ones_and_its_neighbours_stay(tmp_path: Path) -> None:
    one = chip("erase(PAGE + 1);", tmp_path, store=bytes(STORE_PAGES * PAGE_BYTES))
    program = bytes(one.flash.data[:STORE_OFFSET])
    one.run(0.05)
    assert one.flash.data[:STORE_OFFSET] == program
    assert one.flash.data[STORE_OFFSET:] == bytes(PAGE_BYTES) + b"\xff" * PAGE_BYTES + bytes(
        (STORE_PAGES - 2) * PAGE_BYTES
    )
    assert one.flash.torn == set()


@pytest.mark.slow
def test_the_core_stands_still_while_the_flash_works(tmp_path: Path) -> None:
    """Twenty milliseconds of a one-millisecond timer: its handler runs once, at the end."""
    board = chip(
        """
        ticks = 0;
        /* TIM2: microseconds */
        REG(0x40021058) |= 1; REG(0x40000028) = 79; REG(0x4000002C) = ~0u; REG(0x40000014) = 1; REG(0x40000000) = 1;
        REG(0xE000E014) = 80000 - 1; REG(0xE000E018) = 0; REG(0xE000E010) = 7;
        uint32_t start = REG(0x40000024);
        erase(PAGE);
        uint32_t erased = REG(0x40000024);
        uint32_t interrupts = ticks;
        program(0, 1, 2);
        uint32_t programmed = REG(0x40000024);
        put_word(erased - start); put_word(interrupts); put_word(programmed - erased);
        """,
        tmp_path,
        outside="volatile uint32_t ticks; void systick(void) { ticks++; }",
    ).power_up()
    board.advance(0.021)
    assert board.take_sent() == b""
    board.advance(0.030)
    erase_us, interrupts, program_us = words(board.take_sent())
    assert erase_us == pytest.approx(22020, abs=5)
    assert interrupts == 1
    assert program_us == pytest.approx(82, abs=3)


@pytest.mark.one_in(3)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "status"),
    [
        ("CR = PG; *(volatile uint8_t *)STORE = 1;", SIZERR),
        ("CR = PG; *(volatile uint16_t *)STORE = 1;", SIZERR),
        ("CR = PG; REG(STORE + 4) = 1;", PGAERR),
        ("CR = PG; REG(STORE) = 1; REG(STORE + 12) = 1;", PGAERR),
        ("REG(STORE) = 1;", PGSERR),
        ("CR = STRT;", PGSERR),
        ("program(0, 1, 2); program(0, 1, 2);", PROGERR),
        ("program(0, 1, 2); program(0, 0, 0);", 0),  # to zero is always allowed
        ("CR = PG; REG(STORE + 4) = 1; program(0, 1, 2);", PGAERR | PGSERR),  # an error not cleared refuses the next
        ("CR = PG; REG(STORE + 4) = 1; SR = 0xFA; program(0, 1, 2);", 0),
        ("program(0, 1, 2); erase(PAGE); program(0, 3, 4);", 0),
    ],
)
def test_mistakes_show_in_the_status(body: str, status: int, tmp_path: Path) -> None:
    assert words(chip(f"{body} put_word(SR);", tmp_path).run(0.05)) == [status]


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("flash_locked", "CR = LOCK; CR = PG;"),
        ("flash_locked", "CR = LOCK; REG(STORE) = 1;"),
        ("flash_key", "CR = LOCK; KEYR = 0x45670123; KEYR = 1;"),
        ("flash_page", "erase(0);"),
        ("flash_busy", "CR = PG; REG(STORE) = 1; REG(STORE + 4) = 2; CR = 0;"),
        ("flash_cache", "ACR |= 1u << 10; ACR |= 1u << 12;"),
        ("flash_cache", "ACR |= 1u << 10; program(0, 1, 2); (void)REG(STORE);"),
        ("unmodelled_bits", "CR = 4;"),  # mass erase
        ("firmware_fault", "CR = PG; REG(0x08001000) = 1;"),
    ],
)
def test_what_the_chip_or_the_model_forbids_is_named(name: str, body: str, tmp_path: Path) -> None:
    with pytest.raises(BoardError) as caught:
        chip(body, tmp_path).run(0.05)
    assert caught.value.name == name


WRITE = "erase(PAGE); program(0, 1, 2); program(8, 3, 4);"


@pytest.mark.parametrize(
    ("operation", "torn", "content", "torn_bytes"),
    [
        (1, False, bytes(16), range(0)),
        (1, True, None, range(0, PAGE_BYTES, DOUBLEWORD_BYTES)),
        (2, False, b"\xff" * 16, range(0)),
        (2, True, None, range(0, 8, DOUBLEWORD_BYTES)),
        (3, False, bytes([1, 0, 0, 0, 2, 0, 0, 0]) + b"\xff" * 8, range(0)),
        (3, True, None, range(8, 16, DOUBLEWORD_BYTES)),
    ],
)
def test_a_power_cut_leaves_an_operation_undone_or_torn(
    operation: int, torn: bool, content: bytes | None, torn_bytes: range, tmp_path: Path
) -> None:
    one = chip(f"{WRITE} put(1);", tmp_path, store=bytes(STORE_PAGES * PAGE_BYTES))
    one.flash.fail_power(operation, torn)
    board = one.power_up()
    board.advance(0.1)
    assert not board.powered
    assert board.take_sent() == b""
    assert one.flash.torn == {STORE_OFFSET + offset for offset in torn_bytes}
    if content is not None:
        assert one.flash.data[STORE_OFFSET : STORE_OFFSET + 16] == content


def test_power_taken_away_during_an_operation_tears_too(tmp_path: Path) -> None:
    one = chip(WRITE, tmp_path)
    one.run(0.010)  # of 22 ms
    assert len(one.flash.torn) == PAGE_BYTES // DOUBLEWORD_BYTES


NMI = """
volatile uint32_t ecc, count;
void nmi(void) { ecc = ECCR; count++; if (count == %d) ECCR = 1u << 31; }
"""


@pytest.mark.parametrize("clears_at", [1, 3])
def test_reading_a_torn_doubleword_is_a_non_maskable_interrupt_until_cleared(clears_at: int, tmp_path: Path) -> None:
    body = """
        __asm volatile("cpsid i");
        (void)REG(STORE); __asm volatile("dsb\\n isb"); put(count);
        (void)*(volatile uint8_t *)(STORE + 13); __asm volatile("dsb\\n isb"); put(count); put_word(ecc);
        """
    torn = frozenset({STORE_OFFSET + 8})
    sent = chip("count = 0;" + body, tmp_path, bytes(32), torn, outside=NMI % clears_at).run(0.002)
    assert sent[:2] == bytes([0, clears_at])
    assert words(sent[2:]) == [1 << 31 | STORE_OFFSET + 8]


def test_a_program_that_leaves_no_room_is_refused() -> None:
    FlashMemory(bytes(STORE_OFFSET))
    with pytest.raises(BoardError, match="image_too_big"):
        FlashMemory(bytes(FLASH_BYTES))
