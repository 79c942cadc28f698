"""The emulated board: the firmware image on a Cortex-M4F, its peripherals and its sensors, under one virtual clock."""

import struct
from collections.abc import Sequence

from firmware_host.emulator.alignment import AlignmentWatch
from firmware_host.emulator.chip import rcc
from firmware_host.emulator.chip.bus import Peripheral, Violation
from firmware_host.emulator.chip.chip import Chip
from firmware_host.emulator.chip.cortex import Cortex, Entry
from firmware_host.emulator.chip.flash_memory import FLASH_BYTES, STORE_OFFSET, FlashMemory, PowerLost
from firmware_host.emulator.chip.spi_device import BoardClock, SpiDevice
from firmware_host.emulator.engine import Engine, EngineFault
from firmware_host.emulator.hooks import BlockTicks
from firmware_host.emulator.symbols import Symbols
from firmware_host.emulator.thumb import instructions, is_floating_point
from firmware_host.emulator.timeline import Timeline
from firmware_host.errors import BoardError

_FLASH = 0x0800_0000
_RAM, _RAM_SIZE = 0x2000_0000, 64 * 1024  # SRAM1, then SRAM2 at its second address
_SYSTEM_MEMORY, _UNIQUE_ID, _FLASH_KB = 0x1FFF_7000, 0x1FFF_7590, 0x1FFF_75E0
_WFI, _BRANCH_TO_SELF = 0xBF30, 0xE7FE
_EXCEPTION_RETURN = 8
_EXCEPTION_CYCLES = 12 + 10  # entry and return (Cortex-M4 Technical Reference Manual, 3.9), charged at the entry
_CORE_EXCEPTIONS = {2: "supervisor call", 7: "breakpoint"}
_CORRECT = "Correct the firmware"


