"""The check of word accesses that the chip traps at addresses that are not a multiple of four, and Unicorn does not."""

from collections.abc import Callable

from unicorn.arm_const import UC_ARM_REG_LR, UC_ARM_REG_R0, UC_ARM_REG_SP

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.engine import Engine
from firmware_host.emulator.thumb import word_accesses

_CORE_REGISTERS = [*range(UC_ARM_REG_R0, UC_ARM_REG_R0 + 13), UC_ARM_REG_SP, UC_ARM_REG_LR]
_ENOUGH = 1_000  # aligned runs after which an instruction is trusted: the check costs a fifth of all time


class AlignmentWatch:
    """The check of the base register of every such instruction before it runs, from its block's first run on.

    Only for instructions in use: Unicorn goes through the whole list of hooks at each hooked instruction.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._registered: set[int] = set()  # their addresses in all blocks so far
        self._new: dict[int, int] = {}  # base registers by address, of those not hooked yet
        self._watched: dict[int, _WatchedInstruction] = {}
        self._trusted: list[int] = []

    def add_block(self, address: int, code: bytes) -> bool:
        """Register a block before its first run; return whether it must wait for `update`."""
        self._new = {
            accessed: base for accessed, base in word_accesses(code, address) if accessed not in self._registered
        }
        return bool(self._new)

    def update(self) -> None:
        """Hook new instructions, and release trusted ones. Call between two runs."""
        while self._new:
            address, base = self._new.popitem()
            release = self._engine.hook_instruction(address, self._check)
            self._watched[address] = _WatchedInstruction(self._engine.register(_CORE_REGISTERS[base]), release)
            self._registered.add(address)
        for address in self._trusted:
            self._watched.pop(address).release()
        self._trusted.clear()

    def _check(self, address: int) -> None:
        watched = self._watched[address]
        base = watched.read_base()
        if base & 3:
            raise Violation("firmware_fault", f"unaligned access by address 0x{base:08X}", "Correct the firmware")
        watched.times += 1
        if watched.times == _ENOUGH:
            self._trusted.append(address)


class _WatchedInstruction:
    """One instruction: the reader of its base register, the release of its hook, and the count of its runs."""

    __slots__ = ("read_base", "release", "times")

    def __init__(self, read_base: Callable[[], int], release: Callable[[], None]) -> None:
        self.read_base = read_base
        self.release = release
        self.times = 0
