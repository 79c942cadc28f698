"""RCC and PWR of the STM32L432 (reference manual RM0394, chapters 6 and 5): clocks and their consumers."""

from collections.abc import Callable, Sequence

from firmware_host.emulator.chip.bus import Register, StoredRegister, Violation, check_bits
from firmware_host.emulator.chip.clocks import Clocks
from firmware_host.emulator.chip.flash import Flash
from firmware_host.emulator.timeline import TICK_HZ, Timeline

_MSI_KHZ = (100, 200, 400, 800, 1_000, 2_000, 4_000, 8_000, 16_000, 24_000, 32_000, 48_000)
_HSI_HZ = 16_000_000
_MSION, _MSIRGSEL, _HSION, _PLLON = 1 << 0, 1 << 3, 1 << 8, 1 << 24
_MSIRANGE = 0xF << 4
_ENABLE_BITS = {  # register offset → bit → peripheral
    0x48: {0: "DMA1", 8: "FLASH"},
    0x4C: {0: "GPIOA", 1: "GPIOB"},
    0x58: {0: "TIM2", 17: "USART2", 28: "PWR"},
    0x60: {0: "SYSCFG", 12: "SPI1", 17: "TIM16"},
}
_ENABLE_NAMES = {0x48: "AHB1ENR", 0x4C: "AHB2ENR", 0x58: "APB1ENR1", 0x60: "APB2ENR"}
# RM0394 table 9: wait states needed at supply range 1, from 16 MHz to 16 MHz
_HZ_PER_WAIT_STATE = 16_000_000
_DBP = 1 << 8  # PWR CR1: the backup domain may be written
_LSEON, _LSERDY = 1 << 0, 1 << 1
_CRYSTAL_START_TICKS = TICK_HZ // 2  # a 32 kHz crystal needs some tenths of a second to start
RESET_POWER, RESET_PIN, RESET_SOFTWARE, RESET_WATCHDOG = 1 << 27, 1 << 26, 1 << 28, 1 << 29
_RESET_FLAGS = 0xFF << 24
_REMOVE_RESET_FLAGS = 1 << 23
_MSI_RANGE_AFTER_STANDBY = 6 << 8  # 4 MHz


class Power:
    """PWR: the voltage range. Range 1, the reset value, is the only one that allows 80 MHz."""

    name = "PWR"
    base = 0x4000_7000

    def __init__(self) -> None:
        self._control = StoredRegister("PWR CR1", 1 << 9 | _DBP, initial=1 << 9)

    def reset(self) -> None:
        self._control.reset()

    def registers(self) -> Sequence[Register]:
        # SR2.VOSF clear: the regulator has settled
        return self._control.map_to(0x00), Register(0x14, "SR2", lambda: 0, None)

    @property
    def backup_writable(self) -> bool:
        return bool(self._control.value & _DBP)


