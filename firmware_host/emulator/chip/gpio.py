"""GPIO levels and functions, SYSCFG's selection of external interrupts, and EXTI (RM0394, chapters 8, 9 and 13)."""

from collections.abc import Callable, Sequence

from firmware_host.emulator.chip.bus import Register, StoredRegister
from firmware_host.emulator.chip.nvic import Nvic

_INPUT, _OUTPUT, _ALTERNATE = 0, 1, 2
_PORTS = {"A": 0, "B": 1}
# Mode, output, speed, pull-up and alternate function after reset: PA13–15, PB3–4 are debug pins
_MODE_AFTER_RESET = {"A": 0xABFF_FFFF, "B": 0xFFFF_FEBF}
_SPEED_AFTER_RESET = {"A": 0x0C00_0000, "B": 0}
_PULLS_AFTER_RESET = {"A": 0x6400_0000, "B": 0x0000_0100}
# Interrupt → mask of the EXTI lines that request it
_EXTI_LINES = {**{6 + line: 1 << line for line in range(5)}, 23: 0x03E0, 40: 0xFC00}


class Port:
    """One GPIO port: levels that the firmware drives, functions that it selects."""

    def __init__(self, letter: str) -> None:
        self.name = f"GPIO{letter}"
        self.number = _PORTS[letter]  # as SYSCFG counts
        self.base = 0x4800_0000 + 0x400 * _PORTS[letter]
        prefix = self.name
        self.setup_count = 0  # number of changes of functions
        self._mode = StoredRegister(f"{prefix} MODER", 0xFFFF_FFFF, _MODE_AFTER_RESET[letter], self._functions_changed)
        self._speed = StoredRegister(f"{prefix} OSPEEDR", 0xFFFF_FFFF, _SPEED_AFTER_RESET[letter])
        self._pulls = StoredRegister(f"{prefix} PUPDR", 0xFFFF_FFFF, _PULLS_AFTER_RESET[letter])
        self._output = 0
        self._output_pins = self._input_pins = 0
        self._alternate = [
            StoredRegister(f"{prefix} AFR{half}", 0xFFFF_FFFF, after=self._functions_changed) for half in "LH"
        ]
        self._levels = 0  # driven by devices
        self._watched: dict[int, Callable[[bool], None]] = {}  # by pin
        self._watched_low = 0  # mask of low ones
        self._watched_pins = 0

    def reset(self) -> None:
        for register in (self._mode, self._speed, self._pulls, *self._alternate):
            register.reset()
        self._output = 0
        self._functions_changed()

    def registers(self) -> Sequence[Register]:
        return (
            self._mode.map_to(0x00),
            self._speed.map_to(0x08),
            self._pulls.map_to(0x0C),
            Register(0x10, "IDR", self._read_levels, None),
            Register(0x18, "BSRR", None, self._set_and_reset),
            self._alternate[0].map_to(0x20),
            self._alternate[1].map_to(0x24),
        )

    def watch(self, pin: int, on_level: Callable[[bool], None]) -> None:
        """Call `on_level` whenever the firmware changes its output on `pin`. A pin that is no output counts as high."""
        self._watched[pin] = on_level
        self._watched_pins |= 1 << pin

    def function(self, pin: int) -> int | None:
        """Return the alternate function selected on `pin`; None if the pin is in another mode."""
        if self._mode.value >> 2 * pin & 3 != _ALTERNATE:
            return None
        return self._alternate[pin // 8].value >> 4 * (pin % 8) & 0xF

    def drive(self, pin: int, high: bool) -> None:
        """Set the level that a device drives on a pin."""
        self._levels = self._levels & ~(1 << pin) | high << pin

    def is_input(self, pin: int) -> bool:
        """Return whether a pin is a digital input. After a reset it is not: pins are then in analog mode."""
        return bool(self._input_pins >> pin & 1)

    def _read_levels(self) -> int:
        """Return the levels of the pins that devices drive; other pins have no model and read 0."""
        return self._levels & self._input_pins

    def _set_and_reset(self, value: int) -> None:
        self._output = self._output & ~(value >> 16) | value & 0xFFFF
        self._outputs_changed()

    def _functions_changed(self) -> None:
        self.setup_count += 1
        self._input_pins, self._output_pins = self._pins(_INPUT), self._pins(_OUTPUT)
        self._outputs_changed()

    def _pins(self, mode: int) -> int:
        """Return the mask of the pins in this mode."""
        return sum(1 << pin for pin in range(16) if self._mode.value >> 2 * pin & 3 == mode)

    def _outputs_changed(self) -> None:
        low = ~self._output & self._output_pins & self._watched_pins
        changed, self._watched_low = low ^ self._watched_low, low
        while changed:
            pin = changed.bit_length() - 1
            changed ^= 1 << pin
            self._watched[pin](not low >> pin & 1)


class Syscfg:
    """The selection of the port for each external interrupt line."""

    name = "SYSCFG"
    base = 0x4001_0000

    def __init__(self) -> None:
        self._ports = [StoredRegister(f"SYSCFG EXTICR{n}", 0x7777) for n in range(1, 5)]

    def reset(self) -> None:
        for register in self._ports:
            register.reset()

    def registers(self) -> Sequence[Register]:
        return tuple(register.map_to(0x08 + 4 * n) for n, register in enumerate(self._ports))

    def port(self, line: int) -> int:
        return self._ports[line // 4].value >> 4 * (line % 4) & 7


class Exti:
    """External interrupts 0–15: a rising edge on a pin pends a line, and an unmasked line requests its interrupt."""

    name = "EXTI"
    base = 0x4001_0400

    def __init__(self, nvic: Nvic, syscfg: Syscfg) -> None:
        self._nvic = nvic
        self._syscfg = syscfg
        self._mask = StoredRegister("EXTI IMR1", 0xFFFF, initial=0xFF82_0000, after=self._request)
        self._rising = StoredRegister("EXTI RTSR1", 0xFFFF)
        self._pending = 0
        self._active = 0  # pending and not masked, at the last check

    def reset(self) -> None:
        self._pending = 0
        self._rising.reset()
        self._mask.reset()
        self._request()

    def registers(self) -> Sequence[Register]:
        return (
            self._mask.map_to(0x00),
            self._rising.map_to(0x08),
            Register(0x14, "PR1", lambda: self._pending, self._clear),
        )

    def rising_edge(self, port: Port, pin: int) -> None:
        """Pend the line of a pin whose level rose."""
        if port.number == self._syscfg.port(pin) and self._rising.value >> pin & 1:
            self._pending |= 1 << pin
            self._request()

    def _clear(self, value: int) -> None:
        self._pending &= ~value
        self._request()

    def _request(self) -> None:
        active = self._pending & self._mask.value
        changed, self._active = active ^ self._active, active
        if changed:
            for irq, lines in _EXTI_LINES.items():
                if changed & lines:
                    self._nvic.set_line(irq, bool(active & lines))
