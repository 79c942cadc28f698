"""The ICM-42688-P's gyroscope, accelerometer and thermometer at register level (data sheet DS-000347, revision 1.8).

Not modelled: its FIFO, motion functions, time stamp, I2C and I3C, and the register banks 1 to 4.
"""

import math
import struct
from collections.abc import Callable, Sequence

import numpy as np

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.chip.spi_device import Fault
from firmware_host.emulator.parts.accelerometer import STANDARD_GRAVITY_M_S2, Accelerometer, AccelerometerTruth
from firmware_host.emulator.parts.gyroscope import Gyroscope, GyroTruth, Temperature, saturate
from firmware_host.emulator.parts.part_registers import Conversions, PartRegisters
from firmware_host.emulator.parts.triad import CachedMotion
from firmware_host.parts import GYROSCOPES

WIRED = GYROSCOPES["icm42688p"]
WHO_AM_I = 0x47
_ICM42605 = 0x42  # the identity of a sibling with the same registers
_DEVICE_CONFIG, _INT_CONFIG = 0x11, 0x14
_TEMP_DATA1, _GYRO_DATA_Z0, _INT_STATUS = 0x1D, 0x2A, 0x2D
_INTF_CONFIG0, _PWR_MGMT0, _GYRO_CONFIG0, _ACCEL_CONFIG0 = 0x4C, 0x4E, 0x4F, 0x50
_INT_CONFIG1, _INT_SOURCE0, _WHO_AM_I, _REG_BANK_SEL = 0x64, 0x65, 0x75, 0x76
# Values after reset (section 14) and the bits that have a model; reserved bits keep their value. Writing a one to any
# other bit fails the run: it would switch on a FIFO, filter, bus or function that is not simulated.
_RESET_AND_BITS = {
    _DEVICE_CONFIG: (0x00, 0x01),  # SOFT_RESET_CONFIG
    0x13: (0x05, 0x05),  # DRIVE_CONFIG: slew rate
    _INT_CONFIG: (0x00, 0x03),  # INT1: pulses; push-pull, active high
    0x16: (0x00, 0x00),  # FIFO_CONFIG: bypass
    _INTF_CONFIG0: (0x30, 0xB3),  # FIFO_HOLD_LAST_DATA_EN, FIFO_COUNT_ENDIAN, SENSOR_DATA_ENDIAN, UI_SIFS_CFG
    0x4D: (0x91, 0x91),  # INTF_CONFIG1: CLKSEL, the gyroscope's oscillator when it runs
    _PWR_MGMT0: (0x00, 0x0F),  # GYRO_MODE, ACCEL_MODE
    _GYRO_CONFIG0: (0x06, 0xEF),  # GYRO_FS_SEL, GYRO_ODR
    _ACCEL_CONFIG0: (0x06, 0x6F),  # ACCEL_FS_SEL, ACCEL_ODR
    0x51: (0x16, 0x1E),  # GYRO_CONFIG1: orders of the filters, which are part of the truth
    0x52: (0x11, 0xFF),  # GYRO_ACCEL_CONFIG0: bandwidths, likewise
    0x53: (0x0D, 0x1D),  # ACCEL_CONFIG1: orders, likewise
    0x5F: (0x00, 0x00),  # FIFO_CONFIG1
    0x63: (0x00, 0x00),  # INT_CONFIG0: the status is cleared by reading it
    _INT_CONFIG1: (0x10, 0x10),  # INT_ASYNC_RESET; pulses of 100 µs
    _INT_SOURCE0: (0x10, 0x18),  # RESET_DONE_INT1_EN, UI_DRDY_INT1_EN
    0x66: (0x00, 0x00),  # INT_SOURCE1
    0x70: (0x00, 0x00),  # SELF_TEST_CONFIG
    _REG_BANK_SEL: (0x00, 0x07),  # BANK_SEL
}
_SOFT_RESET, _PUSH_PULL_HIGH, _HOLD_LAST, _BIG_ENDIAN = 0x01, 0x03, 0x80, 0x10
_ASYNC_RESET, _DRDY, _RESET_DONE = 0x10, 0x08, 0x10
_BOTH_LOW_NOISE = 0x0F
_RATES_HZ = {  # GYRO_ODR and ACCEL_ODR in low-noise mode (sections 14.37 and 14.38), up to pulses of 100 µs
    0x5: 2000.0, 0x6: 1000.0, 0xF: 500.0, 0x7: 200.0, 0x8: 100.0, 0x9: 50.0, 0xA: 25.0, 0xB: 12.5,
}  # fmt: skip
_COUNTS_PER_DEG_S = (16.4, 32.8, 65.5, 131.0, 262.0, 524.3, 1048.6, 2097.2)  # table 1; 2000, 1000, … 15.625 °/s
_COUNTS_PER_G = (2048, 4096, 8192, 16384)  # table 2; 16, 8, 4, 2 g
_COUNTS_PER_DEG_C, _ROOM_C = 132.48, 25.0  # section 4.13
_PULSE_S = 100e-6  # of the interrupt line (section 14.50)
_RESET_S = 1e-3  # section 14.1: no other register may be accessed before
_QUIET_S = 200e-6  # section 14.36: no register may be written in this time after a sensor was switched on
_START_S = 0.030  # table 1: from enabling the gyroscope until its drive is ready
_BURST_S = 60e-6  # no reading of the outputs takes longer


