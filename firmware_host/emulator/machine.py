"""The emulated board: the firmware image on a Cortex-M4F, its peripherals and its sensors, under one virtual clock."""

import struct
from collections.abc import Sequence

from unicorn.arm_const import UC_ARM_REG_R0

from firmware_host.emulator import rcc
from firmware_host.emulator.bus import Peripheral, RegisterBus, Violation
from firmware_host.emulator.clocks import Clocks
from firmware_host.emulator.cortex import Cortex
from firmware_host.emulator.dma import Dma1
from firmware_host.emulator.engine import Engine, EngineFault, Registers
from firmware_host.emulator.gpio import Exti, Port, Syscfg
from firmware_host.emulator.nvic import Nvic
from firmware_host.emulator.spi import Spi1
from firmware_host.emulator.spi_device import BoardClock, DeviceLink, SpiBus, SpiDevice
from firmware_host.emulator.symbols import Symbols
from firmware_host.emulator.system_control import SystemControl, SysTick
from firmware_host.emulator.thumb import instructions, is_floating_point, word_accesses
from firmware_host.emulator.timeline import Timeline
from firmware_host.emulator.timers import Tim2, Watchdog
from firmware_host.emulator.usart import TDR_ADDRESS, Usart2
from firmware_host.errors import BoardError

_FLASH, _FLASH_SIZE = 0x0800_0000, 256 * 1024
_RAM, _RAM_SIZE = 0x2000_0000, 64 * 1024  # SRAM1, then SRAM2 at its second address
_SYSTEM_MEMORY, _UNIQUE_ID, _FLASH_KB = 0x1FFF_7000, 0x1FFF_7590, 0x1FFF_75E0
_PERIPHERALS, _PORTS, _CORE = 0x4000_0000, 0x4800_0000, 0xE000_E000
_WFI, _BRANCH_TO_SELF = 0xBF30, 0xE7FE
_EXCEPTION_RETURN = 8
_CORE_EXCEPTIONS = {1: "undefined instruction", 2: "supervisor call", 3: "instruction fetch fault", 4: "data fault"}
_CORE_EXCEPTIONS |= {7: "breakpoint", 17: "floating point without access", 18: "invalid execution state"}
_CORRECT = "Correct the firmware"