class EmulatedBoard:
    """An STM32L432KC with the rig's wiring, running the program in `flash`.

    - `flash`: its contents, which outlive the board.
    - `elf`: the same program with symbols.
    - `devices`: the devices on SPI1.
    - `unique_id`: 12 bytes.
    - `crystal_ppm`: the error of the board's crystal or, if it has none (`has_crystal`), of its clock.
    - `boot_time_s`: the virtual time of power-up.

    Instructions are counted exactly and take one core cycle each; every doubleword of a block is fetched with the wait
    states of the flash, as if there were neither cache nor prefetch, and an exception takes its cycles. The same inputs
    at the same virtual times give the same bytes.
    """

    def __init__(
        self,
        *,
        flash: FlashMemory,
        elf: bytes,
        devices: Sequence[SpiDevice],
        unique_id: bytes,
        crystal_ppm: float,
        boot_time_s: float,
        has_crystal: bool = True,
    ) -> None:
        """Load program and memories, connect the chip to the core, and apply power."""
        self._elf = elf
        self._clock = BoardClock(boot_time_s, crystal_ppm)
        self._timeline = Timeline()
        self._engine = Engine()
        self._load_memories(flash, unique_id)
        self._costs = BlockTicks(_FLASH, STORE_OFFSET)
        self._after_wfi: set[int] = set()  # addresses after a WFI
        self._chip = Chip(
            self._engine,
            self._timeline,
            memory=flash,
            board_clock=self._clock,
            devices=devices,
            on_reset=self._request_reset,
            on_clock=self._costs.clear,
            has_crystal=has_crystal,
        )
        self._cortex = Cortex(self._engine, self._chip.nvic)
        self._engine.meter(self._timeline, self._costs, self._measure)
        self._engine.hook_interrupt(self._core_exception)
        self._engine.hook_invalid(self._invalid_access)
        self._alignment = AlignmentWatch(self._engine)
        self.powered = True  # until the supply fails, by `FlashMemory.fail_power`
        self._sent = bytearray()
        self._failure: BoardError | None = None
        self._reset_cause: int | None = None
        self._asleep = False
        self._start()

    # --- the interface to the world

    def advance(self, until_s: float) -> None:
        """Run to virtual time `until_s`, at most a few instructions (under a microsecond) beyond.

        Raise BoardError, now and at every later call, if the firmware breaks a rule.
        """
        if self._failure is not None:
            raise self._failure
        if not self.powered:
            return
        limit = self._clock.last_tick(until_s)
        timeline = self._timeline
        if limit < 0:  # before the board boots its sensors already run
            timeline.now = limit
            timeline.run_due()
            timeline.now = 0
            return
        if self._asleep and timeline.next_due > limit:  # the common case, made short
            timeline.now = max(limit, timeline.now)
            return
        try:
            self._run(limit)
        except PowerLost:
            self.powered = False
        except Violation as violation:
            self._failure = self._add_location(violation)
            raise self._failure from violation
        except EngineFault as fault:
            self._failure = self._add_location(Violation("firmware_fault", str(fault), _CORRECT))
            raise self._failure from fault

    def receive(self, data: bytes) -> None:
        """Let bytes from the host arrive from now on, one after the other at the port's pace."""
        self._chip.usart.receive(data)

    def take_sent(self) -> bytes:
        """Return the bytes whose stop bit has passed since the last call."""
        if not self._sent:
            return self._chip.usart.take_sent()
        data = bytes(self._sent) + self._chip.usart.take_sent()
        self._sent.clear()
        return data

    @property
    def baud_rate(self) -> float | None:
        """The baud rate of the serial port as set by the firmware, None while it is off."""
        return self._chip.usart.baud_rate

    @property
    def heater_duty(self) -> float:
        """The heater's duty, 0 to 1."""
        return self._chip.heater_duty if self.powered else 0.0

    @property
    def peripherals(self) -> Sequence[Peripheral]:
        """All blocks of registers that have a model."""
        return self._chip.peripherals

    def reset(self) -> None:
        """Press the reset button. Flash and RAM hold their contents, the sensors stay powered."""
        self._reset_cause = rcc.RESET_PIN
        self._restart()

    # --- assembly

    def _load_memories(self, flash: FlashMemory, unique_id: bytes) -> None:
        engine = self._engine
        engine.map_rom(_FLASH, STORE_OFFSET)
        engine.write(_FLASH, bytes(flash.data[:STORE_OFFSET]))
        engine.map_ram(_RAM, _RAM_SIZE)
        engine.write(_RAM, b"\xa5" * _RAM_SIZE)  # memory after power-up is not zero
        engine.map_rom(_SYSTEM_MEMORY, 0x1000)
        engine.write(_UNIQUE_ID, unique_id)
        engine.write(_FLASH_KB, struct.pack("<H", FLASH_BYTES // 1024))

    # --- running

    def _run(self, limit: int) -> None:
        timeline, cortex = self._timeline, self._cortex
        while True:
            if timeline.next_due <= timeline.now:
                timeline.run_due()
            if self._reset_cause is not None:
                self._restart()
            waits_for_flash = self._chip.flash.busy
            entry = Entry.NONE if waits_for_flash else cortex.enter_pending(self._chip.control.vectors)
            if entry is Entry.ENTERED:
                cycles = _EXCEPTION_CYCLES + self._chip.flash.wait_states  # the vector comes from flash
                timeline.now += cycles * self._chip.clocks.ticks_per_core_cycle
            if entry is not Entry.NONE:
                self._asleep = False  # a masked interrupt wakes the core too
            if self._asleep or waits_for_flash:
                if timeline.next_due > limit:
                    timeline.now = max(timeline.now, limit)
                    return
                timeline.now = max(timeline.now, timeline.next_due)
            elif timeline.now >= limit:
                return
            else:
                # No event signals that the firmware unmasks a pending exception: check after every block
                timeline.run_until(limit, cortex.masks_pending if entry is Entry.MASKED else None)
                self._execute()

    def _execute(self) -> None:
        """Run the core until the deadline, WFI, a fault or a block that needs a check before it runs."""
        engine, cortex = self._engine, self._cortex
        engine.paused = False
        engine.run(cortex.pc)
        cortex.note_pause()
        self._alignment.update()
        if engine.paused:
            return
        if cortex.pc not in self._after_wfi:
            if struct.unpack("<H", engine.read(cortex.pc - 2, 2))[0] != _WFI:
                raise Violation("firmware_fault", "the core stopped for no known reason", _CORRECT)
            self._after_wfi.add(cortex.pc)
        self._asleep = True

    def _measure(self, address: int, size: int) -> int | None:
        """Return the ticks that a new block of code takes; None if the block must not run before the engine has paused.

        Raise Violation for floating point before it is enabled.
        """
        block = self._engine.read(address, size)
        if self._alignment.add_block(address, block):
            return None
        code = instructions(block)
        if not self._chip.control.float_enabled and any(is_floating_point(instruction) for instruction in code):
            raise Violation("firmware_fault", "floating point before CPACR enables it", _CORRECT)
        cycles = len(code) + self._chip.flash.wait_states * _doublewords(address, size)
        ticks = cycles * self._chip.clocks.ticks_per_core_cycle
        if code == [_BRANCH_TO_SELF]:
            return max(ticks, self._timeline.deadline - self._timeline.now)  # it loops until the next event
        self._costs[address] = ticks
        return ticks

    def _core_exception(self, number: int) -> None:
        if number != _EXCEPTION_RETURN:
            raise Violation("firmware_fault", _CORE_EXCEPTIONS.get(number, f"core exception {number}"), _CORRECT)
        self._cortex.return_from_exception()
        if self._chip.nvic.candidate() is not None:  # another one is pending, or the same again
            self._timeline.interrupt()

    def _invalid_access(self, attempt: str, address: int) -> None:
        raise Violation("firmware_fault", f"{attempt} address 0x{address:08X}", _CORRECT)

    def _add_location(self, violation: Violation) -> BoardError:
        address, link = self._engine.fault_registers()
        symbols = Symbols(self._elf)
        location = symbols.describe(address)
        if not symbols.function(address):
            location += f", called at {symbols.describe(link)}"
        return BoardError.from_problem(violation.problem._replace(what=f"{violation.what}, at {location}"))

    # --- reset

    def _request_reset(self, cause: int) -> None:
        self._reset_cause = cause
        self._timeline.interrupt()

    def _restart(self) -> None:
        assert self._reset_cause is not None
        self._chip.rcc.note_reset(self._reset_cause)
        self._reset_cause = None
        self._sent += self._chip.usart.take_sent()
        self._start()

    def _start(self) -> None:
        self._costs.clear()
        self._asleep = False
        self._chip.reset()
        self._cortex.reset(_FLASH)


def _doublewords(address: int, size: int) -> int:
    """Return the number of 64-bit lines of the flash that a block of code spans."""
    return (address + size - 1) // 8 - address // 8 + 1
