"""The Cortex-M4's interrupt controller (ARMv7-M Architecture Reference Manual, B3.4): pending states and priorities."""

from collections.abc import Iterator, Sequence
from functools import partial

from firmware_host.emulator.chip.bus import Register, Violation
from firmware_host.emulator.timeline import Timeline

NMI = 2
PENDSV = 14
SYSTICK = 15
FIRST_IRQ = 16  # exception number of interrupt 0
_INTERRUPTS = 84  # RM0394, table 46: 0 … 82, rounded up to whole words of priorities
_WORDS = 3
_PRIORITY_BITS = 0xF0  # the chip implements the upper four of eight


class Nvic:
    """Exceptions by number (16 + interrupt number): enabled, pending, active, priority.

    A peripheral sets its interrupt line with `set_line`. If the line is still high when the handler returns, the
    interrupt is pending again.
    """

    name = "NVIC"
    base = 0xE000_E100

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline
        self.reset()

    def reset(self) -> None:
        self._enabled = 1 << NMI | 1 << PENDSV | 1 << SYSTICK  # system exceptions cannot be disabled
        self._pending = 0
        self._lines = 0
        self._priorities = bytearray(FIRST_IRQ + 32 * _WORDS)
        self._active: list[int] = []

    def registers(self) -> Sequence[Register]:
        return tuple(self._registers())

    def set_line(self, irq: int, high: bool) -> None:
        """Set the level of a peripheral's interrupt request."""
        bit = 1 << (FIRST_IRQ + irq)
        if not high:
            self._lines &= ~bit
        elif not self._lines & bit:
            self._lines |= bit
            self._pend(bit)

    def pend(self, number: int) -> None:
        """Pend a system exception by its number."""
        self._pend(1 << number)

    def unpend(self, number: int) -> None:
        self._pending &= ~(1 << number)

    def is_pending(self, number: int) -> bool:
        return bool(self._pending >> number & 1)

    def candidate(self) -> int | None:
        """Return the pending exception that preempts the running code, if any; the core applies BASEPRI and PRIMASK."""
        waiting = self._pending & self._enabled
        if not waiting:
            return None
        if NMI in self._active:
            return None
        if waiting >> NMI & 1:  # above every priority that can be set
            return NMI
        if waiting & waiting - 1:
            number = min(_bits(waiting), key=lambda n: (self._priorities[n], n))
        else:
            number = waiting.bit_length() - 1
        if not self._active:
            return number
        current = min(self._priorities[n] for n in self._active)
        return number if self._priorities[number] < current else None

    def priority(self, number: int) -> int:
        return self._priorities[number]

    def set_system_priority(self, number: int, value: int) -> None:
        self._priorities[number] = value & _PRIORITY_BITS

    def enter(self, number: int) -> None:
        self._pending &= ~(1 << number)
        self._active.append(number)

    def leave(self) -> None:
        """End the running handler. Raise Violation if none is running."""
        if not self._active:
            raise Violation("bad_return", "exception return with no handler running", "Correct the firmware")
        number = self._active.pop()
        if self._lines >> number & 1:
            self._pending |= 1 << number

    @property
    def running(self) -> int:
        """The exception number of the running handler, 0 in thread mode."""
        return self._active[-1] if self._active else 0

    def _pend(self, bit: int) -> None:
        self._pending |= bit
        if self._enabled & bit:
            self._timeline.interrupt()

    def _registers(self) -> Iterator[Register]:
        for word in range(_WORDS):
            shift = FIRST_IRQ + 32 * word
            read_enabled, read_pending = partial(self._read, "_enabled", shift), partial(self._read, "_pending", shift)
            yield Register(0x000 + 4 * word, f"ISER{word}", read_enabled, partial(self._enable, shift))
            yield Register(0x080 + 4 * word, f"ICER{word}", read_enabled, partial(self._disable, shift))
            yield Register(0x100 + 4 * word, f"ISPR{word}", read_pending, partial(self._set_pending, shift))
            yield Register(0x180 + 4 * word, f"ICPR{word}", read_pending, partial(self._clear_pending, shift))
        for irq in range(_INTERRUPTS):
            for size in (1, 4) if irq % 4 == 0 else (1,):
                read, write = partial(self._read_priority, irq, size), partial(self._write_priority, irq, size)
                yield Register(0x300 + irq, f"IPR{irq // 4}", read, write, size)

    def _read(self, state: str, shift: int) -> int:
        bits: int = getattr(self, state)
        return bits >> shift & 0xFFFF_FFFF

    def _enable(self, shift: int, value: int) -> None:
        self._enabled |= value << shift
        if self._pending & value << shift:
            self._timeline.interrupt()

    def _disable(self, shift: int, value: int) -> None:
        self._enabled &= ~(value << shift)

    def _set_pending(self, shift: int, value: int) -> None:
        self._pend(value << shift)

    def _clear_pending(self, shift: int, value: int) -> None:
        self._pending &= ~(value << shift) | self._lines

    def _read_priority(self, irq: int, size: int) -> int:
        return int.from_bytes(self._priorities[FIRST_IRQ + irq : FIRST_IRQ + irq + size], "little")

    def _write_priority(self, irq: int, size: int, value: int) -> None:
        for i in range(size):
            self._priorities[FIRST_IRQ + irq + i] = value >> 8 * i & _PRIORITY_BITS


def _bits(mask: int) -> Iterator[int]:
    while mask:
        lowest = mask & -mask
        yield lowest.bit_length() - 1
        mask ^= lowest