class EmulatedBoard:
    """An STM32L432KC with the rig's wiring, running `image`.

    `image`: the flash contents; `elf`: the same program with symbols; `devices`: what hangs on SPI1; `unique_id`:
    12 bytes; `crystal_ppm`: how fast the board's clock runs; `boot_time_s`: virtual time of power-up. Instructions
    are counted exactly and take one core cycle each; there are no wait states.
    The same inputs at the same virtual times give the same bytes.
    """

    def __init__(
        self,
        *,
        image: bytes,
        elf: bytes,
        devices: Sequence[SpiDevice],
        unique_id: bytes,
        crystal_ppm: float,
        boot_time_s: float,
    ) -> None:
        self._symbols = Symbols(elf)
        self._clock = BoardClock(boot_time_s, crystal_ppm)
        self._timeline = Timeline()
        self._clocks = Clocks()
        self._engine = Engine()
        self._load_memories(image, unique_id)
        self._connect(devices)
        self._costs: dict[int, int] = {}
        self._engine.meter(self._timeline, self._costs, self._measure)
        self._engine.on_interrupt(self._core_exception)
        self._engine.on_invalid(self._invalid_access)
        self._watch_alignment()
        self._sent = bytearray()
        self._failure: BoardError | None = None
        self._return_code: int | None = None
        self._reset_cause: int | None = None
        self._asleep = False
        self._start()

    # --- what the world sees

    def advance(self, until_s: float) -> None:
        """Run to virtual time `until_s`. Raises BoardError, now and ever after, when the firmware breaks a rule."""
        limit = self._clock.last_tick(until_s)
        timeline = self._timeline
        if self._asleep and timeline.next_due > limit:
            timeline.now = timeline.limit = max(limit, timeline.now)
            return
        if self._failure is not None:
            raise self._failure
        timeline.limit = limit
        try:
            self._run(limit)
        except Violation as violation:
            self._failure = self._located(violation)
            raise self._failure from violation

    def receive(self, data: bytes) -> None:
        """Bytes from the host start arriving now, one after the other at the port's pace."""
        self._usart.receive(data)

    def transmitted(self) -> bytes:
        """The bytes whose stop bit has passed since the last call."""
        if not self._sent:
            return self._usart.transmitted()
        data = bytes(self._sent) + self._usart.transmitted()
        self._sent.clear()
        return data

    @property
    def baud_rate(self) -> float | None:
        """Bits per second of the serial port as the firmware has set it, None while it is off."""
        return self._usart.baud_rate

    @property
    def peripherals(self) -> Sequence[Peripheral]:
        """Every block of registers that has a model."""
        return tuple(self._blocks)

    def reset(self) -> None:
        """Press the reset button. Flash and RAM keep their contents, the sensors stay powered."""
        self._reset_cause = rcc.RESET_PIN
        self._restart()

    # --- assembly

    def _load_memories(self, image: bytes, unique_id: bytes) -> None:
        if len(image) > _FLASH_SIZE:
            raise BoardError("image_too_big", f"the image has {len(image)} bytes", f"flash holds {_FLASH_SIZE}")
        engine = self._engine
        engine.map_rom(_FLASH, _FLASH_SIZE)
        engine.write(_FLASH, image.ljust(_FLASH_SIZE, b"\xff"))
        engine.map_ram(_RAM, _RAM_SIZE)
        engine.write(_RAM, b"\xa5" * _RAM_SIZE)  # memory after power-up is not zero
        engine.map_rom(_SYSTEM_MEMORY, 0x1000)
        engine.write(_UNIQUE_ID, unique_id)
        engine.write(_FLASH_KB, struct.pack("<H", _FLASH_SIZE // 1024))

    def _connect(self, devices: Sequence[SpiDevice]) -> None:
        timeline, clocks, engine = self._timeline, self._clocks, self._engine
        self._nvic = nvic = Nvic(timeline)
        self._cortex = Cortex(engine, nvic)
        self._ports = {letter: Port(letter) for letter in "AB"}
        syscfg = Syscfg()
        exti = Exti(nvic, syscfg)
        dma = Dma1(engine, nvic, TDR_ADDRESS)
        self._usart = Usart2(
            timeline=timeline, clocks=clocks, nvic=nvic, dma=dma, pins_connected=self._serial_pins_connected
        )
        spi_bus = SpiBus(timeline, self._bus_pins_connected)
        self._spi = Spi1(timeline, clocks, spi_bus.exchange)
        self._control = SystemControl(nvic, lambda: self._request_reset(rcc.RESET_SOFTWARE))
        flash, power = rcc.Flash(), rcc.Power()
        self._rcc = rcc.Rcc(
            timeline=timeline,
            clocks=clocks,
            flash=flash,
            power=power,
            on_gate=self._gate,
            on_clock=self._clock_changed,
        )
        watchdog = Watchdog(timeline, lambda: self._request_reset(rcc.RESET_WATCHDOG))
        gated: list[Peripheral] = [dma, flash, Tim2(timeline, clocks), self._usart]
        gated += [power, syscfg, self._spi]
        self._gated: dict[str, tuple[RegisterBus, Peripheral]] = {}
        peripherals, ports, core = RegisterBus(_PERIPHERALS), RegisterBus(_PORTS), RegisterBus(_CORE)
        for bus, blocks in ((peripherals, gated), (ports, list(self._ports.values()))):
            for block in blocks:
                bus.attach(block, clocked=False)
                self._gated[block.name] = bus, block
        always: list[Peripheral] = [exti, watchdog]
        for block in [*always, self._rcc]:
            peripherals.attach(block)
        core_blocks: list[Peripheral] = [SysTick(timeline, clocks, nvic), nvic, self._control]
        for block in core_blocks:
            core.attach(block)
        self._blocks = [*core_blocks, *always, *gated, *self._ports.values(), self._rcc]
        engine.map_io(_PERIPHERALS, 0x2_3000, peripherals.read, peripherals.write)
        engine.map_io(_PORTS, 0x2000, ports.read, ports.write)
        engine.map_io(_CORE, 0x1000, core.read, core.write)
        for device in devices:
            DeviceLink(device, spi_bus, timeline=timeline, clock=self._clock, port_of=self._port_of, exti=exti)

    def _port_of(self, pin: str) -> Port:
        return self._ports[pin[1]]

    def _gate(self, peripheral: str, on: bool) -> None:
        bus, block = self._gated[peripheral]
        bus.clock(block, on)

    def _clock_changed(self) -> None:
        self._costs.clear()
        self._spi.retune()

    def _serial_pins_connected(self) -> bool:
        port = self._ports["A"]
        return port.function(2) == 7 and port.function(15) == 3

    def _bus_pins_connected(self) -> bool:
        return all(self._ports["B"].function(pin) == 5 for pin in (3, 4, 5))

    # --- running

    def _run(self, limit: int) -> None:
        timeline, cortex = self._timeline, self._cortex
        while True:
            timeline.run_due()
            if self._reset_cause is not None:
                self._restart()
            masked = cortex.enter_pending(self._control.vectors)
            if masked or self._nvic.running:
                self._asleep = False  # a masked interrupt wakes the core too
            if self._asleep:
                if timeline.next_due > limit:
                    timeline.now = max(timeline.now, limit)
                    return
                timeline.now = max(timeline.now, timeline.next_due)
            elif timeline.now >= limit:
                return
            else:
                # Nothing tells when the firmware unmasks a waiting exception: look after every block
                timeline.deadline = timeline.now + 1 if masked else min(timeline.next_due, limit)
                self._execute()

    def _execute(self) -> None:
        """Run the core until the deadline, an exception return, WFI or a fault."""
        engine, cortex = self._engine, self._cortex
        engine.paused = False
        try:
            engine.run(cortex.pc)
        except EngineFault as error:
            raise Violation("firmware_fault", str(error), _CORRECT) from error
        cortex.paused()
        if self._return_code is not None:
            code, self._return_code = self._return_code, None
            cortex.return_from_exception(code)
        elif not engine.paused:
            if struct.unpack("<H", engine.read(cortex.pc - 2, 2))[0] != _WFI:
                raise Violation("firmware_fault", "the core stopped for no known reason", _CORRECT)
            self._asleep = True

    def _measure(self, address: int, size: int) -> int:
        """Ticks that a block takes that has not been met before; refuses floating point before it is enabled."""
        code = instructions(self._engine.read(address, size))
        if not self._control.float_enabled and any(is_floating_point(instruction) for instruction in code):
            raise Violation("firmware_fault", "floating point before CPACR enables it", _CORRECT)
        ticks = len(code) * self._clocks.ticks_per_core_cycle
        if code == [_BRANCH_TO_SELF]:
            return max(ticks, self._timeline.deadline - self._timeline.now)  # it turns until something happens
        self._costs[address] = ticks
        return ticks

    def _watch_alignment(self) -> None:
        self._bases: dict[int, Registers] = {}
        for start, end in self._symbols.code():
            for address, base in word_accesses(self._engine.read(start, end - start), start):
                self._bases[address] = self._engine.registers([UC_ARM_REG_R0 + base])
                self._engine.on_instruction(address, self._check_alignment)

    def _check_alignment(self, address: int) -> None:
        (base,) = self._bases[address].read()
        if base & 3:
            raise Violation("firmware_fault", f"unaligned access by address 0x{base:08X}", _CORRECT)

    def _core_exception(self, number: int) -> None:
        if number != _EXCEPTION_RETURN:
            raise Violation("firmware_fault", _CORE_EXCEPTIONS.get(number, f"core exception {number}"), _CORRECT)
        self._cortex.paused()
        self._return_code = self._cortex.pc | 1
        self._engine.stop()

    def _invalid_access(self, attempt: str, address: int) -> None:
        raise Violation("firmware_fault", f"{attempt} address 0x{address:08X}", _CORRECT)

    def _located(self, violation: Violation) -> BoardError:
        address, link = self._engine.fault_place()
        where = self._symbols.where(address)
        if not self._symbols.function(address):
            where += f", called at {self._symbols.where(link)}"
        return BoardError(violation.name, f"{violation.what}, at {where}", violation.remedy)

    # --- reset

    def _request_reset(self, cause: int) -> None:
        self._reset_cause = cause
        self._timeline.interrupt()

    def _restart(self) -> None:
        assert self._reset_cause is not None
        self._rcc.note_reset(self._reset_cause)
        self._reset_cause = None
        self._sent += self._usart.transmitted()
        self._start()

    def _start(self) -> None:
        self._costs.clear()
        self._asleep = False
        for block in self._blocks:
            block.reset()
        self._cortex.reset(_FLASH)