class Rcc:
    """Oscillators, PLL, bus prescalers, clock gates; `on_gate(peripheral, on)` reports all gates after a change."""

    name = "RCC"
    base = 0x4002_1000

    def __init__(
        self,
        *,
        timeline: Timeline,
        clocks: Clocks,
        flash: Flash,
        power: Power,
        on_gate: Callable[[str, bool], None],
        on_clock: Callable[[], None],
        has_crystal: bool = True,
    ) -> None:
        """Define the registers; the backup domain, with the crystal, survives resets."""
        self._timeline = timeline
        self._power = power
        self._has_crystal = has_crystal
        self._crystal_since: int | None = None  # the backup domain survives resets
        self._clocks = clocks
        self._flash = flash
        self._on_gate = on_gate
        self._on_clock = on_clock
        self._control = StoredRegister("RCC CR", 0x0100_01FD, initial=0x61, after=self._retune)
        self._configuration = StoredRegister("RCC CFGR", 0x0000_3FF3, after=self._retune)
        self._pll = StoredRegister("RCC PLLCFGR", 0x0700_7F73, initial=0x1000, after=self._retune)
        self._selection = StoredRegister("RCC CCIPR", 0)
        self._reset_flags = RESET_POWER | RESET_PIN
        self._enabled = {
            offset: StoredRegister(
                f"RCC {_ENABLE_NAMES[offset]}",
                sum(1 << bit for bit in bits),
                initial=1 << 8 if offset == 0x48 else 0,
                after=self._gate,
            )
            for offset, bits in _ENABLE_BITS.items()
        }

    def reset(self) -> None:
        for register in (self._control, self._configuration, self._pll, self._selection, *self._enabled.values()):
            register.reset()
        self._gate()
        self._retune()

    def note_reset(self, cause: int) -> None:
        """Record the cause of the chip's reset for RCC CSR. Every reset also pulls the reset pin."""
        self._reset_flags |= cause | RESET_PIN

    def registers(self) -> Sequence[Register]:
        return (
            Register(0x00, "CR", self._read_control, self._write_control),
            Register(0x08, "CFGR", self._read_configuration, self._write_configuration),
            self._pll.map_to(0x0C),
            *(register.map_to(offset) for offset, register in self._enabled.items()),
            self._selection.map_to(0x88),
            Register(0x90, "BDCR", self._read_backup, self._write_backup),
            Register(0x94, "CSR", self._read_status, self._write_status),
        )

    def _read_control(self) -> int:
        value = self._control.value  # every oscillator is ready at once
        return value | (value & _MSION) << 1 | (value & _HSION) << 2 | (value & _PLLON) << 1

    def _write_control(self, value: int) -> None:
        self._control.write(value & ~(1 << 1 | 1 << 10 | 1 << 25))

    def _read_configuration(self) -> int:
        return self._configuration.value | (self._configuration.value & 3) << 2

    def _write_configuration(self, value: int) -> None:
        self._configuration.write(value & ~(3 << 2))

    def _read_backup(self) -> int:
        if self._crystal_since is None:
            return 0
        is_ready = self._has_crystal and self._timeline.now - self._crystal_since >= _CRYSTAL_START_TICKS
        return _LSEON | (_LSERDY if is_ready else 0)

    def _write_backup(self, value: int) -> None:
        check_bits("RCC BDCR", value, _LSEON | _LSERDY)
        if not self._power.backup_writable:
            raise Violation(
                "backup_locked", "RCC BDCR written while the backup domain is locked", "Set PWR CR1 DBP first"
            )
        if not value & _LSEON:
            self._crystal_since = None
        elif self._crystal_since is None:
            self._crystal_since = self._timeline.now

    def _read_status(self) -> int:
        return self._reset_flags | _MSI_RANGE_AFTER_STANDBY

    def _write_status(self, value: int) -> None:
        check_bits("RCC CSR", value & ~_RESET_FLAGS, _REMOVE_RESET_FLAGS | _MSI_RANGE_AFTER_STANDBY)
        if value & _REMOVE_RESET_FLAGS:
            self._reset_flags = 0

    def _gate(self) -> None:
        for offset, bits in _ENABLE_BITS.items():
            for bit, peripheral in bits.items():
                self._on_gate(peripheral, bool(self._enabled[offset].value >> bit & 1))

    def _retune(self) -> None:
        """Set the clocks of the core and the buses from the registers."""
        core_hz = self._source_hz()
        ahb = self._configuration.value >> 4 & 0xF
        core_hz >>= 0 if ahb < 8 else (1, 2, 3, 4, 6, 7, 8, 9)[ahb - 8]
        if core_hz > 80_000_000 or core_hz > (self._flash.wait_states + 1) * _HZ_PER_WAIT_STATE:
            raise Violation(
                "core_too_fast",
                f"RCC sets the core to {core_hz / 1e6:g} MHz with {self._flash.wait_states} flash wait states",
                "Set FLASH ACR first; 80 MHz is the most, with 4 wait states",
            )
        self._clocks.core_hz = core_hz
        self._clocks.pclk1_hz = core_hz >> max(0, (self._configuration.value >> 8 & 7) - 3)
        self._clocks.pclk2_hz = core_hz >> max(0, (self._configuration.value >> 11 & 7) - 3)
        self._on_clock()

    def _msi_hz(self) -> int:
        control = self._control.value
        return 1000 * _MSI_KHZ[(control & _MSIRANGE) >> 4] if control & _MSIRGSEL else 4_000_000

    def _source_hz(self) -> int:
        """Return the frequency of the selected clock before the AHB prescaler."""
        control, pll = self._control.value, self._pll.value
        source = self._configuration.value & 3
        if source == 0 and control & _MSION:
            return self._msi_hz()
        if source == 1 and control & _HSION:
            return _HSI_HZ
        pll_input = {1: self._msi_hz() if control & _MSION else 0, 2: _HSI_HZ if control & _HSION else 0}.get(
            pll & 3, 0
        )
        if source == 3 and control & _PLLON and pll >> 24 & 1 and pll_input:
            return pll_input // ((pll >> 4 & 7) + 1) * (pll >> 8 & 0x7F) // (2 * ((pll >> 25 & 3) + 1))
        raise Violation(
            "no_system_clock",
            "RCC selects a clock for the core that is not running",
            "Start the oscillator or the PLL (with its R output) before switching to it",
        )
