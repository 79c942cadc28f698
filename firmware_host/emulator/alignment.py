"""The check of word accesses for aligned addresses, because the chip traps unaligned ones and Unicorn does not."""

from collections.abc import Callable

from unicorn.arm_const import UC_ARM_REG_LR, UC_ARM_REG_R0, UC_ARM_REG_SP

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.engine import Engine
from firmware_host.emulator.thumb import word_accesses

_CORE_REGISTERS = [*range(UC_ARM_REG_R0, UC_ARM_REG_R0 + 13), UC_ARM_REG_SP, UC_ARM_REG_LR]
_ENOUGH = 1_000  # aligned runs after which an instruction is trusted


class AlignmentWatch:
    """The check that word accesses are aligned: before each access its base register is checked.

    An instruction is watched from the first run of its block on. Once it was aligned often enough it is trusted and no
    longer watched, because Unicorn goes through the whole list of hooks at each hooked instruction.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._registered: set[int] = set()  # their addresses in all blocks so far
        self._new: dict[int, int] = {}  # base registers by address, of those not hooked yet
        self._watched: dict[int, tuple[Callable[[], int], Callable[[], None]]] = {}  # its base, the end of the watch
        self._trusted: list[int] = []

    def add_block(self, address: int, code: bytes) -> bool:
        """Register a block before its first run; return whether it must wait for `update`."""
        self._new = {
            accessed: base for accessed, base in word_accesses(code, address) if accessed not in self._registered
        }
        return bool(self._new)

    def update(self) -> None:
        """Watch new instructions, and release trusted ones. Call between two runs."""
        while self._new:
            address, base = self._new.popitem()
            register = _CORE_REGISTERS[base]
            release = self._engine.watch_instruction(address, register, _ENOUGH, self._judge)
            self._watched[address] = self._engine.register(register), release
            self._registered.add(address)
        for address in self._trusted:
            _, release = self._watched.pop(address)
            release()
        self._trusted.clear()

    def _judge(self, address: int) -> None:
        """Raise Violation if the access is not aligned. Otherwise it has been aligned often enough to be trusted."""
        read_base, _ = self._watched[address]
        base = read_base()
        if base & 3:
            raise Violation("firmware_fault", f"unaligned access by address 0x{base:08X}", "Correct the firmware")
        self._trusted.append(address)
