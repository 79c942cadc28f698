"""A device on the board's SPI bus, and its wires to the chip."""

import math
from collections.abc import Callable
from enum import StrEnum
from typing import Protocol

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.chip.gpio import Exti, Port
from firmware_host.emulator.chip.spi import Spi1
from firmware_host.emulator.timeline import NEVER, TICK_HZ, Timeline


class Fault(StrEnum):
    """The fault of a part on the bus."""

    ABSENT = "absent"  # missing or without supply: only pulls drive MISO and the interrupt line
    OTHER_PART = "other_part"  # its identity register reads as another part's
    DAMAGED = "damaged"  # a bad contact: some bits of its data are wrong
    SILENT = "silent"  # its interrupt line is broken: it answers, but never signals new data


class SpiDevice(Protocol):
    """A part on the SPI bus, at register level. Times are virtual seconds and never decrease.

    - `name`: the part, for messages.
    - `chip_select`, `interrupt`: chip pins, such as "PA11".
    - `spi_modes`, `spi_max_hz`: limits of its bus interface; the clock limit depends on the access and is read after
      the first byte of each access.
    - `next_event_s`: the time of its next own action, infinity for never.
    - `fault`: its fault. `OTHER_PART` is simulated by the part itself, all other faults by the wires.
    """

    fault: Fault | None

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
        """Carry out all actions due up to and including `time_s`."""

    def select(self, time_s: float) -> None:
        """Handle the fall of chip select, which changes neither the interrupt line nor `next_event_s`."""

    def transfer(self, byte: int, time_s: float) -> int:
        """Exchange one byte. Raise Violation for accesses that the part forbids or the model lacks."""

    def predict(self) -> bytes:
        """Return the next answers of this access, in pairs of bytes, if they do not depend on the bytes received.

        Called after the first pair of an access; the device must treat predicted bytes as exchanged.
        """

    def deselect(self, time_s: float) -> None:
        """Handle the rise of chip select, which changes neither the interrupt line nor `next_event_s`."""


# The MSI locked to the 32768 Hz crystal runs at 122 times its frequency, not at the nominal 4 MHz
LOCKED_MSI = 122 * 32_768 / 4_000_000


class BoardClock:
    """The conversion between virtual seconds and board ticks, which begin at `boot_time_s`.

    The board's crystal is `crystal_ppm` fast. Here the clock is locked to the crystal from the start; on the chip it
    has an error of its own for the first seconds.
    """

    def __init__(self, boot_time_s: float, crystal_ppm: float) -> None:
        self._boot_time_s = boot_time_s
        self._ticks_per_s = TICK_HZ * LOCKED_MSI * (1 + crystal_ppm * 1e-6)

    def last_tick(self, time_s: float) -> int:
        """Return the last tick at or before `time_s`."""
        return math.floor((time_s - self._boot_time_s) * self._ticks_per_s)

    def first_tick(self, time_s: float) -> int:
        """Return the first tick at or after `time_s`."""
        return math.ceil((time_s - self._boot_time_s) * self._ticks_per_s)

    def seconds(self, tick: int) -> float:
        return self._boot_time_s + tick / self._ticks_per_s


_UNCHECKED = -1


class SpiBus:
    """The wires between SPI1 and the devices. `pins_connected()`: whether the firmware has put SPI1 on its pins."""

    def __init__(self, timeline: Timeline, spi: Spi1, pins_connected: Callable[[], bool]) -> None:
        self._timeline = timeline
        self._spi = spi
        self._pins_connected = pins_connected
        self._selected: list[DeviceLink] = []
        self._checked = _UNCHECKED

    def chip_select(self, link: "DeviceLink", low: bool) -> None:
        """Handle the fall or rise of a device's chip select. Raise Violation if the bus is busy."""
        if self._spi.busy:
            raise Violation(
                "spi_busy", f"the select of the {link.device.name} changes on a busy bus", "Wait until BSY is clear"
            )
        if low:
            self._selected.append(link)
        else:
            self._selected.remove(link)
        self._checked = _UNCHECKED
        self._spi.bus.predicted_to = 0

    def exchange(self, pair: int) -> int:
        """Exchange two bytes with the selected device, the first one in the low byte of `pair` and of the answer.

        Raise Violation if the bus is not set up as required.
        """
        spi, timeline, bus = self._spi, self._timeline, self._spi.bus
        if timeline.next_due <= timeline.now:
            timeline.run_due()
        setups, checked = bus.setups, self._checked
        if checked != setups:
            self._check_wires()
        if bus.predicted_from < bus.predicted_to:
            answer = bus.next_prediction()
        else:
            answer = self._selected[0].exchange(pair) if self._selected else 0xFFFF
        if checked != setups:
            self._check_clock(spi)  # after the first pair: the clock limit of a part depends on the access
            self._checked = bus.predicted_in = setups
            if checked == _UNCHECKED and self._selected and (predicted := self._selected[0].predict()):
                bus.set_predictions(predicted)
        return answer

    def _check_wires(self) -> None:
        if not self._pins_connected():
            raise Violation("spi_setup", "SPI1 is used with PB3, PB4, PB5 not all on AF5", "Set MODER and AFRL first")
        if len(self._selected) > 1:
            raise Violation("bus_contention", "two chip selects are low at once", "Raise one before lowering the other")

    def _check_clock(self, spi: Spi1) -> None:
        for link in self._selected:
            device = link.device
            if spi.mode not in device.spi_modes or spi.clock_hz > device.spi_max_hz:
                raise Violation(
                    "spi_setup",
                    f"SPI1 speaks mode {spi.mode} at {spi.clock_hz / 1e6:g} MHz to the {device.name}",
                    f"This access takes mode {' or '.join(map(str, device.spi_modes))} "
                    f"up to {device.spi_max_hz / 1e6:g} MHz",
                )