class Icm42688P:
    """The part on the SPI bus.

    `motion_at`, `truth`, `seed`, `temperature_c`: see `Gyroscope`; the motion is evaluated once for each conversion, at
    its instant, and noise is drawn per conversion. `acceleration`: see `Accelerometer`. `oscillator_ppm`: the error of
    the part's own oscillator, and so of its data rate; the data sheet allows a percent (section 4.10).

    The part converts while both sensors are in low-noise mode at one data rate and the data-ready interrupt is routed
    to INT1; otherwise it does not convert, and reading its outputs fails the run. The data sheet does not state that
    outputs are frozen during a read: here a conversion during a read changes the rest of it. The motion ramps up
    linearly while the gyroscope starts.
    """

    name = "ICM-42688-P"
    spi_modes = (0, 3)
    spi_max_hz = 24e6

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
        """Power the part.

        `motion_at` returns rate, rad/s, and specific force, g, at a virtual time, s.
        """
        self.chip_select = chip_select
        self.interrupt = interrupt
        self.fault: Fault | None = None
        self._pulse_end_s = math.inf
        motion = CachedMotion(motion_at)
        self._gyroscope = Gyroscope(motion, truth, seed, temperature_c)
        self._accelerometer = Accelerometer(motion, acceleration, seed, temperature_c)
        self._registers = PartRegisters(self.name, "icm42688p.py", _RESET_AND_BITS)
        self._conversions = Conversions(oscillator_ppm)
        self._address: int | None = None  # None: the next byte is the address
        self._reading = False
        self._selected_s = 0.0
        self._reset()
        self._usable_s = self._writable_s = -math.inf

    # --- the board's side

    @property
    def next_event_s(self) -> float:
        return min(self._conversions.next_s, self._pulse_end_s)

    @property
    def interrupt_level(self) -> bool:
        return self._pin

    def advance(self, time_s: float) -> None:
        while self.next_event_s <= time_s:
            if self._pulse_end_s <= self._conversions.next_s:
                self._pin = False
                self._pulse_end_s = math.inf
            else:
                self._convert(self._conversions.take())

    def select(self, time_s: float) -> None:
        self._address = None
        self._selected_s = time_s

    def deselect(self, time_s: float) -> None:
        self._address = None

    def transfer(self, byte: int, time_s: float) -> int:
        if self._address is None:
            self._reading = bool(byte & 0x80)
            self._address = byte & 0x7F
            return 0xFF
        address = self._address
        self._address = address + 1 & 0x7F
        if time_s < self._usable_s:
            raise Violation(
                "sensor_setup",
                f"ICM-42688-P register 0x{address:02X} accessed "
                f"{1e3 * (time_s - self._usable_s + _RESET_S):.2f} ms after its reset",
                f"Wait {1e3 * _RESET_S:g} ms",
            )
        if self._reading:
            return self._read(address)
        self._write(address, byte, time_s)
        return 0xFF

    def predict(self) -> bytes:
        """Return the outputs if no conversion is due before the read ends, because a read changes no output."""
        address = self._address
        if address is None or not self._reading or not _TEMP_DATA1 <= address <= _GYRO_DATA_Z0:
            return b""
        if self._bank or not self._converts or self._conversions.next_s < self._selected_s + _BURST_S:
            return b""
        predicted = self._output[address - _TEMP_DATA1 :]
        predicted = predicted[: len(predicted) & ~1]
        self._address = address + len(predicted)
        return predicted

    # --- registers

    def _reset(self) -> None:
        self._registers.reset()
        self._status = _RESET_DONE
        self._pin = False
        self._pulse_end_s = self._on_s = math.inf
        self._output = struct.pack(">7h", *[-32768] * 7)  # section 12.8: until the first sample
        self._conversions.stop()

    @property
    def _bank(self) -> int:
        return self._registers.values[_REG_BANK_SEL]

    @property
    def _converts(self) -> bool:
        return self._conversions.next_s < math.inf

    def _read(self, address: int) -> int:
        registers = self._registers.values
        if address == _REG_BANK_SEL:  # in all banks
            return registers[address]
        if self._bank:
            raise self._registers.describe_unmodelled(f"read in bank {self._bank} of", address)
        if address in registers:
            return registers[address]
        if address == _WHO_AM_I:
            return _ICM42605 if self.fault is Fault.OTHER_PART else WHO_AM_I
        if address == _INT_STATUS:
            status, self._status = self._status, 0
            return status
        if address == _GYRO_DATA_Z0 + 1:  # TMST_FSYNCH: no signal at FSYNC
            return 0
        if not _TEMP_DATA1 <= address <= _GYRO_DATA_Z0:
            raise self._registers.describe_unmodelled("read of", address)
        if not self._converts:
            raise Violation(
                "sensor_setup",
                f"ICM-42688-P register 0x{address:02X} read while it converts nothing",
                "Set PWR_MGMT0 to 0x0F, INT_SOURCE0 to 0x08 and both rates to one that icm42688p.py models",
            )
        return self._output[address - _TEMP_DATA1]

    def _write(self, address: int, value: int, time_s: float) -> None:
        """Write a register and apply its effects. Raise Violation for a write that the data sheet forbids."""
        registers = self._registers.values
        if self._bank and address != _REG_BANK_SEL:
            raise self._registers.describe_unmodelled(f"write in bank {self._bank} to", address)
        self._registers.check(address, value)
        if time_s < self._writable_s:
            raise Violation(
                "sensor_setup",
                f"ICM-42688-P register 0x{address:02X} written {1e6 * (time_s - self._on_s):.0f} µs after a sensor was "
                "switched on",
                f"Wait {1e6 * _QUIET_S:g} µs",
            )
        if address == _DEVICE_CONFIG and value & _SOFT_RESET:
            self._reset()
            self._usable_s = time_s + _RESET_S
            return
        old_value, registers[address] = registers[address], value
        if address == _PWR_MGMT0 and value != old_value and value:
            self._on_s = time_s
            self._writable_s = time_s + _QUIET_S
        elif value != old_value and registers[_PWR_MGMT0] and address not in (
            _PWR_MGMT0, _GYRO_CONFIG0, _ACCEL_CONFIG0, _REG_BANK_SEL,
        ):  # fmt: skip
            raise Violation(
                "sensor_setup",
                f"ICM-42688-P register 0x{address:02X} changed while a sensor is on (section 12.9)",
                "Switch both sensors off first",
            )
        self._start(time_s)

    def _start(self, time_s: float) -> None:
        """Restart conversions, if the part is set up to convert. Raise Violation for unsupported settings."""
        registers = self._registers.values
        code = registers[_GYRO_CONFIG0] & 0x0F
        runs = registers[_PWR_MGMT0] == _BOTH_LOW_NOISE and registers[_INT_SOURCE0] & _DRDY
        if not runs or code not in _RATES_HZ or registers[_ACCEL_CONFIG0] & 0x0F != code:
            self._conversions.stop()
            return
        if registers[_INT_CONFIG] != _PUSH_PULL_HIGH or registers[_INT_CONFIG1] & _ASYNC_RESET:
            raise Violation(
                "sensor_setup",
                "ICM-42688-P converts while INT1 is no output that rises (INT_CONFIG 0x03, INT_CONFIG1 0x00)",
                "Set up the interrupt first (sections 14.3 and 12.6)",
            )
        if not registers[_INTF_CONFIG0] & _BIG_ENDIAN:
            raise Violation("sensor_setup", "ICM-42688-P converts in little-endian numbers", "Set SENSOR_DATA_ENDIAN")
        self._conversions.start(time_s, _RATES_HZ[code])
        self._per_count = math.radians(1 / _COUNTS_PER_DEG_S[registers[_GYRO_CONFIG0] >> 5])

    # --- measuring

    def _convert(self, time_s: float) -> None:
        """Convert all axes, into the output registers."""
        registers = self._registers.values
        settled = min(1.0, (time_s - self._on_s) / _START_S)
        counts_per_g = _COUNTS_PER_G[registers[_ACCEL_CONFIG0] >> 5 & 3]
        rates = self._gyroscope.read(time_s, settled)
        force_m_s2 = self._accelerometer.read(time_s, settled)
        numbers = (
            (self._gyroscope.temperature_c(time_s) - _ROOM_C) * _COUNTS_PER_DEG_C,
            *(component / STANDARD_GRAVITY_M_S2 * counts_per_g for component in force_m_s2),
            *(rate_rad_s / self._per_count for rate_rad_s in rates),
        )
        counts = [saturate(round(number)) for number in numbers]
        if not registers[_INTF_CONFIG0] & _HOLD_LAST:  # section 14.34: the two lowest numbers would mean "invalid"
            counts = [max(-32766, count) for count in counts]
        self._output = struct.pack(">7h", *counts)
        self._status |= _DRDY
        self._pin = True
        self._pulse_end_s = time_s + _PULSE_S
