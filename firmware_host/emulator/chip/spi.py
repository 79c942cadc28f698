"""SPI1 (RM0394, chapter 40): master, eight bits, two bytes per FIFO access, with their duration on the bus."""

from collections.abc import Sequence

from firmware_host.emulator.chip.bus import Register, StoredRegister, Violation
from firmware_host.emulator.chip.clocks import Clocks
from firmware_host.emulator.hooks import Bus, reader
from firmware_host.emulator.timeline import TICK_HZ, Timeline

_CPHA, _CPOL, _MSTR, _SPE, _SSI, _SSM = 1 << 0, 1 << 1, 1 << 2, 1 << 6, 1 << 8, 1 << 9
_NEEDED = _SPE | _MSTR | _SSM | _SSI


class Spi1:
    """The bus master. `mode`: the SPI mode, 0–3, of clock polarity and phase; `clock_hz`: the bus clock.

    Exchanges on the bus and reads of its status and setup bypass Python: see `hooks.ll`.
    """

    name = "SPI1"
    base = 0x4001_3000

    def __init__(self, timeline: Timeline, clocks: Clocks) -> None:
        self._timeline = timeline
        self._clocks = clocks
        self.bus = Bus()
        self._control = StoredRegister("SPI1 CR1", 0x037F, after=self.retune)
        self._control2 = StoredRegister("SPI1 CR2", 0, initial=0x0700)
        self.reset()

    def reset(self) -> None:
        self._control.reset()
        self._control2.reset()
        self.retune()
        self.bus.waiting = self.bus.free = self.bus.polled = 0

    def registers(self) -> Sequence[Register]:
        return (
            Register(0x00, "CR1", self._control.read, self._write_control),
            self._control2.map_to(0x04),
            Register(0x08, "SR", reader("read_status", self.bus, self._timeline), None),
            Register(0x0C, "DR", self._refuse_read, self._refuse_write, size=2),
        )

    def retune(self) -> None:
        """Apply a new bus clock or control register."""
        control, bus = self._control.value, self.bus
        self.mode = control & (_CPOL | _CPHA)
        self.clock_hz = self._clocks.pclk2_hz / (2 << (control >> 3 & 7))
        pair_ticks = round(16 * TICK_HZ / self.clock_hz)
        bus.control = control
        bus.speaks = control & _NEEDED == _NEEDED
        bus.pair_ticks, bus.half_bit_ticks = pair_ticks, pair_ticks // 32
        bus.setups += 1  # invalidates earlier checks

    @property
    def busy(self) -> bool:
        """Whether a transfer is pending on the bus."""
        return self.bus.free > self._timeline.now

    def _write_control(self, value: int) -> None:
        if self.busy:
            raise Violation("spi_setup", "SPI1 CR1 written while the bus is busy", "Wait until BSY is clear")
        self._control.write(value)

    def _refuse_write(self, _value: int) -> None:
        if not self.bus.speaks:
            raise Violation("spi_setup", "SPI1 is used without all of SPE, MSTR, SSM, SSI", "Set CR1 before writing DR")
        raise Violation("spi_overrun", "SPI1 DR written more than two pairs ahead of reading", "Read DR in between")

    def _refuse_read(self) -> int:
        raise Violation("spi_underrun", "SPI1 DR read before RXNE", "Wait for RXNE")
