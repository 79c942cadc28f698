"""TIM2 as a free-running counter, TIM16 as the heater's PWM, the independent watchdog (RM0394, chapters 28, 29, 31)."""

from collections.abc import Callable, Sequence
from math import gcd

from firmware_host.emulator.chip.bus import Register, StoredRegister, Violation, check_bits
from firmware_host.emulator.chip.clocks import Clocks
from firmware_host.emulator.hooks import Counter, reader
from firmware_host.emulator.timeline import TICK_HZ, Timeline

_LSI_HZ = 32_000
_PWM_MODE_1 = 6
_START, _KICK, _UNLOCK = 0xCCCC, 0xAAAA, 0x5555


class Tim2:
    """A free-running 32-bit up-counter. The prescaler acts from the next update event on, as on the chip.

    The counter stops while the auto-reload register is 0, its value after a reset in the maker's register file. Machine
    code reads it: see `hooks.ll`.
    """

    name = "TIM2"
    base = 0x4000_0000

    def __init__(self, timeline: Timeline, clocks: Clocks) -> None:
        self._timeline = timeline
        self._clocks = clocks
        self.counter = Counter()
        self._control = StoredRegister("TIM2 CR1", 1, after=self._switch)
        self._prescaler = StoredRegister("TIM2 PSC", 0xFFFF)
        self._reload = StoredRegister("TIM2 ARR", 0xFFFF_FFFF, after=self._switch)
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
            self._control.map_to(0x00),
            Register(0x14, "EGR", None, self._generate),
            Register(0x24, "CNT", reader("read_count", self.counter, self._timeline), None),
            self._prescaler.map_to(0x28),
            self._reload.map_to(0x2C),
        )

    def retune(self) -> None:
        """Apply a new bus clock, prescaler or reload value."""
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


class Tim16:
    """A PWM on channel 1: mode 1, counting up. Changes act at once, not at the next update event.

    The registers hold written values; nothing counts, because only the heater uses this pin.
    """

    name = "TIM16"
    base = 0x4001_4400

    def __init__(self) -> None:
        self._control = StoredRegister("TIM16 CR1", 1)
        self._mode = StoredRegister("TIM16 CCMR1_Output", 7 << 4 | 1 << 3)
        self._enable = StoredRegister("TIM16 CCER", 1)
        self._prescaler = StoredRegister("TIM16 PSC", 0xFFFF)
        self._reload = StoredRegister("TIM16 ARR", 0xFFFF)
        self._compare = StoredRegister("TIM16 CCR1", 0xFFFF)
        self._output = StoredRegister("TIM16 BDTR", 1 << 15)

    def reset(self) -> None:
        for register in self._stored.values():
            register.reset()

    def registers(self) -> Sequence[Register]:
        generate = Register(0x14, "EGR", None, lambda value: check_bits("TIM16 EGR", value, 1))
        return (generate, *(register.map_to(offset) for offset, register in self._stored.items()))

    @property
    def _stored(self) -> dict[int, StoredRegister]:
        return {
            0x00: self._control,
            0x18: self._mode,
            0x20: self._enable,
            0x28: self._prescaler,
            0x2C: self._reload,
            0x34: self._compare,
            0x44: self._output,
        }

    @property
    def duty(self) -> float:
        """The fraction of the time at which the channel's output is high, 0 to 1."""
        runs = self._control.value & self._enable.value and self._output.value and self._reload.value
        if not runs or self._mode.value >> 4 & 7 != _PWM_MODE_1:
            return 0.0
        return min(1.0, self._compare.value / (self._reload.value + 1))


class Watchdog:
    """IWDG: calls `on_bite` if it is not kicked in time. Once started only a reset stops it."""

    name = "IWDG"
    base = 0x4000_3000

    def __init__(self, timeline: Timeline, on_bite: Callable[[], None]) -> None:
        self._timeline = timeline
        self._slot = timeline.register(on_bite)
        self._prescaler = StoredRegister("IWDG PR", 7)
        self._reload = StoredRegister("IWDG RLR", 0xFFF, initial=0xFFF)
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

    def _set(self, register: StoredRegister, value: int) -> None:
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
