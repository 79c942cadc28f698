"""A device on the board's SPI bus, and the wires from it to the chip."""

import math
from collections.abc import Callable
from typing import Protocol

from firmware_host.emulator.bus import Violation
from firmware_host.emulator.gpio import Exti, Port
from firmware_host.emulator.spi import Spi1
from firmware_host.emulator.timeline import NEVER, TICK_HZ, Timeline


class SpiDevice(Protocol):
    """A part on the SPI bus, at register level. Times are virtual seconds and never go backwards.

    `name`: the part, for messages. `chip_select`, `interrupt`: chip pins, such as "PA11". `spi_modes`, `spi_max_hz`:
    what its bus interface accepts. `next_event_s`: when it next does something by itself, infinity for never.
    """

    @property
    def name(self) -> str: ...
    @property
    def chip_select(self) -> str: ...
    @property
    def interrupt(self) -> str: ...
    @property
    def spi_modes(self) -> tuple[int, ...]: ...
    @property
    def spi_max_hz(self) -> float: ...
    @property
    def next_event_s(self) -> float: ...
    @property
    def interrupt_level(self) -> bool: ...

    def advance(self, time_s: float) -> None:
        """Do everything due up to and including `time_s`."""

    def select(self) -> None:
        """Chip select falls."""

    def transfer(self, byte: int, time_s: float) -> int:
        """Exchange one byte. Raises Violation for what the part does not allow or the model does not know."""

    def deselect(self) -> None:
        """Chip select rises."""


class BoardClock:
    """Virtual seconds ↔ board ticks: the board starts at `boot_time_s`, its crystal is `crystal_ppm` fast."""

    def __init__(self, boot_time_s: float, crystal_ppm: float) -> None:
        self._boot_time_s = boot_time_s
        self._ticks_per_s = TICK_HZ * (1 + crystal_ppm * 1e-6)

    def last_tick(self, time_s: float) -> int:
        """The last tick at or before `time_s`."""
        return math.floor((time_s - self._boot_time_s) * self._ticks_per_s)

    def first_tick(self, time_s: float) -> int:
        """The first tick at or after `time_s`."""
        return math.ceil((time_s - self._boot_time_s) * self._ticks_per_s)

    def seconds(self, tick: int) -> float:
        return self._boot_time_s + tick / self._ticks_per_s


class DeviceLink:
    """Connects a device to its chip select, its interrupt pin, the bus and the board's time."""

    def __init__(
        self, device: SpiDevice, timeline: Timeline, clock: BoardClock, port_of: Callable[[str], Port], exti: Exti
    ) -> None:
        self._device = device
        self._timeline = timeline
        self._clock = clock
        self._slot = timeline.register(self._event)
        self._interrupt_port = port_of(device.interrupt)
        self._interrupt_letter, self._interrupt_pin = device.interrupt[1], int(device.interrupt[2:])
        self._exti = exti
        self._level = False
        self.selected = False
        port_of(device.chip_select).watch(int(device.chip_select[2:]), self._chip_select)
        self._settle()

    def check_bus(self, spi: Spi1) -> None:
        """Raise Violation when the bus is not set up as the device needs it."""
        device = self._device
        if spi.mode not in device.spi_modes or spi.clock_hz > device.spi_max_hz:
            raise Violation(
                "spi_setup",
                f"SPI1 speaks mode {spi.mode} at {spi.clock_hz / 1e6:g} MHz to the {device.name}",
                f"it takes mode {' or '.join(map(str, device.spi_modes))} up to {device.spi_max_hz / 1e6:g} MHz",
            )

    def exchange(self, byte: int) -> int:
        answer = self._device.transfer(byte, self._now_s())
        self._settle()
        return answer

    def _chip_select(self, high: bool) -> None:
        self.selected = not high
        if high:
            self._device.deselect()
        else:
            self._device.select()
        self._settle()

    def _event(self) -> None:
        self._device.advance(self._device.next_event_s)
        self._settle()

    def _now_s(self) -> float:
        # The core may be a few instructions past the limit; the world knows its motion up to the limit only
        return self._clock.seconds(min(self._timeline.now, self._timeline.limit))

    def _settle(self) -> None:
        """Take over what the device may have changed: its interrupt line and its next event."""
        level = self._device.interrupt_level
        if level != self._level:
            self._level = level
            self._interrupt_port.drive(self._interrupt_pin, level)
            self._exti.edge(self._interrupt_letter, self._interrupt_pin, level)
        due = self._device.next_event_s
        self._timeline.schedule(self._slot, NEVER if math.isinf(due) else self._clock.first_tick(due))