# With a bad contact, one byte in 21 has a wrong bit: nearly every burst of the ADIS16465 has just one,
# which its checksum always reveals
_DAMAGED_BYTE = 21


class DeviceLink:
    """The connection of a device to its chip select, its interrupt pin, the bus and the board's time."""

    def __init__(
        self,
        device: SpiDevice,
        bus: SpiBus,
        *,
        timeline: Timeline,
        clock: BoardClock,
        port_of: Callable[[str], Port],
        exti: Exti,
    ) -> None:
        self.device = device
        self._bus = bus
        self._timeline = timeline
        self._clock = clock
        self._slot = timeline.register(self._event)
        self._due_s = math.inf
        self._interrupt_port, self._interrupt_pin = port_of(device.interrupt), int(device.interrupt[2:])
        self._exti = exti
        self._level = False
        self._sent = 0  # bytes since the last damaged one
        port_of(device.chip_select).watch(int(device.chip_select[2:]), self._chip_select)
        self._settle()

    def exchange(self, pair: int) -> int:
        """Exchange two bytes with the device, the first one in the low byte of `pair` and of the answer."""
        return self._transfer(pair) if self.device.fault is None else self._exchange_faulty(pair)

    def _transfer(self, pair: int) -> int:
        device = self.device
        time_s = self._clock.seconds(self._timeline.now)
        answer = device.transfer(pair & 0xFF, time_s) | device.transfer(pair >> 8, time_s) << 8
        if device.interrupt_level != self._level or device.next_event_s != self._due_s:
            self._settle()
        return answer

    def predict(self) -> bytes:
        """Return the device's next answers, see `SpiDevice.predict`; none for a faulty device."""
        return self.device.predict() if self.device.fault is None else b""

    def _exchange_faulty(self, pair: int) -> int:
        if self.device.fault is Fault.ABSENT:
            return 0xFFFF
        answer = self._transfer(pair)
        if self.device.fault is Fault.DAMAGED:
            self._sent += 2
            if self._sent >= _DAMAGED_BYTE:
                self._sent -= _DAMAGED_BYTE
                answer ^= 0x0001 if self._sent else 0x0100
        return answer

    def _chip_select(self, high: bool) -> None:
        timeline, device = self._timeline, self.device
        now = timeline.now
        if timeline.next_due <= now:
            timeline.run_due()
        self._bus.chip_select(self, not high)
        time_s = self._clock.seconds(now)
        if high:
            device.deselect(time_s)
        else:
            device.select(time_s)
        if device.fault is not None:  # the fault may be new
            self._settle()

    def _event(self) -> None:
        self.device.advance(self._due_s)
        self._settle()

    def _settle(self) -> None:
        """Apply changes of the device's interrupt line and of its next event."""
        device = self.device
        level = device.interrupt_level and device.fault not in (Fault.ABSENT, Fault.SILENT)
        if level != self._level:
            self._level = level
            self._interrupt_port.drive(self._interrupt_pin, level)
            if level and self._interrupt_port.is_input(self._interrupt_pin):
                self._exti.rising_edge(self._interrupt_port, self._interrupt_pin)
        due_s = device.next_event_s
        if due_s != self._due_s:
            self._due_s = due_s
            self._timeline.schedule(self._slot, NEVER if math.isinf(due_s) else self._clock.first_tick(due_s))
