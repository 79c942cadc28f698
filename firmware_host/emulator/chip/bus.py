"""Memory-mapped registers: those that exist, their effects, and a named failure for all others."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from firmware_host.problem import ProblemError

Read = Callable[[], int]
Write = Callable[[int], None]


class Violation(ProblemError):
    """An action of the firmware that the emulator does not model or the chip forbids; the machine adds its location."""


@dataclass(frozen=True, slots=True)
class Register:
    """One register at `offset` from its peripheral's base, for accesses of `size` bytes.

    `read` None means write-only, `write` None read-only: the forbidden access fails the run.
    """

    offset: int
    name: str
    read: Read | None
    write: Write | None
    size: int = 4


class Peripheral(Protocol):
    """A block of registers. `reset` puts it into the state after a chip reset."""

    @property
    def name(self) -> str: ...
    @property
    def base(self) -> int: ...
    def registers(self) -> Sequence[Register]: ...
    def reset(self) -> None: ...


class StoredRegister:
    """A register that holds the written value. `name` begins with the peripheral's name.

    Writing a one to a bit outside the mask `modelled` fails the run, with the register's name.
    """

    __slots__ = ("_after", "_initial", "_modelled", "_name", "value")

    def __init__(self, name: str, modelled: int, initial: int = 0, after: Callable[[], None] | None = None) -> None:
        self.value = initial
        self._name = name
        self._initial = initial
        self._modelled = modelled | initial
        self._after = after

    def map_to(self, offset: int) -> Register:
        return Register(offset, self._name.partition(" ")[2], self.read, self.write)

    def read(self) -> int:
        return self.value

    def write(self, value: int) -> None:
        check_bits(self._name, value, self._modelled)
        self.value = value
        if self._after is not None:
            self._after()

    def reset(self) -> None:
        self.value = self._initial


def check_bits(name: str, value: int, modelled: int) -> None:
    """Raise Violation if `value` sets a bit that has no model."""
    if value & ~modelled:
        raise Violation(
            "unmodelled_bits",
            f"{name} = 0x{value:08X} sets bits that are not modelled: 0x{value & ~modelled:08X}",
            "Clear them in the firmware, or model them in firmware_host/emulator",
        )


class RegisterBus:
    """The routing of accesses in one address range to registers.

    The tables are keyed by offset and access size and hold only registers of clocked peripherals, so that the common
    access costs one dictionary look-up.
    """

    def __init__(self, base: int) -> None:
        self._base = base
        self._reads: dict[int, Read] = {}
        self._writes: dict[int, Write] = {}
        self._modelled: dict[int, tuple[Peripheral, Register]] = {}
        self._peripherals: list[tuple[int, Peripheral]] = []

    def attach(self, peripheral: Peripheral, clocked: bool = True) -> None:
        offset = peripheral.base - self._base
        self._peripherals.append((offset, peripheral))
        for register in peripheral.registers():
            self._modelled[_key(offset + register.offset, register.size)] = (peripheral, register)
        self.clock(peripheral, clocked)

    def clock(self, peripheral: Peripheral, on: bool) -> None:
        """Make the peripheral's registers accessible, or not."""
        offset = peripheral.base - self._base
        for register in peripheral.registers():
            key = _key(offset + register.offset, register.size)
            self._reads.pop(key, None)
            self._writes.pop(key, None)
            if on and register.read is not None:
                self._reads[key] = register.read
            if on and register.write is not None:
                self._writes[key] = register.write

    def read(self, offset: int, size: int) -> int:
        try:
            register = self._reads[offset << 3 | size]
        except KeyError:
            raise self._refusal("read", offset, size) from None
        return register()

    def write(self, offset: int, size: int, value: int) -> None:
        try:
            register = self._writes[offset << 3 | size]
        except KeyError:
            raise self._refusal("write", offset, size, value) from None
        register(value)

    def _refusal(self, verb: str, offset: int, size: int, value: int | None = None) -> Violation:
        """Return why the access is not allowed: the register is not modelled, lacks this access, or has no clock."""
        written = "" if value is None else f" of 0x{value:X}"
        entry = self._modelled.get(_key(offset, size))
        if entry is None:
            return Violation(
                "unmodelled_register",
                f"{8 * size}-bit {verb}{written}: {self._name(offset)} is not modelled",
                "Leave the register alone in the firmware, or model it in firmware_host/emulator",
            )
        peripheral, register = entry
        if (register.read if verb == "read" else register.write) is None:
            return Violation(
                "register_access",
                f"{verb}{written}: {peripheral.name} {register.name} does not allow it",
                "Correct the firmware",
            )
        return Violation(
            "clock_off",
            f"{verb}{written}: {peripheral.name} {register.name} has no clock",
            f"Enable {peripheral.name} in RCC first",
        )

    def _name(self, offset: int) -> str:
        candidates = [
            (base, peripheral.name) for base, peripheral in self._peripherals if base <= offset < base + 0x400
        ]
        if not candidates:
            return f"0x{self._base + offset:08X}"
        base, name = max(candidates)
        return f"{name}+0x{offset - base:02X}"


def _key(offset: int, size: int) -> int:
    return offset << 3 | size
