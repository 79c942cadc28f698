"""The LSM9DS1's magnetometer at register level (data sheet DocID025715, sections 2, 5, 6 and 8)."""

from collections.abc import Callable, Sequence

import numpy as np

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.chip.spi_device import Fault
from firmware_host.emulator.parts.magnetometer import GAUSS_T, Magnetometer, MagnetometerTruth
from firmware_host.emulator.parts.part_registers import Conversions, OutputRegisters, PartRegisters
from firmware_host.parts import MAGNETOMETERS

WIRED = MAGNETOMETERS["lsm9ds1_magnetometer"]
WHO_AM_I = 0x3D
_LIS2MDL = 0x40  # the identity of another magnetometer of the maker, at another address
_WHO_AM_I, _STATUS_REG_M, _OUT_X_L_M, _OUT_Z_H_M = 0x0F, 0x27, 0x28, 0x2D
_CTRL_REG1_M, _CTRL_REG2_M, _CTRL_REG3_M, _CTRL_REG5_M = 0x20, 0x21, 0x22, 0x24
# Registers with their values after reset and the bits that have a model; writing a one to any other fails the run.
_RESET_AND_BITS = {
    **dict.fromkeys(range(0x05, 0x0B), (0x00, 0x00)),  # OFFSET_X_REG_L_M …: an offset that the part subtracts
    _CTRL_REG1_M: (0x10, 0xFC),  # TEMP_COMP, OM, DO; the noise of a mode is part of the truth
    _CTRL_REG2_M: (0x00, 0x64),  # FS, SOFT_RST
    _CTRL_REG3_M: (0x03, 0x83),  # I2C_DISABLE, MD; SIM stays 0: four wires
    0x23: (0x00, 0x0C),  # CTRL_REG4_M: OMZ
    _CTRL_REG5_M: (0x00, 0x40),  # BDU
}
_RATES_HZ = (0.625, 1.25, 2.5, 5.0, 10.0, 20.0, 40.0, 80.0)
_SENSITIVITIES_MGAUSS = (0.14, 0.29, 0.43, 0.58)  # table 3; 4, 8, 12 and 16 gauss
_SOFT_RST, _MODE, _CONTINUOUS, _SINGLE, _BDU = 0x04, 0x03, 0x00, 0x01, 0x40
_AXES, _ALL = 0x07, 0x08  # STATUS_REG_M: new data of one axis, of all; the same for overrun four bits up


class Lsm9ds1Magnetometer:
    """The magnetometer die on the SPI bus: its own select, data-ready line and oscillator.

    `field_at`, `truth`, `seed`: see `Magnetometer`, in the axes of the data sheet's figure 1, which are right-handed
    (docs/board.md, "Axes"). `oscillator_ppm`: the error of the part's own oscillator, and so of its data rate.

    DRDY_M follows ZYXDA: high after a conversion, low when the high bytes of all three axes have been read (as in the
    LIS3MDL, a part with the same registers; not verified). The data sheet does not mention wrong first conversions;
    here there are none.
    """

    name = "LSM9DS1-M"
    spi_modes = (3,)
    spi_max_hz = 10e6

    def __init__(
        self,
        field_at: Callable[[float], Sequence[float]],
        truth: MagnetometerTruth,
        *,
        seed: int | np.random.SeedSequence,
        oscillator_ppm: float = 0.0,
        chip_select: str = WIRED.select,
        interrupt: str = WIRED.data_ready,
    ) -> None:
        self.chip_select = chip_select
        self.interrupt = interrupt
        self.fault: Fault | None = None
        self._magnetometer = Magnetometer(field_at, truth, seed)
        self._registers = PartRegisters(self.name, "lsm9ds1_magnetometer.py", _RESET_AND_BITS)
        self._conversions = Conversions(oscillator_ppm)
        self._address: int | None = None  # None: the next byte is the address
        self._reading = self._counts_up = False
        self._reset()

    # --- the board's side

    @property
    def next_event_s(self) -> float:
        return self._conversions.next_s

    @property
    def interrupt_level(self) -> bool:
        return bool(self._status & _ALL)

    def advance(self, time_s: float) -> None:
        while self._conversions.next_s <= time_s:
            self._convert(self._conversions.take())

    def select(self, time_s: float) -> None:
        self._address = None

    def deselect(self, time_s: float) -> None:
        self._address = None

    def transfer(self, byte: int, time_s: float) -> int:
        if self._address is None:
            self._reading, self._counts_up = bool(byte & 0x80), bool(byte & 0x40)
            self._address = byte & 0x3F
            return 0xFF
        address = self._address
        if self._counts_up:
            self._address = address + 1 & 0x3F
        if self._reading:
            return self._read(address)
        self._write(address, byte, time_s)
        return 0xFF

    def predict(self) -> bytes:
        """Return no predicted answers: each read changes later data."""
        return b""

    # --- registers

    def _reset(self) -> None:
        self._registers.reset()
        self._status = 0
        self._field = OutputRegisters()
        self._conversions.stop()

    def _read(self, address: int) -> int:
        if _OUT_X_L_M <= address <= _OUT_Z_H_M:
            return self._read_output(address - _OUT_X_L_M)
        if address in self._registers.values:
            return self._registers.values[address]
        if address == _WHO_AM_I:
            return _LIS2MDL if self.fault is Fault.OTHER_PART else WHO_AM_I
        if address == _STATUS_REG_M:
            return self._status
        raise self._registers.describe_unmodelled("read of", address)

    def _read_output(self, index: int) -> int:
        axis, high = divmod(index, 2)
        if high:
            self._status &= ~(0x11 << axis)
            if not self._status & _AXES:
                self._status = 0
        return self._field.read(index, block_update=bool(self._registers.values[_CTRL_REG5_M] & _BDU))

    def _write(self, address: int, value: int, time_s: float) -> None:
        self._registers.check(address, value)
        if address == _CTRL_REG2_M and value & _SOFT_RST:
            self._reset()
            return
        if address == _CTRL_REG3_M and value & _MODE == _SINGLE:
            raise Violation(
                "sensor_setup", f"{self.name} CTRL_REG3_M = 0x{value:02X}: single conversions", "Use MD 0, 2 or 3"
            )
        changed = self._registers.values[address] != value
        self._registers.values[address] = value
        if changed and address in (_CTRL_REG1_M, _CTRL_REG2_M, _CTRL_REG3_M):
            self._start(time_s)

    def _start(self, time_s: float) -> None:
        """Restart conversions with another data rate, range or mode, or stop them."""
        values = self._registers.values
        self._status = 0
        if values[_CTRL_REG3_M] & _MODE == _CONTINUOUS:
            self._conversions.start(time_s, _RATES_HZ[values[_CTRL_REG1_M] >> 2 & 7])
        else:
            self._conversions.stop()

    # --- measuring

    def _convert(self, time_s: float) -> None:
        """Convert all axes, into the output registers."""
        per_count_mgauss = _SENSITIVITIES_MGAUSS[self._registers.values[_CTRL_REG2_M] >> 5 & 3]
        self._field.show(self._magnetometer.read(time_s), per_count_mgauss * 1e-3 * GAUSS_T)
        overrun = self._status & (_AXES | _ALL)
        self._status |= _AXES | _ALL | overrun << 4
