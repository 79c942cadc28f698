"""The LSM6DSV16X's gyroscope, accelerometer and thermometer at register level (data sheet DS13510, revision 4).

Not modelled: its FIFO, embedded functions, sensor hub, OIS and EIS chains, Qvar, I2C and I3C.
"""

import math
import struct
from collections.abc import Callable, Sequence

import numpy as np

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.chip.spi_device import Fault
from firmware_host.emulator.parts.accelerometer import STANDARD_GRAVITY_M_S2, Accelerometer, AccelerometerTruth
from firmware_host.emulator.parts.gyroscope import Gyroscope, GyroTruth, Temperature, saturate
from firmware_host.emulator.parts.part_registers import Conversions, OutputRegisters, PartRegisters
from firmware_host.emulator.parts.triad import CachedMotion
from firmware_host.parts import GYROSCOPES

WIRED = GYROSCOPES["lsm6dsv16x"]
WHO_AM_I = 0x70
_LSM6DSO = 0x6C  # the identity of an older part of the maker
_FUNC_CFG_ACCESS, _IF_CFG, _INT1_CTRL, _WHO_AM_I = 0x01, 0x03, 0x0D, 0x0F
_CTRL1, _CTRL2, _CTRL3, _CTRL4, _CTRL6, _CTRL8, _HAODR_CFG = 0x10, 0x11, 0x12, 0x13, 0x15, 0x17, 0x62
_STATUS_REG, _OUTX_L_G, _OUTZ_H_G, _OUTX_L_A = 0x1E, 0x22, 0x27, 0x28
_EIS_X_L = 0x2E  # of a chain that is off
# Values after reset (section 8) and the bits that have a model. Writing a one to any other bit fails the run: it would
# switch on a FIFO, filter, function or chain that is not simulated.
_RESET_AND_BITS = {
    _FUNC_CFG_ACCESS: (0x00, 0xC0),  # EMB_FUNC_REG_ACCESS, SHUB_REG_ACCESS: maps other registers here
    0x02: (0x23, 0x23),  # PIN_CTRL
    _IF_CFG: (0x00, 0x01),  # I2C_I3C_disable; pins push-pull, active high; four wires
    0x06: (0x00, 0x00),  # ODR_TRIG_CFG
    **dict.fromkeys(range(0x07, 0x0D), (0x00, 0x00)),  # FIFO_CTRL1 … 4, COUNTER_BDR_REG1 and 2
    _INT1_CTRL: (0x00, 0x02),  # INT1_DRDY_G
    0x0E: (0x00, 0x00),  # INT2_CTRL
    _CTRL1: (0x00, 0x1F),  # OP_MODE_XL up to high-accuracy ODR, ODR_XL
    _CTRL2: (0x00, 0x1F),  # OP_MODE_G, ODR_G
    _CTRL3: (0x44, 0x45),  # BDU, IF_INC, SW_RESET
    _CTRL4: (0x00, 0x02),  # DRDY_PULSED
    0x14: (0x00, 0x00),  # CTRL5
    _CTRL6: (0x00, 0x0F),  # FS_G; LPF1_G_BW acts on a filter that is off
    0x16: (0x00, 0x00),  # CTRL7: LPF1_G_EN, Qvar
    _CTRL8: (0x00, 0x03),  # FS_XL
    0x18: (0x00, 0x00),  # CTRL9: filters, user's offset
    0x19: (0x00, 0x00),  # CTRL10: self-test
    0x5E: (0x00, 0x00),  # MD1_CFG: embedded functions on INT1
    _HAODR_CFG: (0x00, 0x03),  # HAODR_SEL
    0x6B: (0x00, 0x00),  # CTRL_EIS
    **dict.fromkeys(range(0x73, 0x76), (0x00, 0x00)),  # X_OFS_USR …
}
_KEPT_BY_RESET = (0x02, _IF_CFG)  # sections 9.2 and 9.3
_BDU, _IF_INC, _SW_RESET, _DRDY_PULSED, _DRDY_G = 0x40, 0x04, 0x01, 0x02, 0x02
_XLDA, _GDA, _TDA = 0x01, 0x02, 0x04
_HIGH_ACCURACY = 0x10  # OP_MODE: high-accuracy ODR
_FASTEST_HZ = {0: 7680.0, 1: 8000.0, 2: 6400.0}  # table 20: at code 12, by HAODR_SEL; each lower code halves it
_SLOWEST_CODE, _FASTEST_CODE = 3, 12
_MDPS = {0: 4.375, 1: 8.75, 2: 17.5, 3: 35.0, 4: 70.0, 12: 140.0}  # table 3; 125, 250, 500, 1000, 2000, 4000 °/s
_MG = (0.061, 0.122, 0.244, 0.488)  # table 3; 2, 4, 8, 16 g
_COUNTS_PER_DEG_C, _ROOM_C = 256.0, 25.0  # table 6
_PULSE_S = 65e-6  # section 9.17
_RESET_S = 50e-6  # assumed, without a figure in the data sheet; the bit clears at its end
_START_S = 0.030  # table 4: turn-on time of the gyroscope


