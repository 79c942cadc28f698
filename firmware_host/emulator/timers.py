"""TIM2 as a free-running counter and the independent watchdog (RM0394, chapters 28 and 31)."""

from collections.abc import Callable, Sequence
from math import gcd

from firmware_host.emulator.bus import Register, Stored, Violation, check_bits
from firmware_host.emulator.clocks import Clocks
from firmware_host.emulator.hooks import Counter, reader
from firmware_host.emulator.timeline import TICK_HZ, Timeline

_LSI_HZ = 32_000
_START, _KICK, _UNLOCK = 0xCCCC, 0xAAAA, 0x5555


class Tim2:
    """A free-running 32-bit up-counter. The prescaler acts from the next update event on, as on the chip.

    The counter stands while the auto-reload register is 0, as it is after a reset by the maker's own file. It is
    read by machine code: see `hooks.ll`.
    """

    name = "TIM2"
    base = 0x4000_0000

    def __init__(self, timeline: Timeline, clocks: Clocks) -> None:
        self._timeline = timeline
        self._clocks = clocks
        self.counter = Counter()
        self._control = Stored("TIM2 CR1", 1, after=self._switch)
        self._prescaler = Stored("TIM2 PSC", 0xFFFF)
        self._reload = Stored("TIM2 ARR", 0xFFFF_FFFF, after=self._switch)
        self.reset()

    def reset(self) -> None:
        self._control.reset()
        self._prescaler.reset()
        self._reload.reset()
        self._divider = 1  # the prescaler in effect, plus one
        self._runs = False
        counter = self.counter
        counter.counted = counter.since = counter.read_at = counter.polls = 0
        self.retune()

    def registers(self) -> Sequence[Register]:
        return (
            self._control.at(0x00),
            Register(0x14, "EGR", None, self._generate),
            Register(0x24, "CNT", reader("read_count", self.counter, self._timeline), None),
            self._prescaler.at(0x28),
            self._reload.at(0x2C),
        )

    def retune(self) -> None:
        """Take over a new bus clock, prescaler or reload value."""
        clocks, counter = self._clocks, self.counter
        # RM0394, section 6.2.14: timers run at twice the bus clock when the bus is divided
        timer_hz = clocks.pclk1_hz * (1 if clocks.pclk1_hz == clocks.core_hz else 2)
        scale = TICK_HZ * self._divider
        common = gcd(timer_hz, scale)
        counter.counts, counter.ticks = timer_hz // common if self._runs else 0, scale // common
        counter.modulus = self._reload.value + 1

    def _switch(self) -> None:
        counter = self.counter
        counter.counted += (self._timeline.now - counter.since) * counter.counts // counter.ticks
        counter.counted %= self._reload.value + 1
        counter.since = self._timeline.now
        self._runs = bool(self._control.value & 1 and self._reload.value)
        self.retune()

    def _generate(self, value: int) -> None:
        check_bits("TIM2 EGR", value, 1)
        self._divider = self._prescaler.value + 1
        self.counter.counted, self.counter.since = 0, self._timeline.now
        self.retune()


class Watchdog:
    """IWDG: calls `on_bite` when it is not kicked in time. Once started only a reset stops it."""

    name = "IWDG"
    base = 0x4000_3000

    def __init__(self, timeline: Timeline, on_bite: Callable[[], None]) -> None:
        self._timeline = timeline
        self._slot = timeline.register(on_bite)
        self._prescaler = Stored("IWDG PR", 7)
        self._reload = Stored("IWDG RLR", 0xFFF, initial=0xFFF)
        self.reset()

    def reset(self) -> None:
        self._prescaler.reset()
        self._reload.reset()
        self._started = False
        self._unlocked = False
        self._timeline.cancel(self._slot)

    def registers(self) -> Sequence[Register]:
        return (
            Register(0x00, "KR", None, self._write_key),
            Register(0x04, "PR", self._prescaler.read, lambda value: self._set(self._prescaler, value)),
            Register(0x08, "RLR", self._reload.read, lambda value: self._set(self._reload, value)),
            Register(0x0C, "SR", lambda: 0, None),
        )

    def _set(self, register: Stored, value: int) -> None:
        if not self._unlocked:
            raise Violation("iwdg_locked", "IWDG PR or RLR written while locked", "Write 0x5555 to KR first")
        register.write(value)

    def _write_key(self, key: int) -> None:
        self._unlocked = key == _UNLOCK
        if key == _START:
            self._started = True
        if self._started and key in (_START, _KICK):
            counts = (self._reload.value + 1) * (4 << min(self._prescaler.value, 6))
            self._timeline.schedule(self._slot, self._timeline.now + counts * TICK_HZ // _LSI_HZ)
