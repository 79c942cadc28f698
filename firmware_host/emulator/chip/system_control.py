"""The core's own registers: SysTick, system control block, floating-point enable (ARMv7-M, B3.2 and B3.3)."""

from collections.abc import Callable, Sequence
from functools import partial

from firmware_host.emulator.chip.bus import Register, StoredRegister, Violation
from firmware_host.emulator.chip.clocks import Clocks
from firmware_host.emulator.chip.nvic import PENDSV, SYSTICK, Nvic
from firmware_host.emulator.timeline import Timeline

_VECTOR_KEY = 0x05FA
_FLASH = 0x0800_0000
_FLOAT_ENABLED = 0xF << 20  # CPACR: full access to coprocessors 10 and 11


class SystemControl:
    """The system control block. `on_reset` is called when the firmware requests a system reset."""

    name = "SCB"
    base = 0xE000_ED00

    def __init__(self, nvic: Nvic, on_reset: Callable[[], None]) -> None:
        self._nvic = nvic
        self._on_reset = on_reset
        self._vtor = StoredRegister("SCB VTOR", 0xFFFF_FF80)
        self._coprocessors = StoredRegister("SCB CPACR", _FLOAT_ENABLED)
        self._priority_group = 0

    def reset(self) -> None:
        self._vtor.reset()
        self._coprocessors.reset()
        self._priority_group = 0

    @property
    def vectors(self) -> int:
        """The address of the vector table; address 0 maps to the flash."""
        return self._vtor.value or _FLASH

    @property
    def float_enabled(self) -> bool:
        return self._coprocessors.value == _FLOAT_ENABLED

    def registers(self) -> Sequence[Register]:
        return (
            Register(0x04, "ICSR", self._read_icsr, self._write_icsr),
            self._vtor.map_to(0x08),
            Register(0x0C, "AIRCR", lambda: 0xFA05_0000 | self._priority_group << 8, self._write_aircr),
            Register(0x20, "SHPR3", self._read_shpr3, self._write_shpr3),
            *(
                Register(
                    offset, "SHPR3", partial(self._nvic.priority, n), partial(self._nvic.set_system_priority, n), 1
                )
                for offset, n in ((0x22, PENDSV), (0x23, SYSTICK))
            ),
            self._coprocessors.map_to(0x88),
        )

    def _read_icsr(self) -> int:
        pending = self._nvic.is_pending(PENDSV) << 28 | self._nvic.is_pending(SYSTICK) << 26
        return pending | self._nvic.running

    def _write_icsr(self, value: int) -> None:
        for bit, number in ((28, PENDSV), (26, SYSTICK)):
            if value >> bit & 1:
                self._nvic.pend(number)
            if value >> bit - 1 & 1:
                self._nvic.unpend(number)

    def _write_aircr(self, value: int) -> None:
        if value >> 16 != _VECTOR_KEY:
            return
        group = value >> 8 & 7
        if group > 3:
            raise Violation(
                "unmodelled_bits",
                f"SCB AIRCR sets priority group {group}; only preemption by all four bits is modelled",
                "Use priority group 3 or lower",
            )
        self._priority_group = group
        if value >> 2 & 1:
            self._on_reset()

    def _read_shpr3(self) -> int:
        return self._nvic.priority(PENDSV) << 16 | self._nvic.priority(SYSTICK) << 24

    def _write_shpr3(self, value: int) -> None:
        self._nvic.set_system_priority(PENDSV, value >> 16 & 0xFF)
        self._nvic.set_system_priority(SYSTICK, value >> 24)


class SysTick:
    """The core's 24-bit timer, clocked by the core."""

    name = "SysTick"
    base = 0xE000_E010

    def __init__(self, timeline: Timeline, clocks: Clocks, nvic: Nvic) -> None:
        self._timeline = timeline
        self._clocks = clocks
        self._nvic = nvic
        self._slot = timeline.register(self._handle_wrap)
        self._control = StoredRegister("SysTick CTRL", 7, after=self._restart)
        self._reload = StoredRegister("SysTick LOAD", 0xFF_FFFF)
        self._origin = 0
        self._wraps_seen = 0

    def reset(self) -> None:
        self._control.reset()
        self._reload.reset()
        self._timeline.cancel(self._slot)

    def registers(self) -> Sequence[Register]:
        return (
            Register(0x0, "CTRL", self._read_control, self._control.write),
            self._reload.map_to(0x4),
            Register(0x8, "VAL", self._read_value, lambda _value: self._restart()),
        )

    @property
    def _tick_per_count(self) -> int:
        return self._clocks.ticks_per_core_cycle * (1 if self._control.value & 4 else 8)

    @property
    def _period(self) -> int:
        return (self._reload.value + 1) * self._tick_per_count

    def _restart(self) -> None:
        self._origin = self._timeline.now
        self._wraps_seen = 0
        if self._control.value & 3 == 3:
            self._timeline.schedule(self._slot, self._origin + self._period)
        else:
            self._timeline.cancel(self._slot)

    def _handle_wrap(self) -> None:
        self._nvic.pend(SYSTICK)
        wraps = (self._timeline.now - self._origin) // self._period
        self._timeline.schedule(self._slot, self._origin + (wraps + 1) * self._period)

    def _read_control(self) -> int:
        if not self._control.value & 1:
            return self._control.value
        wraps = (self._timeline.now - self._origin) // self._period
        wrapped = wraps > self._wraps_seen
        self._wraps_seen = wraps
        return self._control.value | wrapped << 16

    def _read_value(self) -> int:
        if not self._control.value & 1:
            return 0
        return self._reload.value - (self._timeline.now - self._origin) // self._tick_per_count % (
            self._reload.value + 1
        )