class Lsm6dsv16x:
    """The part on the SPI bus.

    `motion_at`, `truth`, `seed`, `temperature_c`: see `Gyroscope`; the motion is evaluated once for each conversion, at
    its instant, and noise is drawn per conversion. `acceleration`: see `Accelerometer`. `oscillator_ppm`: the error of
    the part's own oscillator, and so of its data rate; within a percent in the high-accuracy mode (table 3).

    The part converts while both sensors are in that mode at one data rate; other modes fail the run. A read of a high
    byte of a sensor's outputs clears its flag. The interrupt line follows the flag unless it is pulsed. The motion
    ramps up linearly while the gyroscope starts.
    """

    name = "LSM6DSV16X"
    spi_modes = (0, 3)
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
        self._pulse_end_s = math.inf
        motion = CachedMotion(motion_at)
        self._gyroscope = Gyroscope(motion, truth, seed, temperature_c)
        self._accelerometer = Accelerometer(motion, acceleration, seed, temperature_c)
        self._registers = PartRegisters(self.name, "lsm6dsv16x.py", _RESET_AND_BITS)
        self._conversions = Conversions(oscillator_ppm)
        self._address: int | None = None  # None: the next byte is the address
        self._reading = False
        self._reset_end_s = -math.inf
        self._reset()

    # --- the board's side

    @property
    def next_event_s(self) -> float:
        return min(self._conversions.next_s, self._pulse_end_s)

    @property
    def interrupt_level(self) -> bool:
        if not self._registers.values[_INT1_CTRL] & _DRDY_G:
            return False
        if self._registers.values[_CTRL4] & _DRDY_PULSED:
            return self._pulse_end_s < math.inf
        return bool(self._status & _GDA)

    def advance(self, time_s: float) -> None:
        while self.next_event_s <= time_s:
            if self._pulse_end_s <= self._conversions.next_s:
                self._pulse_end_s = math.inf
            else:
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
        if self._registers.values[_CTRL3] & _IF_INC:
            self._address = address + 1 & 0x7F
        if self._reading:
            return self._read(address, time_s)
        self._write(address, byte, time_s)
        return 0xFF

    def predict(self) -> bytes:
        """Return no predicted answers: a read clears flags, and a conversion may occur between two reads."""
        return b""

    # --- registers

    def _reset(self) -> None:
        kept = {address: self._registers.values[address] for address in _KEPT_BY_RESET}
        self._registers.reset()
        self._registers.values.update(kept)
        self._status = 0
        self._pulse_end_s = self._on_s = math.inf
        self._rates, self._forces = OutputRegisters(), OutputRegisters()
        self._temperature = bytes(2)
        self._conversions.stop()

    def _read(self, address: int, time_s: float) -> int:
        registers = self._registers.values
        if registers[_FUNC_CFG_ACCESS] and address != _FUNC_CFG_ACCESS:
            raise self._registers.describe_unmodelled("read, with FUNC_CFG_ACCESS set, of", address)
        if address in registers:
            resetting = address == _CTRL3 and time_s < self._reset_end_s
            return registers[address] | _SW_RESET * resetting
        if address == _WHO_AM_I:
            return _LSM6DSO if self.fault is Fault.OTHER_PART else WHO_AM_I
        if not _STATUS_REG <= address <= _EIS_X_L:
            raise self._registers.describe_unmodelled("read of", address)
        return self._read_output(address)

    def _read_output(self, address: int) -> int:
        """Read the status, temperature or an output. The other addresses up to EIS_X_L read 0."""
        if address < _OUTX_L_G:
            return int((self._status, 0, *self._temperature)[address - _STATUS_REG])
        if address == _EIS_X_L:
            return 0
        outputs, first, flag = (
            (self._rates, _OUTX_L_G, _GDA) if address <= _OUTZ_H_G else (self._forces, _OUTX_L_A, _XLDA)
        )
        if (address - first) % 2:
            self._status &= ~flag
        block_update = bool(self._registers.values[_CTRL3] & _BDU)
        return outputs.read(address - first, block_update=block_update)

    def _write(self, address: int, value: int, time_s: float) -> None:
        """Write a register and apply its effects. Raise Violation for a write that the data sheet forbids."""
        registers = self._registers.values
        if registers[_FUNC_CFG_ACCESS] and address != _FUNC_CFG_ACCESS:
            raise self._registers.describe_unmodelled("write, with FUNC_CFG_ACCESS set, to", address)
        self._registers.check(address, value)
        if time_s < self._reset_end_s:
            raise Violation(
                "sensor_setup",
                f"LSM6DSV16X register 0x{address:02X} written while its reset is under way",
                "Wait until SW_RESET reads 0",
            )
        if address == _CTRL3 and value & _SW_RESET:
            self._reset()
            self._reset_end_s = time_s + _RESET_S
            return
        old_value, registers[address] = registers[address], value
        if value == old_value:
            return
        if address in (_CTRL1, _CTRL2) and old_value and (old_value ^ value) & _HIGH_ACCURACY:
            raise Violation(
                "sensor_setup",
                f"LSM6DSV16X register 0x{address:02X} changes to or from the high-accuracy mode while it runs",
                "Power it down in between (section 6.5)",
            )
        if address == _HAODR_CFG and (registers[_CTRL1] or registers[_CTRL2]):
            raise Violation("sensor_setup", "LSM6DSV16X HAODR_CFG written while it runs", "Power it down first")
        if address in (_CTRL1, _CTRL2, _CTRL6, _CTRL8):
            self._start(time_s)

    def _start(self, time_s: float) -> None:
        """Restart conversions, if the part is set up to convert. Raise Violation for unsupported settings."""
        registers = self._registers.values
        self._conversions.stop()
        if not registers[_CTRL1] or not registers[_CTRL2]:
            self._on_s = math.inf
            return
        code = registers[_CTRL2] & 0x0F
        if registers[_CTRL1] != registers[_CTRL2] or not registers[_CTRL2] & _HIGH_ACCURACY:
            raise Violation(
                "sensor_setup",
                f"LSM6DSV16X runs with CTRL1 = 0x{registers[_CTRL1]:02X} and CTRL2 = 0x{registers[_CTRL2]:02X}",
                "Set both to the high-accuracy mode at one data rate (section 6.5)",
            )
        if not _SLOWEST_CODE <= code <= _FASTEST_CODE or registers[_CTRL6] & 0x0F not in _MDPS:
            raise Violation("sensor_setup", "LSM6DSV16X runs with a reserved rate or range", "See tables 20 and 63")
        if self._on_s == math.inf:
            self._on_s = time_s
        rate_hz = _FASTEST_HZ[registers[_HAODR_CFG]] / 2 ** (_FASTEST_CODE - code)
        self._conversions.start(time_s, rate_hz)
        self._per_count = math.radians(1e-3 * _MDPS[registers[_CTRL6] & 0x0F])
        self._g_per_count = 1e-3 * _MG[registers[_CTRL8] & 3]

    # --- measuring

    def _convert(self, time_s: float) -> None:
        """Convert all axes, into the output registers."""
        settled = min(1.0, (time_s - self._on_s) / _START_S)
        self._rates.show(self._gyroscope.read(time_s, settled), self._per_count)
        force_m_s2 = self._accelerometer.read(time_s, settled)
        self._forces.show([component / STANDARD_GRAVITY_M_S2 for component in force_m_s2], self._g_per_count)
        temperature = (self._gyroscope.temperature_c(time_s) - _ROOM_C) * _COUNTS_PER_DEG_C
        self._temperature = struct.pack("<h", saturate(round(temperature)))
        self._status |= _XLDA | _GDA | _TDA
        if self._registers.values[_CTRL4] & _DRDY_PULSED:
            self._pulse_end_s = time_s + _PULSE_S
