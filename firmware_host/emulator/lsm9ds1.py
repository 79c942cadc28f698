"""The LSM9DS1's gyroscope and thermometer at register level (datasheet DocID025715, sections 2, 5, 6 and 7)."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from firmware_host.emulator.bus import Violation
from firmware_host.emulator.gyroscope import Gyroscope, GyroTruth, Temperature, saturated
from firmware_host.emulator.part_registers import Conversions, PartRegisters
from firmware_host.emulator.spi_device import Fault

WHO_AM_I = 0x68
_LSM6DS3 = 0x69  # what another part of the maker answers
_INT1_CTRL, _WHO_AM_I, _CTRL_REG1_G = 0x0C, 0x0F, 0x10
_OUT_TEMP_L, _OUT_TEMP_H, _STATUS_REG, _OUT_X_L_G, _OUT_Z_H_G = 0x15, 0x16, 0x17, 0x18, 0x1D
_CTRL_REG8 = 0x22
# Registers of the accelerometer and gyroscope, with their values after reset and the bits that have a model. Writing
# one to any other bit fails the run: it would switch on a filter, FIFO, sleep or format that is not simulated.
_RESET_AND_BITS = {
    0x04: (0x00, 0x00),  # ACT_THS: no sleep while nothing turns
    0x05: (0x00, 0x00),  # ACT_DUR
    _INT1_CTRL: (0x00, 0x02),  # INT_DRDY_G
    0x0D: (0x00, 0x00),  # INT2_CTRL
    _CTRL_REG1_G: (0x00, 0xFB),  # ODR_G, FS_G; BW_G acts on the second filter, which is not in the path
    0x11: (0x00, 0x00),  # CTRL_REG2_G: output straight after the first filter
    0x12: (0x00, 0x00),  # CTRL_REG3_G: no high-pass filter, no low-power mode
    0x13: (0x00, 0x00),  # ORIENT_CFG_G
    0x1E: (0x38, 0x38),  # CTRL_REG4: all three axes
    0x1F: (0x38, 0x38),  # CTRL_REG5_XL
    0x20: (0x00, 0x00),  # CTRL_REG6_XL: a write would leave the accelerometer alone running (section 3.1)
    0x21: (0x00, 0x00),  # CTRL_REG7_XL
    _CTRL_REG8: (0x04, 0x45),  # BDU, IF_ADD_INC, SW_RESET
    0x23: (0x00, 0x04),  # CTRL_REG9: I2C_DISABLE
    0x24: (0x00, 0x00),  # CTRL_REG10
    0x2E: (0x00, 0x00),  # FIFO_CTRL
}
_RATES_HZ = {1: 14.9, 2: 59.5, 3: 119.0, 4: 238.0, 5: 476.0, 6: 952.0}  # table 46
_SETTLING = {1: 2, 2: 3, 3: 3, 4: 4, 5: 5, 6: 8}  # table 12: first conversions to discard, without the second filter
_SENSITIVITIES_MDPS = {0: 8.75, 1: 17.5, 3: 70.0}  # table 3; 245, 500 and 2000 °/s
_GDA, _TDA = 0x02, 0x04
_BDU, _IF_ADD_INC, _SW_RESET = 0x40, 0x04, 0x01


class Lsm9ds1:
    """The accelerometer-gyroscope die on the SPI bus; the accelerometer, which runs along, is left out.

    `motion_at`, `truth`, `seed`, `temperature_c`: see `Gyroscope`; the motion is asked for once for each conversion, at
    its instant, and noise is drawn per conversion, so that readings do not depend on when they are read.
    `oscillator_ppm`: how fast the part's own oscillator makes its data rate.

    The data-ready line stays high until the high byte of the z rate is read: a conversion that nobody read is
    replaced by the next without a new edge. The datasheet says how many conversions after a start to discard, not how
    wrong they are: here the turn rate comes in linearly over them.
    """

    name = "LSM9DS1"
    spi_modes = (3,)
    spi_max_hz = 10e6

    def __init__(
        self,
        motion_at: Callable[[float], Sequence[float]],
        truth: GyroTruth,
        *,
        temperature_c: float | Temperature,
        seed: int | np.random.SeedSequence,
        oscillator_ppm: float = 0.0,
        chip_select: str = "PA11",
        interrupt: str = "PA8",
    ) -> None:
        self.chip_select = chip_select
        self.interrupt = interrupt
        self.fault: Fault | None = None
        self._gyroscope = Gyroscope(motion_at, truth, seed, temperature_c)
        self._registers = PartRegisters(self.name, "lsm9ds1.py", _RESET_AND_BITS)
        self._conversions = Conversions(oscillator_ppm)
        self._address: int | None = None  # None: the next byte is the address
        self._reading = False
        self._reset()

    # --- what the board sees

    @property
    def next_event_s(self) -> float:
        return self._conversions.next_s

    @property
    def interrupt_level(self) -> bool:
        return bool(self._registers.values[_INT1_CTRL] & 0x02 and self._status & _GDA)

    def advance(self, time_s: float) -> None:
        while self._conversions.next_s <= time_s:
            self._convert(self._conversions.take())

    def select(self, time_s: float) -> None:
        self._address = None

    def deselect(self, time_s: float) -> None:
        self._address = None

    def transfer(self, byte: int, time_s: float) -> int:
        if self._address is None:
            self._reading = bool(byte & 0x80)
            self._address = byte & 0x7F
            return 0xFF
        address = self._address
        if self._registers.values[_CTRL_REG8] & _IF_ADD_INC:
            self._address = address + 1 & 0x7F
        if self._reading:
            return self._read(address)
        self._write(address, byte, time_s)
        return 0xFF

    # --- registers

    def _reset(self) -> None:
        self._registers.reset()
        self._status = 0
        self._latest = bytes(6)
        self._output = bytearray(6)
        self._temperature = bytes(2)
        self._held = [False, False, False]  # BDU: low byte read, high byte not yet
        self._settling = 0
        self._conversions.stop()

    def _read(self, address: int) -> int:
        if _OUT_X_L_G <= address <= _OUT_Z_H_G:
            return self._read_output(address - _OUT_X_L_G)
        if address in self._registers.values:
            return self._registers.values[address]
        if address == _WHO_AM_I:
            return _LSM6DS3 if self.fault is Fault.OTHER_PART else WHO_AM_I
        if address == _STATUS_REG:
            return self._status
        if address in (_OUT_TEMP_L, _OUT_TEMP_H):
            if address == _OUT_TEMP_H:
                self._status &= ~_TDA
            return self._temperature[address - _OUT_TEMP_L]
        raise self._registers.unmodelled("read of", address)

    def _read_output(self, index: int) -> int:
        axis, high = divmod(index, 2)
        value = self._output[index]
        if self._registers.values[_CTRL_REG8] & _BDU:
            self._held[axis] = not high
            if high:
                self._output[index - 1 : index + 1] = self._latest[index - 1 : index + 1]
        if axis == 2 and high:
            self._status &= ~_GDA
        return value

    def _write(self, address: int, value: int, time_s: float) -> None:
        self._registers.check(address, value)
        if address == _CTRL_REG8 and value & _SW_RESET:
            self._reset()
            return
        changed = self._registers.values[address] != value
        self._registers.values[address] = value
        if address == _CTRL_REG1_G and changed:
            self._start(value, time_s)

    def _start(self, control: int, time_s: float) -> None:
        """A new data rate or range: conversions begin anew."""
        rate_code, range_code = control >> 5, control >> 3 & 3
        if rate_code == 7 or range_code == 2:
            raise Violation(
                "sensor_setup",
                f"LSM9DS1 CTRL_REG1_G = 0x{control:02X}: data rate or range that the part does not have",
                "Use rate codes 0–6 and range codes 0, 1, 3",
            )
        self._status &= ~_GDA
        self._settling = _SETTLING.get(rate_code, 0)
        if rate_code:
            self._conversions.start(time_s, _RATES_HZ[rate_code])
        else:
            self._conversions.stop()
        self._per_count = math.radians(_SENSITIVITIES_MDPS[range_code] * 1e-3)

    # --- measuring

    def _convert(self, time_s: float) -> None:
        """One conversion of all axes and the thermometer, as the output registers will show it."""
        settled = min(1.0, self._conversions.count / (self._settling + 1))
        data = b"".join(
            saturated(round(rate_rad_s / self._per_count)).to_bytes(2, "little", signed=True)
            for rate_rad_s in self._gyroscope.read(time_s, settled)
        )
        self._latest = data
        for axis_index in range(3):
            if not self._held[axis_index]:
                low = 2 * axis_index
                self._output[low : low + 2] = data[low : low + 2]
        temperature = saturated(round((self._gyroscope.temperature_c(time_s) - 25) * 16), bits=12)
        self._temperature = temperature.to_bytes(2, "little", signed=True)
        self._status |= _GDA | _TDA
