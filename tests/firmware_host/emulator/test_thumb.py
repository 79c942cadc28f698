"""What the emulator reads out of code and symbols, against the cross-compiler's own tools."""

import re
import subprocess
from functools import cache

import pytest

from firmware_host.emulator.symbols import Symbols
from firmware_host.emulator.thumb import instructions, is_floating_point, word_accesses
from support.paths import IMAGE

ELF = IMAGE / "rig_l432.elf"
SEVERAL_WORDS = re.compile(r"(ldrd|strd|ldm|stm|vldr|vstr|vldm|vstm)")


@cache
def listed() -> list[tuple[int, bytes, str, str]]:
    """Address, code, mnemonic and operands of every instruction of the image."""
    listing = subprocess.run(["arm-none-eabi-objdump", "-dz", ELF], check=True, capture_output=True, text=True).stdout
    lines = re.findall(r"^ +([0-9a-f]+):\t([0-9a-f ]+)\t(\S+)(?:\t([^@\n]*))?", listing, re.MULTILINE)
    return [
        (int(address, 16), b"".join(bytes.fromhex(halfword)[::-1] for halfword in code.split()), name, operands)
        for address, code, name, operands in lines
        if not name.startswith(".")
    ]


@cache
def disassembly() -> dict[int, tuple[str, str]]:
    """Address → (mnemonic, operands) of every instruction of the image."""
    return {address: (name, operands) for address, _, name, operands in listed()}


def stretches() -> list[tuple[int, bytes]]:
    """Where each stretch of instructions starts, and its bytes: between them lie literals and tables."""
    found: list[tuple[int, bytes]] = []
    for address, code, _, _ in listed():
        start, before = found[-1] if found else (0, b"")
        if address == start + len(before):
            found[-1] = start, before + code
        else:
            found.append((address, code))
    return found


@cache
def symbols() -> Symbols:
    return Symbols(ELF.read_bytes())


@pytest.mark.slow
def test_instructions_are_told_from_each_other() -> None:
    found = {}
    for start, code in stretches():
        address = start
        for instruction in instructions(code):
            found[address] = instruction
            address += 4 if instruction > 0xFFFF else 2
    assert set(found) == set(disassembly())
    floating = {address for address, instruction in found.items() if is_floating_point(instruction)}
    assert floating == {address for address, (name, _) in disassembly().items() if name.startswith("v")}


def test_accesses_of_several_words_are_found_with_their_base_register() -> None:
    registers = [f"r{n}" for n in range(10)] + ["sl", "fp", "ip", "sp", "lr", "pc"]
    expected = {
        address: re.findall(r"\[?\b(r\d|sl|fp|ip|sp|lr|pc)\b", operands)
        for address, (name, operands) in disassembly().items()
        if SEVERAL_WORDS.match(name)
    }
    bases = {
        address: names[0] if disassembly()[address][0].startswith(("ldm", "stm")) else names[-1]
        for address, names in expected.items()
    }
    aligned_by_the_core = ("sp", "pc")
    found = {address: registers[base] for start, code in stretches() for address, base in word_accesses(code, start)}
    assert len(found) > 10
    assert found == {address: base for address, base in bases.items() if base not in aligned_by_the_core}


def test_addresses_have_the_names_of_their_functions() -> None:
    listing = subprocess.run(["arm-none-eabi-nm", ELF], check=True, capture_output=True, text=True).stdout
    entry = {name: int(address, 16) for address, name in re.findall(r"^([0-9a-f]+) T (\w+)$", listing, re.MULTILINE)}
    for name in ("reset_handler", "main", "board_run", "exti9_5_handler"):
        assert symbols().function(entry[name]) == symbols().function(entry[name] + 3) == name
    assert symbols().describe(entry["board_run"] + 1) == f"0x{entry['board_run']:08X} in function board_run"
    assert symbols().describe(0x60000000) == "0x60000000 outside every function of the image"
