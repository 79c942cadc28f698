"""The shipped image is what the sources build, and the register header is what the chip's maker describes."""

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

from support.board.svd import interrupts, number, peripherals, register
from support.paths import FIRMWARE

IMAGE = FIRMWARE / "image"
PORT = FIRMWARE / "port_l432"

FLASH, FLASH_SIZE = 0x08000000, 40 * 1024
RAM, RAM_SIZE = 0x20000000, 40 * 1024


# The image


def compiler_of(elf_path: Path) -> str:
    """What the compiler wrote about itself into the program."""
    with elf_path.open("rb") as file:
        comment = ELFFile(file).get_section_by_name(".comment")
        assert comment is not None
        return str(comment.data().rstrip(b"\0").decode())


@pytest.mark.slow
def test_the_sources_build_the_committed_image_byte_for_byte_wherever_they_lie(tmp_path: Path) -> None:
    elsewhere = tmp_path / "a folder of another name"
    shutil.copytree(FIRMWARE, elsewhere, ignore=shutil.ignore_patterns("image"))
    subprocess.run(["make", "-C", elsewhere], check=True, capture_output=True)
    assert compiler_of(elsewhere / "image" / "rig_l432.elf") == compiler_of(IMAGE / "rig_l432.elf"), (
        "another compiler gives other bytes: build with the one the committed image names"
    )
    for name in ("rig_l432.bin", "rig_l432.elf", "rig_l432.bin.sha256"):
        assert (elsewhere / "image" / name).read_bytes() == (IMAGE / name).read_bytes(), (
            f"{name}: run `make -C firmware_host/firmware` and commit the image"
        )


def test_the_image_fits_and_starts_with_a_vector_table() -> None:
    image = (IMAGE / "rig_l432.bin").read_bytes()
    stack, reset = (int.from_bytes(image[i : i + 4], "little") for i in (0, 4))
    assert len(image) <= FLASH_SIZE
    assert RAM < stack <= RAM + RAM_SIZE
    assert FLASH < reset < FLASH + len(image) and reset & 1, "the reset vector must be a Thumb address in the image"


def test_the_elf_is_the_image_with_names_and_little_ram() -> None:
    with (IMAGE / "rig_l432.elf").open("rb") as file:
        elf = ELFFile(file)
        flash = b"".join(s.data() for s in elf.iter_segments() if s["p_paddr"] >= FLASH and s["p_filesz"])
        ram_end = max(s["sh_addr"] + s["sh_size"] for s in elf.iter_sections() if RAM <= s["sh_addr"] < RAM + 2**16)
        symbols = elf.get_section_by_name(".symtab")
        assert isinstance(symbols, SymbolTableSection)
        names = {symbol.name for symbol in symbols.iter_symbols()}
    assert (IMAGE / "rig_l432.bin").read_bytes() in flash
    assert ram_end <= RAM + RAM_SIZE
    assert {"reset_handler", "main", "board_run", "exti9_5_handler", "fault_handler"} <= names


def test_a_barrier_stands_behind_every_sleep() -> None:
    """An erratum: waking, the first instruction may be fetched wrong while a debugger keeps the clocks on."""
    image = (IMAGE / "rig_l432.bin").read_bytes()
    halfwords = [int.from_bytes(image[at : at + 2], "little") for at in range(0, len(image) - 1, 2)]
    behind = [halfwords[at + 1 : at + 3] for at, halfword in enumerate(halfwords) if halfword == 0xBF30]  # WFI
    assert behind == [[0xF3BF, 0x8F6F]]  # ISB


# The register header


HEADER = (PORT / "registers.h").read_text()
DEFINES = re.findall(r"^#define (\w+(?:\(\w+\))?) (.+?)(?: /\*.*)?$", HEADER, re.MULTILINE)


def check_base(name: str, value: str) -> None:
    assert int(value.rstrip("u"), 16) == number(peripherals()[name.removesuffix("_BASE")], "baseAddress"), name


def check_register(name: str, value: str) -> None:
    match = re.fullmatch(r"REGISTER\((\w+)_BASE, (0x\w+)u\)", value)
    assert match is not None and name.startswith(match[1] + "_")
    element = register(match[1], name.removeprefix(match[1] + "_"))
    assert int(match[2], 16) == number(element, "addressOffset"), name


def check_field(name: str, value: str) -> None:
    """A flag is one bit wide; a value shifted into place may be wider."""
    match = re.fullmatch(r"\((1u|\(value\)) << (\d+)\)?", value)
    assert match is not None
    owner = next(r for r in REGISTERS if name.startswith(r + "_"))
    peripheral = next(b for b in BASES if owner.startswith(b + "_"))
    fields = register(peripheral, owner.removeprefix(peripheral + "_")).iter("field")
    element = next(f for f in fields if f.findtext("name") == name.removeprefix(owner + "_").removesuffix("(value)"))
    assert int(match[2]) == number(element, "bitOffset"), name
    assert match[1] == "(value)" or number(element, "bitWidth") == 1, name


def check_interrupt(name: str, value: str) -> None:
    assert int(value.rstrip("u")) == interrupts()[name.removesuffix("_IRQ")], name


BASES = [name.removesuffix("_BASE") for name, _ in DEFINES if name.endswith("_BASE")]
REGISTERS = [name for name, value in DEFINES if value.startswith("REGISTER(")]


def check_of(name: str) -> Callable[[str, str], None]:
    if name.endswith("_BASE"):
        return check_base
    if name.endswith("_IRQ"):
        return check_interrupt
    return check_register if name in REGISTERS else check_field


@pytest.mark.slow
def test_every_line_of_the_register_header_is_the_makers() -> None:
    for name, value in DEFINES:
        if name != "UNIQUE_ID":
            check_of(name)(name, value)


@pytest.mark.slow
def test_the_register_header_has_nothing_the_port_does_not_use() -> None:
    sources = "".join(path.read_text() for path in PORT.glob("*.c")) + HEADER
    sources = re.sub(r"GPIO##\w+##(\w+)", r"GPIOA\1 GPIOB\1", sources)  # by the table of parts
    names = [name.split("(")[0] for name, _ in DEFINES]
    assert [name for name in names if len(re.findall(rf"\b{name}\b", sources)) < 2] == []
    assert len(names) > 100
