"""The STM32L432's peripherals and the rig's wiring, assembled."""

from collections.abc import Callable, Sequence

from firmware_host.emulator.chip import rcc
from firmware_host.emulator.chip.bus import Peripheral, RegisterBus
from firmware_host.emulator.chip.clocks import Clocks
from firmware_host.emulator.chip.dma import Dma1
from firmware_host.emulator.chip.flash import Flash
from firmware_host.emulator.chip.flash_memory import FLASH_BYTES, STORE_OFFSET, FlashMemory
from firmware_host.emulator.chip.gpio import Exti, Port, Syscfg
from firmware_host.emulator.chip.nvic import Nvic
from firmware_host.emulator.chip.spi import Spi1
from firmware_host.emulator.chip.spi_device import BoardClock, DeviceLink, SpiBus, SpiDevice
from firmware_host.emulator.chip.system_control import SystemControl, SysTick
from firmware_host.emulator.chip.timers import Tim2, Tim16, Watchdog
from firmware_host.emulator.chip.usart import TDR_ADDRESS, Usart2
from firmware_host.emulator.engine import Engine, QuickAccess
from firmware_host.emulator.timeline import Timeline

_PERIPHERALS, _PERIPHERALS_SIZE = 0x4000_0000, 0x2_3000
_PORTS, _PORTS_SIZE = 0x4800_0000, 0x1000
_STORE, _STORE_SIZE = 0x0800_0000 + STORE_OFFSET, FLASH_BYTES - STORE_OFFSET
_CORE, _CORE_SIZE = 0xE000_E000, 0x1000
_SERIAL_FUNCTIONS = {"PA2": 7, "PA15": 3}
_HEATER_FUNCTIONS = {"PA6": 14}
_SENSOR_BUS_FUNCTIONS = {"PB3": 5, "PB4": 5, "PB5": 5}


class Chip:
    """Everything around the core. `on_reset(cause)` is called to reset the chip, `on_clock` after a change of clock.

    `cause` is one of the RESET_… flags of `rcc`.
    """

    def __init__(
        self,
        engine: Engine,
        timeline: Timeline,
        *,
        memory: FlashMemory,
        board_clock: BoardClock,
        devices: Sequence[SpiDevice],
        on_reset: Callable[[int], None],
        on_clock: Callable[[], None],
        has_crystal: bool = True,
    ) -> None:
        """Build the peripherals, connect them as the chip and the board do, and map their addresses."""
        self._on_clock = on_clock
        self.clocks = clocks = Clocks()
        self.nvic = nvic = Nvic(timeline)
        self._ports = {letter: Port(letter) for letter in "AB"}
        syscfg = Syscfg()
        exti = Exti(nvic, syscfg)
        dma = Dma1(engine, nvic, TDR_ADDRESS)
        self.usart = Usart2(
            timeline=timeline, clocks=clocks, nvic=nvic, dma=dma, pins_connected=self._make_pin_check(_SERIAL_FUNCTIONS)
        )
        self._spi = Spi1(timeline, clocks)
        sensor_bus = SpiBus(timeline, self._spi, self._make_pin_check(_SENSOR_BUS_FUNCTIONS))
        self._timer = Tim2(timeline, clocks)
        self._pwm = Tim16()
        self._heater_connected = self._make_pin_check(_HEATER_FUNCTIONS)
        self.control = SystemControl(nvic, lambda: on_reset(rcc.RESET_SOFTWARE))
        self.flash = flash = Flash(timeline, memory, nvic)
        power = rcc.Power()
        self.rcc = rcc.Rcc(
            timeline=timeline,
            clocks=clocks,
            flash=flash,
            power=power,
            on_gate=self._gate,
            on_clock=self._clock_changed,
            has_crystal=has_crystal,
        )
        watchdog = Watchdog(timeline, lambda: on_reset(rcc.RESET_WATCHDOG))
        peripherals, ports, core = RegisterBus(_PERIPHERALS), RegisterBus(_PORTS), RegisterBus(_CORE)
        quick = QuickAccess(timeline, self._timer.counter, self._spi.bus, sensor_bus.exchange)
        engine.map_io(_PERIPHERALS, _PERIPHERALS_SIZE, peripherals.read, peripherals.write, quick)
        engine.map_io(_PORTS, _PORTS_SIZE, ports.read, ports.write)
        engine.map_io(_STORE, _STORE_SIZE, flash.read, flash.write)
        engine.map_io(_CORE, _CORE_SIZE, core.read, core.write)
        self._gated: dict[str, tuple[RegisterBus, Peripheral]] = {}
        self._blocks: list[Peripheral] = []
        self._attach(core, SysTick(timeline, clocks, nvic), nvic, self.control)
        self._attach(peripherals, exti, watchdog)
        self._attach_gated(peripherals, dma, flash, self._timer, self._pwm, self.usart, power, syscfg, self._spi)
        self._attach_gated(ports, *self._ports.values())
        self._attach(peripherals, self.rcc)  # last: its reset switches the gates of the others
        for device in devices:
            DeviceLink(device, sensor_bus, timeline=timeline, clock=board_clock, port_of=self._port_of, exti=exti)

    @property
    def peripherals(self) -> Sequence[Peripheral]:
        """All blocks of registers that have a model."""
        return tuple(self._blocks)

    @property
    def heater_duty(self) -> float:
        """The heater's duty, 0 to 1; a pin that is not driven counts as low."""
        return self._pwm.duty if self._heater_connected() else 0.0

    def reset(self) -> None:
        for block in self._blocks:
            block.reset()

    def _attach(self, bus: RegisterBus, *blocks: Peripheral) -> None:
        for block in blocks:
            bus.attach(block)
            self._blocks.append(block)

    def _attach_gated(self, bus: RegisterBus, *blocks: Peripheral) -> None:
        """Attach blocks that need a clock of RCC."""
        for block in blocks:
            bus.attach(block, clocked=False)
            self._blocks.append(block)
            self._gated[block.name] = bus, block

    def _gate(self, peripheral: str, on: bool) -> None:
        bus, block = self._gated[peripheral]
        bus.clock(block, on)
        if block is self._timer:
            self._timer.counter.clocked = on
        elif block is self._spi:
            self._spi.bus.clocked = on

    def _clock_changed(self) -> None:
        self._spi.retune()
        self._timer.retune()
        self._on_clock()

    def _port_of(self, pin: str) -> Port:
        return self._ports[pin[1]]

    def _make_pin_check(self, functions: dict[str, int]) -> Callable[[], bool]:
        """Return a function that returns whether the firmware has selected these functions on these pins."""
        wires = [(self._port_of(pin), int(pin[2:]), function) for pin, function in functions.items()]
        ports = {port for port, _pin, _function in wires}
        checked_count, answer = -1, False

        def is_connected() -> bool:
            nonlocal checked_count, answer
            count = sum([port.setup_count for port in ports])
            if count != checked_count:  # called at every chip select
                checked_count, answer = count, all(port.function(pin) == function for port, pin, function in wires)
            return answer

        return is_connected
