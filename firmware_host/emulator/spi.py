"""SPI1 (RM0394, chapter 40): master, eight bits, two bytes an access to its FIFOs, each taking its time on the bus."""

from collections.abc import Callable, Sequence

from firmware_host.emulator.bus import Register, Stored, Violation
from firmware_host.emulator.clocks import Clocks
from firmware_host.emulator.hooks import FIFO_PAIRS, Bus, elsewhere
from firmware_host.emulator.timeline import TICK_HZ, Timeline

_CPHA, _CPOL, _MSTR, _SPE, _SSI, _SSM = 1 << 0, 1 << 1, 1 << 2, 1 << 6, 1 << 8, 1 << 9


class Spi1:
    """The bus master. `exchange(self, low, high)` puts two bytes on the bus and returns those that come back.

    Reads of its status and of what has come do not come here: see `hooks.ll`.
    """

    name = "SPI1"
    base = 0x4001_3000

    def __init__(self, timeline: Timeline, clocks: Clocks, exchange: Callable[["Spi1", int, int], int]) -> None:
        self._timeline = timeline
        self._clocks = clocks
        self._exchange = exchange
        self.bus = Bus()
        self.setup_count = 0  # how often mode or clock have been set: what was checked before may no longer hold
        self._control = Stored("SPI1 CR1", 0x037F, after=self.retune)
        self._control2 = Stored("SPI1 CR2", 0, initial=0x0700)
        self.reset()

    def reset(self) -> None:
        self._control.reset()
        self._control2.reset()
        self.retune()
        self.bus.waiting = self.bus.free = self.bus.polled = 0

    def registers(self) -> Sequence[Register]:
        return (
            Register(0x00, "CR1", self._control.read, self._write_control),
            self._control2.at(0x04),
            Register(0x08, "SR", elsewhere, None),
            Register(0x0C, "DR", self._underrun, self._write_data, size=2),
        )

    @property
    def mode(self) -> int:
        """SPI mode 0–3: clock polarity and phase."""
        return self._control.value & (_CPOL | _CPHA)

    @property
    def clock_hz(self) -> float:
        return self._clocks.pclk2_hz / (2 << (self._control.value >> 3 & 7))

    def retune(self) -> None:
        """Take over a new bus clock or divider."""
        self.bus.pair_ticks = self._pair_ticks = round(16 * TICK_HZ / self.clock_hz)
        self._half_bit_ticks = self._pair_ticks // 32
        self.setup_count += 1

    @property
    def busy(self) -> bool:
        """Something is still on the bus."""
        return bool(self.bus.free > self._timeline.now)

    def _write_control(self, value: int) -> None:
        if self.busy:
            raise Violation("spi_setup", "SPI1 CR1 written while the bus is busy", "Wait until BSY is clear")
        self._control.write(value)

    def _write_data(self, value: int) -> None:
        needed = _SPE | _MSTR | _SSM | _SSI
        if self._control.value & needed != needed:
            raise Violation("spi_setup", "SPI1 is used without all of SPE, MSTR, SSM, SSI", "Set CR1 before writing DR")
        bus, waiting = self.bus, self.bus.waiting
        if waiting == FIFO_PAIRS:
            raise Violation("spi_overrun", "SPI1 DR written more than two pairs ahead of reading", "Read DR in between")
        bus.polled = 0
        bus.answers[waiting] = self._exchange(self, value & 0xFF, value >> 8)
        bus.free = free = max(self._timeline.now, bus.free) + self._pair_ticks
        bus.ready[waiting] = free - self._half_bit_ticks  # a bit is taken in its middle
        bus.waiting = waiting + 1

    def _underrun(self) -> int:
        raise Violation("spi_underrun", "SPI1 DR read before RXNE", "Wait for RXNE")
