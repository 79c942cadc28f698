"""SPI1 (RM0394, chapter 40): master, eight bits, four-byte FIFOs, every byte taking its time on the bus."""

from collections import deque
from collections.abc import Callable, Sequence

from firmware_host.emulator.bus import Register, Stored, Violation
from firmware_host.emulator.clocks import Clocks
from firmware_host.emulator.timeline import NEVER, TICK_HZ, Timeline

_CPHA, _CPOL, _MSTR, _SPE, _SSI, _SSM = 1 << 0, 1 << 1, 1 << 2, 1 << 6, 1 << 8, 1 << 9
_RXNE, _TXE, _OVR, _BSY = 1 << 0, 1 << 1, 1 << 6, 1 << 7
_FRXTH = 1 << 12
_FIFO_BYTES = 4


class Spi1:
    """The bus master. `exchange(self, byte)` puts a byte on the bus and returns the one that comes back."""

    name = "SPI1"
    base = 0x4001_3000

    def __init__(self, timeline: Timeline, clocks: Clocks, exchange: Callable[["Spi1", int], int]) -> None:
        self._timeline = timeline
        self._clocks = clocks
        self._exchange = exchange
        self._control = Stored("SPI1 CR1", 0x037F, after=self.retune)
        self._control2 = Stored("SPI1 CR2", _FRXTH | 1 << 2, initial=0x0700)
        self._received: deque[tuple[int, int]] = deque()  # tick at which the byte is through, byte
        self.reset()

    def reset(self) -> None:
        self._control.reset()
        self._control2.reset()
        self.retune()
        self._received.clear()
        self._free = 0  # tick at which the bus has sent everything
        self._overrun = False
        self._polled = False

    def registers(self) -> Sequence[Register]:
        return (
            self._control.at(0x00),
            self._control2.at(0x04),
            *(Register(0x08, "SR", self._read_status, None, size) for size in (2, 4)),
            Register(0x0C, "DR", self._read_byte, self._write_byte, size=1),
            Register(0x0C, "DR", self._read_pair, self._write_pair, size=2),
        )

    @property
    def mode(self) -> int:
        """SPI mode 0–3: clock polarity and phase."""
        return (self._control.value & _CPOL) | (self._control.value & _CPHA)

    @property
    def clock_hz(self) -> float:
        return self._clocks.pclk2_hz / (2 << (self._control.value >> 3 & 7))

    def retune(self) -> None:
        """Take over a new bus clock or divider."""
        self._byte_ticks = round(8 * TICK_HZ / self.clock_hz)

    def _write_byte(self, value: int) -> None:
        needed = _SPE | _MSTR
        if self._control.value & needed != needed:
            raise Violation("spi_setup", "SPI1 is used without SPE or MSTR", "set CR1 before writing DR")
        if self._control.value & (_SSM | _SSI) != _SSM | _SSI:
            raise Violation("spi_setup", "SPI1 master without SSM and SSI falls back to slave mode", "set SSM and SSI")
        step = self._byte_ticks
        if self._free - self._timeline.now > _FIFO_BYTES * step:
            raise Violation("spi_overrun", "SPI1 DR written with the FIFO full", "wait for TXE")
        self._polled = False
        self._free = max(self._timeline.now, self._free) + step
        answer = self._exchange(self, value & 0xFF)
        if len(self._received) > _FIFO_BYTES:
            self._overrun = True
        else:
            self._received.append((self._free, answer))

    def _write_pair(self, value: int) -> None:
        self._write_byte(value & 0xFF)
        self._write_byte(value >> 8)

    def _read_byte(self) -> int:
        self._polled = False
        if not self._received or self._received[0][0] > self._timeline.now:
            raise Violation("spi_underrun", "SPI1 DR read before RXNE", "wait for RXNE")
        return self._received.popleft()[1]

    def _read_pair(self) -> int:
        low = self._read_byte()
        return low | self._read_byte() << 8

    def _read_status(self) -> int:
        status = self._status()
        if status & _BSY and not status & _RXNE:
            if self._polled:  # the firmware waits: so do we, instead of counting its turns
                self._timeline.wait_until(self._next_received())
                return self._status()
            self._polled = True
        return status

    def _next_received(self) -> int:
        """The tick at which the FIFO holds what sets RXNE: one byte with FRXTH, else two."""
        needed = 1 if self._control2.value & _FRXTH else 2
        return self._received[needed - 1][0] if len(self._received) >= needed else NEVER

    def _status(self) -> int:
        now = self._timeline.now
        waiting = self._free - now
        status = _BSY if waiting > 0 else 0
        if waiting <= (1 + _FIFO_BYTES // 2) * self._byte_ticks:
            status |= _TXE
        if self._next_received() <= now:
            status |= _RXNE
        return status | (_OVR if self._overrun else 0)
