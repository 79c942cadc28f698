"""DMA1 channel 7 (RM0394, chapter 11): from memory to USART2, a byte at a time."""

from collections.abc import Callable, Sequence
from typing import Protocol

from firmware_host.emulator.chip.bus import Register, StoredRegister, Violation
from firmware_host.emulator.chip.nvic import Nvic

_ENABLE, _COMPLETE_INTERRUPT, _TO_PERIPHERAL, _MEMORY_INCREMENT = 1 << 0, 1 << 1, 1 << 4, 1 << 7
_ERROR_INTERRUPT = 1 << 3  # of transfers without memory, which end the run here
_PRIORITY = 3 << 12
_GLOBAL, _COMPLETE = 1 << 0, 1 << 1  # flags of a channel
_CHANNEL, _IRQ, _REQUEST = 7, 17, 2  # channel 7 serves USART2_TX when it selects request 2
_FLAG_SHIFT = 4 * (_CHANNEL - 1)


class Memory(Protocol):
    """The memory that DMA reads."""

    def read(self, address: int, size: int) -> bytes: ...


class Dma1:
    """The controller with its one used channel. `data_register`: address of the register that the channel may write.

    USART2 requests the bytes with `fetch`, and sets `on_switched(on)`, which is called when the channel is switched on
    or off.
    """

    name = "DMA1"
    base = 0x4002_0000

    def __init__(self, memory: Memory, nvic: Nvic, data_register: int) -> None:
        modes = _ENABLE | _COMPLETE_INTERRUPT | _ERROR_INTERRUPT | _TO_PERIPHERAL | _MEMORY_INCREMENT | _PRIORITY
        self._memory = memory
        self._nvic = nvic
        self._data_register = data_register
        self._control = StoredRegister("DMA1 CCR7", modes)
        self._peripheral_address = StoredRegister("DMA1 CPAR7", 0xFFFF_FFFF)
        self._memory_address = StoredRegister("DMA1 CMAR7", 0xFFFF_FFFF)
        self._selection = StoredRegister("DMA1 CSELR", 0xF << _FLAG_SHIFT)
        self.on_switched: Callable[[bool], None] = lambda _on: None
        self.reset()

    def reset(self) -> None:
        for register in (self._control, self._peripheral_address, self._memory_address, self._selection):
            register.reset()
        self._length = self._moved = self._flags = 0
        self._nvic.set_line(_IRQ, False)

    def registers(self) -> Sequence[Register]:
        return (
            Register(0x00, "ISR", lambda: self._flags << _FLAG_SHIFT, None),
            Register(0x04, "IFCR", None, self._clear_flags),
            Register(0x80, "CCR7", self._control.read, self._write_control),
            Register(0x84, "CNDTR7", lambda: self.remaining, self._write_length),
            self._peripheral_address.map_to(0x88),
            self._memory_address.map_to(0x8C),
            self._selection.map_to(0xA8),
        )

    @property
    def enabled(self) -> bool:
        return bool(self._control.value & _ENABLE)

    @property
    def remaining(self) -> int:
        """The number of bytes still in memory."""
        return self._length - self._moved

    def fetch(self, count: int) -> bytes:
        """Read the next `count` bytes, at most `remaining`, at their present values in memory."""
        data = self._memory.read(self._memory_address.value + self._moved, count)
        self._moved += count
        if not self.remaining:
            self._flags |= _COMPLETE | _GLOBAL
            self._request_interrupt()
        return data

    def _clear_flags(self, value: int) -> None:
        if value >> _FLAG_SHIFT & (_GLOBAL | _COMPLETE):
            self._flags = 0
        self._request_interrupt()

    def _request_interrupt(self) -> None:
        self._nvic.set_line(_IRQ, bool(self._flags & self._control.value & _COMPLETE_INTERRUPT))

    def _write_length(self, value: int) -> None:
        if self.enabled:
            raise Violation("dma_busy", "DMA1 CNDTR7 written while the channel is on", "Switch the channel off first")
        self._length = value & 0xFFFF
        self._moved = 0

    def _write_control(self, value: int) -> None:
        was_enabled = self.enabled
        self._control.write(value)
        if self.enabled and not was_enabled:
            self._check()
        if self.enabled != was_enabled:
            self.on_switched(self.enabled)
        self._request_interrupt()

    def _check(self) -> None:
        needed = _TO_PERIPHERAL | _MEMORY_INCREMENT
        request = self._selection.value >> _FLAG_SHIFT
        target = self._peripheral_address.value
        if target != self._data_register or request != _REQUEST or self._control.value & needed != needed:
            raise Violation(
                "dma_misrouted",
                f"DMA1 channel 7 switched on with CPAR 0x{target:08X}, request {request}, "
                f"CCR 0x{self._control.value:X}: on this board it feeds 0x{self._data_register:08X} (USART2 TDR) only",
                "Set CSELR to request 2, CPAR, DIR and MINC before EN",
            )
        if not self.remaining:
            raise Violation("dma_empty", "DMA1 channel 7 switched on with CNDTR7 = 0", "Set CNDTR7 before EN")
