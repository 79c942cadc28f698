"""Word accesses that the chip traps when their address is no multiple of four, and that Unicorn lets pass."""

from collections.abc import Callable

from unicorn.arm_const import UC_ARM_REG_LR, UC_ARM_REG_R0, UC_ARM_REG_SP

from firmware_host.emulator.bus import Violation
from firmware_host.emulator.engine import Engine
from firmware_host.emulator.symbols import Symbols
from firmware_host.emulator.thumb import word_accesses

_CORE_REGISTERS = [*range(UC_ARM_REG_R0, UC_ARM_REG_R0 + 13), UC_ARM_REG_SP, UC_ARM_REG_LR]
_ENOUGH = 1_000  # an instruction that was right so often is not looked at any more: the looking costs a fifth of all


class AlignmentWatch:
    """Looks at the base register of every such instruction of the program before it runs."""

    def __init__(self, engine: Engine, symbols: Symbols) -> None:
        self._watched: dict[int, _Watched] = {}
        self._trusted: list[int] = []
        for start, end in symbols.code():
            for address, base in word_accesses(engine.read(start, end - start), start):
                read_base = engine.register(_CORE_REGISTERS[base])
                self._watched[address] = _Watched(read_base, engine.on_instruction(address, self._check))

    def between_runs(self) -> None:
        """Stop looking at what was right often enough."""
        for address in self._trusted:
            self._watched.pop(address).forget()
        self._trusted.clear()

    def _check(self, address: int) -> None:
        watched = self._watched[address]
        base = watched.read_base()
        if base & 3:
            raise Violation("firmware_fault", f"unaligned access by address 0x{base:08X}", "Correct the firmware")
        watched.times += 1
        if watched.times == _ENOUGH:
            self._trusted.append(address)


class _Watched:
    """One instruction: how to read its base register, how to stop looking at it, how often it has run."""

    __slots__ = ("forget", "read_base", "times")

    def __init__(self, read_base: Callable[[], int], forget: Callable[[], None]) -> None:
        self.read_base = read_base
        self.forget = forget
        self.times = 0
