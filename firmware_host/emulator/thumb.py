"""The decoding of Thumb instructions, to count them and to find those that trap on the chip but not in Unicorn."""

import struct
from collections.abc import Iterator

_STACK_POINTER, _PROGRAM_COUNTER = 13, 15


def instructions(code: bytes) -> list[int]:
    """Split Thumb code: a narrow instruction is its halfword, a wide one is the first halfword << 16 | the second."""
    halfwords = iter(struct.unpack(f"<{len(code) // 2}H", code))
    decoded = []
    for halfword in halfwords:
        wide = halfword >> 11 in (0b11101, 0b11110, 0b11111)
        decoded.append(halfword << 16 | next(halfwords, 0) if wide else halfword)
    return decoded


def is_floating_point(instruction: int) -> bool:
    """Return whether an instruction belongs to the floating-point unit, coprocessors 10 and 11."""
    return instruction & 0xEC00_0000 == 0xEC00_0000 and instruction >> 8 & 0xF in (10, 11)


def word_accesses(code: bytes, address: int) -> Iterator[tuple[int, int]]:
    """Yield address and base register of instructions that trap on the chip, not in Unicorn, if the base is unaligned.

    `code` starts at `address`. These are all loads and stores of more than one word or of floating-point registers
    (ARMv7-M Architecture Reference Manual, A3.2.1), whose base must be a multiple of four. Accesses by the stack
    pointer are omitted, as the core itself aligns it.
    """
    for instruction in instructions(code):
        base = _base(instruction)
        if base not in {None, _STACK_POINTER, _PROGRAM_COUNTER}:
            yield address, base
        address += 4 if instruction > 0xFFFF else 2


def _base(instruction: int) -> int | None:
    """Return the base register of an LDM, STM, LDRD, STRD or floating-point load or store; else None."""
    if instruction <= 0xFFFF:
        return instruction >> 8 & 7 if instruction >> 12 == 0b1100 else None  # LDM, STM
    first = instruction >> 16
    several = first & 0xFE40 == 0xE800 and first & 0x0180 in (0x0080, 0x0100)  # LDM, STM
    double = first & 0xFE40 == 0xE840 and first & 0x0120  # LDRD, STRD; without these bits, exclusive accesses
    between_registers = first & 0xFFE0 == 0xEC40  # VMOV
    floating = first & 0xFE00 == 0xEC00 and is_floating_point(instruction) and not between_registers
    return first & 0xF if several or double or floating else None
