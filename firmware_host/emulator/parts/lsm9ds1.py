"""The LSM9DS1's gyroscope, accelerometer and thermometer at register level (DocID025715, sections 2, 3, 5–7)."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.chip.spi_device import Fault
from firmware_host.emulator.parts.accelerometer import STANDARD_GRAVITY_M_S2, Accelerometer, AccelerometerTruth
from firmware_host.emulator.parts.gyroscope import Gyroscope, GyroTruth, Temperature, saturate
from firmware_host.emulator.parts.part_registers import Conversions, OutputRegisters, PartRegisters
from firmware_host.emulator.parts.triad import CachedMotion
from firmware_host.parts import GYROSCOPES

WIRED = GYROSCOPES["lsm9ds1"]
WHO_AM_I = 0x68
_LSM6DS3 = 0x69  # the identity of another part of the maker
_INT1_CTRL, _WHO_AM_I, _CTRL_REG1_G = 0x0C, 0x0F, 0x10
_OUT_TEMP_L, _OUT_TEMP_H, _STATUS_REG, _OUT_X_L_G, _OUT_Z_H_G = 0x15, 0x16, 0x17, 0x18, 0x1D
_CTRL_REG6_XL, _CTRL_REG8 = 0x20, 0x22
_STATUS_REG_AGAIN, _OUT_X_L_XL, _OUT_Z_H_XL = 0x27, 0x28, 0x2D
# Registers of the accelerometer and gyroscope, with their values after reset and the bits that have a model. Writing
# one to any other bit fails the run: it would switch on a filter, FIFO, sleep or format that is not simulated.
_RESET_AND_BITS = {
    0x04: (0x00, 0x00),  # ACT_THS: no sleep at rest
    0x05: (0x00, 0x00),  # ACT_DUR
    _INT1_CTRL: (0x00, 0x02),  # INT_DRDY_G
    0x0D: (0x00, 0x00),  # INT2_CTRL
    _CTRL_REG1_G: (0x00, 0xFB),  # ODR_G, FS_G; BW_G acts on the second filter, which is bypassed
    0x11: (0x00, 0x00),  # CTRL_REG2_G: output straight after the first filter
    0x12: (0x00, 0x00),  # CTRL_REG3_G: no high-pass filter, no low-power mode
    0x13: (0x00, 0x00),  # ORIENT_CFG_G
    0x1E: (0x38, 0x38),  # CTRL_REG4: all three axes
    0x1F: (0x38, 0x38),  # CTRL_REG5_XL
    _CTRL_REG6_XL: (0x00, 0xFF),  # ODR_XL, FS_XL, and the filter, which is part of the truth
    0x21: (0x00, 0x00),  # CTRL_REG7_XL
    _CTRL_REG8: (0x04, 0x45),  # BDU, IF_ADD_INC, SW_RESET
    0x23: (0x00, 0x04),  # CTRL_REG9: I2C_DISABLE
    0x24: (0x00, 0x00),  # CTRL_REG10
    0x2E: (0x00, 0x00),  # FIFO_CTRL
}
_RATES_HZ = {1: 14.9, 2: 59.5, 3: 119.0, 4: 238.0, 5: 476.0, 6: 952.0}  # table 46
_SETTLING = {1: 2, 2: 3, 3: 3, 4: 4, 5: 5, 6: 8}  # table 12: first conversions to discard, without the second filter
_SENSITIVITIES_MDPS = {0: 8.75, 1: 17.5, 3: 70.0}  # table 3; 245, 500 and 2000 °/s
_SENSITIVITIES_MG = {0: 0.061, 1: 0.732, 2: 0.122, 3: 0.244}  # the same table; 2, 16, 4 and 8 g
_XLDA, _GDA, _TDA = 0x01, 0x02, 0x04
_LAST_OUTPUT = 5  # the high byte of z
_BDU, _IF_ADD_INC, _SW_RESET = 0x40, 0x04, 0x01


class Lsm9ds1:
    """The accelerometer-gyroscope die on the SPI bus.

    `motion_at`, `truth`, `seed`, `temperature_c`: see `Gyroscope`; the motion is evaluated once for each conversion, at
    its instant, and noise is drawn per conversion, so that readings do not depend on the time of reading.
    `acceleration`: see `Accelerometer`. `oscillator_ppm`: the error of the part's own oscillator, and so of its data
    rate.

    Motion and truth are in right-handed axes, those of the part's magnetometer: in the registers of both triads x has
    the opposite sign (figure 1). The accelerometer runs only with the gyroscope: writing its control register selects
    it alone (section 3.1). This mode has no model, so conversions stop until CTRL_REG1_G is written.

    The data-ready line stays high until the high byte of the z rate is read: the next conversion replaces an unread one
    without a new edge. The data sheet states the number of conversions to discard after a start, not their error: here
    the rate ramps up linearly over them.
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
        acceleration: AccelerometerTruth | None = None,
        oscillator_ppm: float = 0.0,
        chip_select: str = WIRED.select,
        interrupt: str = WIRED.data_ready,
    ) -> None:
        self.chip_select = chip_select
        self.interrupt = interrupt
        self.fault: Fault | None = None
        motion = CachedMotion(motion_at)
        self._gyroscope = Gyroscope(motion, truth, seed, temperature_c)
        self._accelerometer = Accelerometer(motion, acceleration, seed, temperature_c)
        self._registers = PartRegisters(self.name, "lsm9ds1.py", _RESET_AND_BITS)
        self._conversions = Conversions(oscillator_ppm)
        self._address: int | None = None  # None: the next byte is the address
        self._reading = False
        self._reset()

    # --- the board's side

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

    def predict(self) -> bytes:
        """Return no predicted answers: each read changes later data."""
        return b""

    # --- registers

    def _reset(self) -> None:
        self._registers.reset()
        self._status = 0
        self._rates = OutputRegisters()
        self._accelerations = OutputRegisters()
        self._temperature = bytes(2)
        self._settling = 0
        self._accelerating = False
        self._conversions.stop()

    def _read(self, address: int) -> int:
        if _OUT_X_L_G <= address <= _OUT_Z_H_G:
            return self._read_output(self._rates, address - _OUT_X_L_G, _GDA)
        if _OUT_X_L_XL <= address <= _OUT_Z_H_XL:
            return self._read_output(self._accelerations, address - _OUT_X_L_XL, _XLDA)
        if address in self._registers.values:
            return self._registers.values[address]
        if address == _WHO_AM_I:
            return _LSM6DS3 if self.fault is Fault.OTHER_PART else WHO_AM_I
        if address in (_STATUS_REG, _STATUS_REG_AGAIN):
            return self._status
        if address in (_OUT_TEMP_L, _OUT_TEMP_H):
            if address == _OUT_TEMP_H:
                self._status &= ~_TDA
            return self._temperature[address - _OUT_TEMP_L]
        raise self._registers.describe_unmodelled("read of", address)

    def _read_output(self, outputs: OutputRegisters, index: int, flag: int) -> int:
        if index == _LAST_OUTPUT:
            self._status &= ~flag
        return outputs.read(index, block_update=bool(self._registers.values[_CTRL_REG8] & _BDU))

    def _write(self, address: int, value: int, time_s: float) -> None:
        self._registers.check(address, value)
        if address == _CTRL_REG8 and value & _SW_RESET:
            self._reset()
            return
        changed = self._registers.values[address] != value
        self._registers.values[address] = value
        if address == _CTRL_REG1_G and (changed or math.isinf(self._conversions.next_s)):
            self._start(value, time_s)
        if address == _CTRL_REG6_XL:
            self._conversions.stop()

    def _start(self, control: int, time_s: float) -> None:
        """Restart conversions with a new data rate or range. Raise Violation for one that the part does not have."""
        rate_code, range_code = control >> 5, control >> 3 & 3
        if rate_code == 7 or range_code == 2:
            raise Violation(
                "sensor_setup",
                f"LSM9DS1 CTRL_REG1_G = 0x{control:02X}: data rate or range that the part does not have",
                "Use rate codes 0–6 and range codes 0, 1, 3",
            )
        control_xl = self._registers.values[_CTRL_REG6_XL]
        if control_xl >> 5 not in (0, rate_code):
            raise Violation(
                "sensor_setup",
                f"LSM9DS1 CTRL_REG6_XL = 0x{control_xl:02X} with CTRL_REG1_G = 0x{control:02X}: two data rates",
                "Use the same rate code in both, or 0 for no accelerations",
            )
        self._accelerating = bool(control_xl >> 5)
        self._g_per_count = _SENSITIVITIES_MG[control_xl >> 3 & 3] * 1e-3
        self._status &= ~(_GDA | _XLDA)
        self._settling = _SETTLING.get(rate_code, 0)
        if rate_code:
            self._conversions.start(time_s, _RATES_HZ[rate_code])
        else:
            self._conversions.stop()
        self._per_count = math.radians(_SENSITIVITIES_MDPS[range_code] * 1e-3)

    # --- measuring

    def _convert(self, time_s: float) -> None:
        """Convert all axes and the thermometer, into the output registers."""
        settled = min(1.0, self._conversions.count / (self._settling + 1))
        self._rates.show(_flip_x(self._gyroscope.read(time_s, settled)), self._per_count)
        temperature = saturate(round((self._gyroscope.temperature_c(time_s) - 25) * 16), bits=12)
        self._temperature = temperature.to_bytes(2, "little", signed=True)
        self._status |= _GDA | _TDA
        if self._accelerating:
            force_m_s2 = self._accelerometer.read(time_s, settled)
            self._accelerations.show(_flip_x(force_m_s2), self._g_per_count * STANDARD_GRAVITY_M_S2)
            self._status |= _XLDA


def _flip_x(vector: Sequence[float]) -> Sequence[float]:
    """Return a vector, given in right-handed axes, in the axes of gyroscope and accelerometer."""
    x, y, z = vector
    return -x, y, z
