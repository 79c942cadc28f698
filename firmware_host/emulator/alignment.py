"""Word accesses that the chip traps when their address is no multiple of four, and that Unicorn lets pass."""

from collections.abc import Callable

from unicorn.arm_const import UC_ARM_REG_LR, UC_ARM_REG_R0, UC_ARM_REG_SP

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.engine import Engine
from firmware_host.emulator.thumb import word_accesses

_CORE_REGISTERS = [*range(UC_ARM_REG_R0, UC_ARM_REG_R0 + 13), UC_ARM_REG_SP, UC_ARM_REG_LR]
_ENOUGH = 1_000  # an instruction that was right so often is not looked at any more: the looking costs a fifth of all


class AlignmentWatch:
    """Looks at the base register of every such instruction before it runs, from the block's first run on.

    Not of all that the program has: at each of them Unicorn goes through the whole list of those that are looked at.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._met: set[int] = set()  # addresses of those of all blocks that were to run
        self._new: dict[int, int] = {}  # the base registers of those that are not looked at yet
        self._watched: dict[int, _Watched] = {}
        self._trusted: list[int] = []

    def meet(self, address: int, code: bytes) -> bool:
        """A block is about to run for the first time: whether it must wait until `between_runs` has seen to it."""
        self._new = {at: base for at, base in word_accesses(code, address) if at not in self._met}
        return bool(self._new)

    def between_runs(self) -> None:
        """Look at what is new, and no longer at what was right often enough."""
        while self._new:
            address, base = self._new.popitem()
            forget = self._engine.on_instruction(address, self._check)
            self._watched[address] = _Watched(self._engine.register(_CORE_REGISTERS[base]), forget)
            self._met.add(address)
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
