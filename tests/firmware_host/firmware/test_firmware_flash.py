"""The port's flash operations on the emulated chip: refusals told, errors of before forgotten, locked when done."""

from pathlib import Path

import pytest

from firmware_host.emulator.chip.flash_memory import PAGE_BYTES, STORE_OFFSET, STORE_PAGES, FlashMemory
from firmware_host.errors import BoardError
from support.board import tiny_firmware
from support.board.emulated_session import FIRST_RECORD
from support.paths import FIRMWARE

INCLUDES = (FIRMWARE / "core", *(FIRMWARE / "core").glob("*/"), FIRMWARE / "port_l432")
STORE = 0x0800_0000 + STORE_OFFSET

SOURCE = f"""
#include "flash.c"
__asm(".globl store_start\\n.set store_start, {STORE:#x}");
void nmi(void) {{ if (!flash_take_torn_read()) put('?'); }}
int main(void)
{{
    __attribute__((unused)) uint8_t bytes[8];
    setup();
    FLASH_ACR |= FLASH_ACR_DCEN;
    %s
    for (;;);
}}
"""


def run(
    body: str, folder: Path, torn: frozenset[int] = frozenset(), *, flags_lost: bool = False
) -> tuple[list[int], FlashMemory]:
    """What `body` put, and the flash after it."""
    image, elf = tiny_firmware.build(SOURCE % body, folder, INCLUDES)
    flash = FlashMemory(image, torn=torn)
    flash.flags_lost = flags_lost
    board = tiny_firmware.power_up(flash, elf)
    board.advance(0.1)
    return list(board.take_sent()), flash


def test_a_doubleword_is_programmed_once_after_an_erase_and_a_refusal_is_told_and_forgotten(tmp_path: Path) -> None:
    body = """
        put(port_flash_program(1, 16, 0x0102030405060708u));
        put(port_flash_program(1, 16, 0x1112131415161718u)); /* refused */
        put(port_flash_program(1, 24, 0x2122232425262728u)); /* in spite of that */
        put(port_flash_read(1, 16, bytes, 8)); put(bytes[0]);
        put(port_flash_erase(1));
        put(port_flash_read(1, 16, bytes, 8)); put(bytes[0]);
        put(port_flash_program(1, 16, 0x1112131415161718u));
        put(port_flash_read(1, 16, bytes, 8)); put(bytes[0]);
        """
    sent, flash = run(body, tmp_path)
    assert sent == [1, 0, 1, 1, 0x08, 1, 1, 0xFF, 1, 1, 0x18]
    changed = FIRST_RECORD + PAGE_BYTES + 16
    assert flash.data[changed : changed + 8] == bytes(range(0x18, 0x10, -1))
    assert bytes(flash.data[STORE_OFFSET:]).count(0xFF) == STORE_PAGES * PAGE_BYTES - 8


@pytest.mark.slow
@pytest.mark.parametrize("operation", ["port_flash_erase(0)", "port_flash_program(0, 0, 1)"])
def test_nothing_can_be_written_outside_of_an_operation(operation: str, tmp_path: Path) -> None:
    with pytest.raises(BoardError) as caught:
        run(f"{operation}; FLASH_CR = FLASH_CR_PG;", tmp_path)
    assert caught.value.name == "flash_locked"


@pytest.mark.slow
def test_a_torn_doubleword_is_told_each_time_and_hides_no_other(tmp_path: Path) -> None:
    body = """
        for (int i = 0; i < 2; i++) put(port_flash_read(0, 0, bytes, 8));
        put(port_flash_read(0, 8, bytes, 8));
        put(port_flash_erase(0));
        put(port_flash_read(0, 0, bytes, 8));
        """
    assert run(body, tmp_path, torn=frozenset({FIRST_RECORD}))[0] == [0, 0, 1, 1, 1]


@pytest.mark.slow
def test_a_torn_doubleword_is_told_also_where_the_chip_has_lost_the_flag_of_it(tmp_path: Path) -> None:
    body = """
        put(port_flash_read(0, 0, bytes, 8));
        put(port_flash_read(0, 8, bytes, 8));
        put(port_flash_erase(0));
        put(port_flash_read(0, 0, bytes, 8));
        """
    assert run(body, tmp_path, torn=frozenset({FIRST_RECORD}), flags_lost=True)[0] == [0, 1, 1, 1]


@pytest.mark.slow
def test_torn_flash_that_something_else_reads_is_not_taken_for_the_stores(tmp_path: Path) -> None:
    read_before = "port_flash_read(1, 0, bytes, 8);"  # and is over
    read = f"(void)REG({0x0800_0000 + FIRST_RECORD:#x});"
    body = f"{read_before} FLASH_ACR &= ~FLASH_ACR_DCEN; {read} FLASH_ECCR = FLASH_ECCR_ECCD;"
    sent, _flash = run(body, tmp_path, torn=frozenset({FIRST_RECORD}))
    assert set(sent) == {ord("?")}
