"""DMA1 channels 6 and 7 (RM0394, chapter 11): between memory and USART2, a byte at a time."""

from collections.abc import Callable, Sequence
from typing import Protocol

from firmware_host.emulator.bus import Register, Stored, Violation
from firmware_host.emulator.nvic import Nvic

_ENABLE, _TC_IE, _HT_IE, _TO_PERIPHERAL, _CIRCULAR = 1 << 0, 1 << 1, 1 << 2, 1 << 4, 1 << 5
_MEMORY_INCREMENT = 1 << 7
_PRIORITY = 3 << 12
_GLOBAL, _COMPLETE, _HALF = 1, 2, 4  # flags of a channel in ISR
_IRQ = {6: 16, 7: 17}


class Memory(Protocol):
    """The memory that DMA reads and writes."""

    def read(self, address: int, size: int) -> bytes: ...
    def write(self, address: int, data: bytes) -> None: ...


class Channel:
    """One channel, wired to one peripheral register. The peripheral asks for or brings the bytes."""

    def __init__(self, number: int, memory: Memory, nvic: Nvic, data_register: int, to_peripheral: bool) -> None:
        name = f"DMA1 channel {number}"
        modes = _ENABLE | _TC_IE | _MEMORY_INCREMENT | _PRIORITY
        modes |= _TO_PERIPHERAL if to_peripheral else _HT_IE | _CIRCULAR
        self._name = name
        self._irq = _IRQ[number]
        self._memory = memory
        self._nvic = nvic
        self._data_register = data_register
        self._to_peripheral = to_peripheral
        self._control = Stored(f"{name} CCR", modes)
        self._peripheral_address = Stored(f"{name} CPAR", 0xFFFF_FFFF)
        self._memory_address = Stored(f"{name} CMAR", 0xFFFF_FFFF)
        self._length = 0
        self._moved = 0
        self._flags = 0
        self.request = 0  # what CSELR selects
        self.on_switched: Callable[[bool], None] = lambda _on: None

    def reset(self) -> None:
        for register in (self._control, self._peripheral_address, self._memory_address):
            register.reset()
        self._length = self._moved = self._flags = 0
        self._nvic.set_line(self._irq, False)

    def registers(self, number: int) -> Sequence[Register]:
        offset = 0x08 + 20 * (number - 1)
        return (
            Register(offset, f"CCR{number}", self._control.read, self._write_control),
            Register(offset + 0x4, f"CNDTR{number}", lambda: self.remaining, self._write_length),
            self._peripheral_address.at(offset + 0x8),
            self._memory_address.at(offset + 0xC),
        )

    @property
    def enabled(self) -> bool:
        return bool(self._control.value & _ENABLE)

    @property
    def remaining(self) -> int:
        return self._length - self._moved

    @property
    def flags(self) -> int:
        return self._flags

    def fetch(self, count: int) -> bytes:
        """Read the next `count` bytes from memory."""
        data = self._memory.read(self._memory_address.value + self._moved, count)
        self._moved += count
        if not self.remaining:
            self._raise_flag(_COMPLETE)
        return data

    def deliver(self, byte: int) -> None:
        """Write one byte to memory."""
        self._memory.write(self._memory_address.value + self._moved, bytes([byte]))
        self._moved += 1
        if self._moved == self._length // 2:
            self._raise_flag(_HALF)
        if not self.remaining:
            if self._control.value & _CIRCULAR:
                self._moved = 0
            self._raise_flag(_COMPLETE)

    def clear_flags(self, flags: int) -> None:
        self._flags &= ~(flags if not flags & _GLOBAL else 0xF)
        if not self._flags & ~_GLOBAL:
            self._flags = 0
        self._request_interrupt()

    def _raise_flag(self, flag: int) -> None:
        self._flags |= flag | _GLOBAL
        self._request_interrupt()

    def _request_interrupt(self) -> None:
        self._nvic.set_line(self._irq, bool(self._flags & self._control.value & (_TC_IE | _HT_IE)))

    def _write_length(self, value: int) -> None:
        if self.enabled:
            raise Violation("dma_busy", f"{self._name}: CNDTR written while enabled", "disable the channel first")
        self._length = value & 0xFFFF
        self._moved = 0

    def _write_control(self, value: int) -> None:
        was_enabled = self.enabled
        self._control.write(value)
        if value & _ENABLE and not was_enabled:
            self._check()
        if self.enabled != was_enabled:
            self.on_switched(self.enabled)
        self._request_interrupt()

    def _check(self) -> None:
        control = self._control.value
        right = (
            self._peripheral_address.value == self._data_register
            and self.request == 2
            and bool(control & _TO_PERIPHERAL) == self._to_peripheral
            and bool(control & _MEMORY_INCREMENT)
        )
        if not right:
            raise Violation(
                "dma_misrouted",
                f"{self._name} enabled with CPAR 0x{self._peripheral_address.value:08X}, request {self.request}, "
                f"CCR 0x{control:X}: on this board it serves 0x{self._data_register:08X} (USART2) only",
                "set CSELR to 2, CPAR, DIR and MINC before EN",
            )
        if not self.remaining:
            raise Violation("dma_empty", f"{self._name} enabled with CNDTR = 0", "set CNDTR before EN")


class Dma1:
    """The controller: flags and request selection of its channels."""

    name = "DMA1"
    base = 0x4002_0000

    def __init__(self, channels: dict[int, Channel]) -> None:
        self._channels = channels
        self._selection = Stored("DMA1 CSELR", sum(0xF << 4 * (n - 1) for n in channels), after=self._select)

    def reset(self) -> None:
        self._selection.reset()
        for channel in self._channels.values():
            channel.reset()
        self._select()

    def registers(self) -> Sequence[Register]:
        return (
            Register(0x00, "ISR", self._read_flags, None),
            Register(0x04, "IFCR", None, self._clear_flags),
            *(register for number, channel in self._channels.items() for register in channel.registers(number)),
            self._selection.at(0xA8),
        )

    def _read_flags(self) -> int:
        return sum(channel.flags << 4 * (number - 1) for number, channel in self._channels.items())

    def _clear_flags(self, value: int) -> None:
        for number, channel in self._channels.items():
            flags = value >> 4 * (number - 1) & 0xF
            if flags:
                channel.clear_flags(flags)

    def _select(self) -> None:
        for number, channel in self._channels.items():
            channel.request = self._selection.value >> 4 * (number - 1) & 0xF
