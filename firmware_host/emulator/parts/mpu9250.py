"""The MPU-9250's gyroscope, accelerometer and thermometer at register level.

Product specification PS-MPU-9250A-01, register map RM-MPU-9250A-00. Not modelled: its magnetometer, FIFO, I2C master
and motion processor.
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

WIRED = GYROSCOPES["mpu9250"]
WHO_AM_I = 0x71
_MPU6500 = 0x70  # the identity of the part without magnetometer
_SMPLRT_DIV, _CONFIG, _GYRO_CONFIG, _ACCEL_CONFIG = 0x19, 0x1A, 0x1B, 0x1C
_INT_PIN_CFG, _INT_ENABLE, _INT_STATUS = 0x37, 0x38, 0x3A
_ACCEL_XOUT_H, _GYRO_ZOUT_L = 0x3B, 0x48
_PWR_MGMT_1, _WHO_AM_I = 0x6B, 0x75
# Values after reset (register map, section 3) and the bits that have a model. Writing one to any other bit fails the
# run: it would switch on a self-test, FIFO, filter or bus that is not simulated.
_RESET_AND_BITS = {
    **dict.fromkeys(range(0x13, 0x19), (0x00, 0x00)),  # gyroscope offsets, which would shift the bias
    _SMPLRT_DIV: (0x00, 0xFF),
    _CONFIG: (0x00, 0x07),  # DLPF_CFG
    _GYRO_CONFIG: (0x00, 0x1B),  # GYRO_FS_SEL, FCHOICE_B
    _ACCEL_CONFIG: (0x00, 0x18),  # ACCEL_FS_SEL
    0x1D: (0x00, 0x07),  # ACCEL_CONFIG2: A_DLPFCFG
    0x1E: (0x00, 0x00),  # LP_ACCEL_ODR
    0x1F: (0x00, 0x00),  # WOM_THR
    0x23: (0x00, 0x00),  # FIFO_EN
    0x24: (0x00, 0x00),  # I2C_MST_CTRL
    _INT_PIN_CFG: (0x00, 0x30),  # LATCH_INT_EN, INT_ANYRD_2CLEAR; active high, push-pull
    _INT_ENABLE: (0x00, 0x01),  # RAW_RDY_EN
    0x67: (0x00, 0x00),  # I2C_MST_DELAY_CTRL
    0x69: (0x00, 0x00),  # MOT_DETECT_CTRL
    0x6A: (0x00, 0x10),  # USER_CTRL: I2C_IF_DIS
    _PWR_MGMT_1: (0x01, 0xC1),  # H_RESET, SLEEP, CLKSEL 0 and 1
    0x6C: (0x00, 0x00),  # PWR_MGMT_2: all axes on
}
_H_RESET, _SLEEP = 0x80, 0x40
_LATCH_INT_EN, _INT_ANYRD_2CLEAR, _RAW_RDY = 0x20, 0x10, 0x01
_COUNTS_PER_DEG_S = (131.0, 65.5, 32.8, 16.4)  # specification, table 1; 250, 500, 1000, 2000 °/s
_COUNTS_PER_G = (16384, 8192, 4096, 2048)  # specification, table 2
_COUNTS_PER_DEG_C, _ROOM_C = 333.87, 21.0  # specification, table 3, and register map, section 4.23
_OUTPUTS = struct.Struct(">7h")  # the three accelerations, the temperature, the three rates
_PULSE_S = 50e-6  # of the interrupt line when it is not latched (register map, register 55)
_RESET_S = 0.1  # specification, table 3: registers can be read and written after 11 ms, at most 100 ms
_START_S = 0.035  # specification, table 1: start-up of the gyroscope after sleep


class Mpu9250:
    """The die with accelerometer and gyroscope on the SPI bus.

    `motion_at`, `truth`, `seed`, `temperature_c`: see `Gyroscope`; the motion is evaluated once for each conversion, at
    its instant, and noise is drawn per conversion. `acceleration`: see `Accelerometer`. `oscillator_ppm`: the error of
    the part's own oscillator, and so of its data rate; the specification allows a percent.

    The part runs from power-up, but here it converts only while its data-ready interrupt is enabled; reading data
    without it fails the run. Its filter settings have neither effect nor delay (a filter is part of the truth), except
    that the motion ramps up linearly while the gyroscope starts. The accelerometer's offset registers hold the
    factory's trim: writing to them fails the run.
    """

    name = "MPU-9250"
    spi_modes = (0, 3)

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
        """Power the die.

        `motion_at` returns rate, rad/s, and specific force, g, at a virtual time, s.
        """
        self.chip_select = chip_select
        self.interrupt = interrupt
        self.fault: Fault | None = None
        motion = CachedMotion(motion_at)
        self._gyroscope = Gyroscope(motion, truth, seed, temperature_c)
        self._accelerometer = Accelerometer(motion, acceleration, seed, temperature_c)
        self._registers = PartRegisters(self.name, "mpu9250.py", _RESET_AND_BITS)
        self._conversions = Conversions(oscillator_ppm)
        self._address: int | None = None  # None: the next byte is the address
        self._reading = False
        self._pin = False
        self._latest = self._output = b""
        self._pulse_end_s = math.inf
        self._reset()
        self._awake_s = -math.inf
        self._usable_s = -math.inf

    # --- the board's side

    @property
    def spi_max_hz(self) -> float:
        """The clock limit: 20 MHz for sensor and interrupt data, otherwise 1 MHz (specification, section 7.5)."""
        data = self._reading and self._first >= _INT_STATUS and self._first <= _GYRO_ZOUT_L
        return 20e6 if data else 1e6

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
        self._output = self._latest  # the registers are frozen while the bus is in use (register map, section 4.22)

    def deselect(self, time_s: float) -> None:
        self._address = None

    def transfer(self, byte: int, time_s: float) -> int:
        if self._address is None:
            self._reading = bool(byte & 0x80)
            self._address = self._first = byte & 0x7F
            return 0xFF
        address = self._address
        self._address = address + 1 & 0x7F
        if time_s < self._usable_s:
            raise Violation(
                "sensor_setup",
                f"MPU-9250 register 0x{address:02X} accessed {1e3 * (time_s - self._usable_s + _RESET_S):.1f} ms after "
                f"its reset",
                f"Wait {1e3 * _RESET_S:g} ms",
            )
        if self._reading:
            return self._read(address)
        self._write(address, byte, time_s)
        return 0xFF

    def predict(self) -> bytes:
        """Return the data, frozen while the bus is in use, unless an access clears the status."""
        address = self._address
        if address is None or not self._reading or not _ACCEL_XOUT_H <= address <= _GYRO_ZOUT_L:
            return b""
        registers = self._registers.values
        if registers[_INT_PIN_CFG] & _INT_ANYRD_2CLEAR or not registers[_INT_ENABLE] & _RAW_RDY:
            return b""
        predicted = self._output[address - _ACCEL_XOUT_H :]
        predicted = predicted[: len(predicted) & ~1]
        self._address = address + len(predicted)
        return predicted

    # --- registers

    def _reset(self) -> None:
        self._registers.reset()
        self._status = 0
        self._pin = False
        self._pulse_end_s = math.inf
        self._first = 0  # first register of the pending access
        self._latest = self._output = bytes(14)  # ACCEL_XOUT_H … GYRO_ZOUT_L
        self._conversions.stop()

    def _read(self, address: int) -> int:
        status = self._status
        if address == _INT_STATUS or self._registers.values[_INT_PIN_CFG] & _INT_ANYRD_2CLEAR:
            self._status = 0
            if self._registers.values[_INT_PIN_CFG] & _LATCH_INT_EN:
                self._pin = False
        if address in self._registers.values:
            return self._registers.values[address]
        if address == _WHO_AM_I:
            return _MPU6500 if self.fault is Fault.OTHER_PART else WHO_AM_I
        if not _INT_STATUS <= address <= _GYRO_ZOUT_L:
            raise self._registers.describe_unmodelled("read of", address)
        if not self._registers.values[_INT_ENABLE] & _RAW_RDY:
            raise Violation(
                "sensor_setup",
                f"MPU-9250 register 0x{address:02X} read while RAW_RDY_EN is clear: it converts only while that is set",
                "Set INT_ENABLE first, or model conversions without interrupts in mpu9250.py",
            )
        return status if address == _INT_STATUS else self._output[address - _ACCEL_XOUT_H]

    def _write(self, address: int, value: int, time_s: float) -> None:
        self._registers.check(address, value)
        if address == _PWR_MGMT_1 and value & _H_RESET:
            self._reset()
            self._usable_s = time_s + _RESET_S
            self._awake_s = time_s
            return
        old_value, self._registers.values[address] = self._registers.values[address], value
        if value == old_value:
            return
        if address == _PWR_MGMT_1 and old_value & _SLEEP and not value & _SLEEP:
            self._awake_s = time_s
        if address in (_SMPLRT_DIV, _CONFIG, _GYRO_CONFIG, _INT_ENABLE, _PWR_MGMT_1):
            self._start(time_s)

    def _start(self, time_s: float) -> None:
        """Restart conversions, if the part is set up to convert."""
        registers = self._registers.values
        if registers[_PWR_MGMT_1] & _SLEEP or not registers[_INT_ENABLE] & _RAW_RDY:
            self._conversions.stop()
            return
        self._conversions.start(time_s, self._rate_hz())
        self._per_count = math.radians(1 / _COUNTS_PER_DEG_S[registers[_GYRO_CONFIG] >> 3 & 3])

    def _rate_hz(self) -> float:
        """Return the data rate (register map, registers 25 to 27): the divider acts on filters 1 to 6 only."""
        registers = self._registers.values
        if registers[_GYRO_CONFIG] & 0x03:  # FCHOICE_B: around the filters
            return 32_000.0
        if registers[_CONFIG] in (0, 7):
            return 8_000.0
        return 1_000.0 / (1 + registers[_SMPLRT_DIV])

    # --- measuring

    def _convert(self, time_s: float) -> None:
        """Convert all axes, into the output registers of the next access."""
        settled = min(1.0, (time_s - self._awake_s) / _START_S)
        counts_per_g = _COUNTS_PER_G[self._registers.values[_ACCEL_CONFIG] >> 3 & 3]
        rates = self._gyroscope.read(time_s, settled)
        force_m_s2 = self._accelerometer.read(time_s, settled)
        numbers = (
            *(component / STANDARD_GRAVITY_M_S2 * counts_per_g for component in force_m_s2),
            (self._gyroscope.temperature_c(time_s) - _ROOM_C) * _COUNTS_PER_DEG_C,
            *(rate_rad_s / self._per_count for rate_rad_s in rates),
        )
        self._latest = _OUTPUTS.pack(*[saturate(round(number)) for number in numbers])
        self._status = _RAW_RDY
        self._pin = True
        if not self._registers.values[_INT_PIN_CFG] & _LATCH_INT_EN:
            self._pulse_end_s = time_s + _PULSE_S
