"""The ADIS16465's gyroscope, accelerometer and thermometer at register level (Analog Devices data sheet ADIS16465).

Details missing there come from the maker's driver (no-OS, drivers/imu/adis1646x.c: update times, defaults) and from
Linux (drivers/iio/imu/adis16475.c: 32-bit format, burst, checksum).
"""

import math
import struct
from collections.abc import Callable, Sequence

import numpy as np

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.chip.spi_device import Fault
from firmware_host.emulator.parts.accelerometer import STANDARD_GRAVITY_M_S2, Accelerometer, AccelerometerTruth
from firmware_host.emulator.parts.gyroscope import Gyroscope, GyroTruth, Temperature, saturate
from firmware_host.emulator.parts.part_registers import PartRegisters
from firmware_host.emulator.parts.triad import CachedMotion
from firmware_host.parts import GYROSCOPES

WIRED = GYROSCOPES["adis16465"]
PROD_ID = 0x4051
_ADIS16470 = 0x4056
_DIAG_STAT, _X_GYRO_LOW, _TEMP_OUT, _DATA_CNTR = 0x02, 0x04, 0x1C, 0x22
_FILT_CTRL, _RANG_MDL, _MSC_CTRL, _DEC_RATE, _GLOB_CMD, _PROD_ID = 0x5C, 0x5E, 0x60, 0x64, 0x68, 0x72
# Registers that can be written, with their values after reset and the bits that have a model. Writing a one to any
# other bit that is zero after reset fails the run: it would switch on a correction or clock that is not simulated.
_RESET_AND_BITS = {
    **dict.fromkeys(range(0x40, 0x4C, 2), (0x0000, 0xFFFF)),  # the user's bias of the rates, 32 bits an axis
    **dict.fromkeys(range(0x4C, 0x58, 2), (0x0000, 0x0000)),  # the same of the accelerations
    _FILT_CTRL: (0x0000, 0x0007),
    _MSC_CTRL: (0x00C1, 0x00C1),  # data-ready polarity, alignment and acceleration compensation; no sync
    0x62: (0x07D0, 0x07D0),  # UP_SCALE
    _DEC_RATE: (0x0000, 0x07FF),
    0x66: (0x070A, 0x070A),  # NULL_CNFG
}
# The delay after which a setting acts and reads back (no-OS, adis1646x_timeouts)
_UPDATE_S = {_FILT_CTRL: 30e-6, _DEC_RATE: 30e-6, _MSC_CTRL: 200e-6}
_DR_ACTIVE_HIGH = 0x0001
_XG_BIAS_LOW = 0x40
_OVERRUN, _SPI_ERROR = 1 << 1, 1 << 3  # DIAG_STAT
_SOFTWARE_RESET = 0x80
_MAX_FILTER, _MAX_DEC_RATE = 6, 1999
_RANGES = {125: (0x0003, 160), 500: (0x0007, 40), 2000: (0x000F, 10)}  # °/s: RANG_MDL, LSB per °/s
_M_S2_PER_COUNT = STANDARD_GRAVITY_M_S2 / 4000 / 65536  # of the 32-bit number
_OUTPUTS = 6  # x, y, z of the rates, then of the accelerations: two words each, the lower first
_RATE_HZ = 2000
_STALL_S = 16e-6  # data sheet, table 2, tSTALL
_RESET_S = 0.255  # no-OS: after a software reset
_UPDATING_S = (
    20e-6  # inactive time of the data-ready line during an update; assumed, without a figure in the data sheet
)
_BURST_WORDS = 10


_WORDS = struct.Struct(">9H")  # of a burst, without the checksum


class Adis16465:
    """The module on the SPI bus, in the variant of the range `range_deg_s`: 125 (-1), 500 (-2) or 2000 (-3).

    - `motion_at`, `truth`, `seed`, `temperature_c`: see `Gyroscope`. The motion is evaluated once for each update of
      the output registers, at its instant, and noise is drawn per update.
    - `acceleration`: see `Accelerometer`.
    - `oscillator_ppm`: the error of its sample clock.
    - `ready_s`: the end of its start-up (the maker's driver allows 310 ms from power-up), until which it is silent.

    The part samples from power-up on and cannot be stopped. With averaging (DEC_RATE, FILT_CTRL) its outputs have 32
    bits, and the upper 16 alone, in a burst, are rounded down. Averages and filters themselves are not simulated:
    `truth` states the noise of an output. Its bias registers hold their values until its next software reset,
    independent of the board; `overrun` sets the flag of an overrun data path until that reset.
    """

    name = "ADIS16465"
    spi_modes = (3,)

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
        range_deg_s: int = 500,
        ready_s: float = 0.0,
    ) -> None:
        """Power the module, which is silent until `ready_s`.

        `motion_at` returns rate, rad/s, and specific force, g, at a virtual time, s.
        """
        self.chip_select = chip_select
        self.interrupt = interrupt
        self.fault: Fault | None = None
        self._range_model, counts_per_deg_s = _RANGES[range_deg_s]
        self._per_count = math.radians(1 / counts_per_deg_s) / 65536  # of the 32-bit number
        motion = CachedMotion(motion_at)
        self._gyroscope = Gyroscope(motion, truth, seed, temperature_c)
        self._accelerometer = Accelerometer(motion, acceleration, seed, temperature_c)
        self._speed = 1 + oscillator_ppm * 1e-6
        self._registers = PartRegisters(self.name, "adis16465.py", _RESET_AND_BITS, digits=4)
        self._show_temperature(ready_s)
        self._command: int | None = None  # first byte of the pending frame
        self._burst: bytes | None = None  # rest to be clocked out
        self._answer = 0  # to the previous frame
        self._ended_s = -math.inf  # time of the last rise of chip select
        self._frames = 0  # since chip select fell
        self._diagnosis = 0
        self._counter = 0
        self._data_valid = False
        self._next_update_s = self._next_change_s = math.inf
        self._reset(ready_s)

    # --- the board's side

    @property
    def spi_max_hz(self) -> float:
        """The clock limit: 1 MHz in a burst, otherwise 2 MHz (data sheet, table 2)."""
        return 1e6 if self._burst is not None or self._command == _GLOB_CMD else 2e6

    @property
    def next_event_s(self) -> float:
        return self._next_change_s

    @property
    def interrupt_level(self) -> bool:
        active_high = bool(self._registers.values[_MSC_CTRL] & _DR_ACTIVE_HIGH)
        return self._data_valid == active_high

    def advance(self, time_s: float) -> None:
        while self._next_change_s <= time_s:
            now_s = self._next_change_s
            self._settle_settings(now_s)
            if self._data_valid:
                self._data_valid = False
                self._next_change_s = self._next_update_s
            else:
                self._update(now_s)

    def select(self, time_s: float) -> None:
        self._frames = 0
        self._command = self._burst = None

    def deselect(self, time_s: float) -> None:
        if self._command is not None:  # in the middle of a frame (data sheet, table of DIAG_STAT's bits)
            self._diagnosis |= _SPI_ERROR
        self._command = self._burst = None
        self._ended_s = time_s

    def transfer(self, byte: int, time_s: float) -> int:
        if time_s < self._usable_s:
            return 0xFF
        if self._burst is not None:
            return self._continue_burst()
        if self._command is None:
            self._check_pause(time_s)
            self._command = byte
            return self._answer >> 8
        answer, self._answer = self._answer & 0xFF, 0
        address, self._command = self._command, None
        self._frames += 1
        self._settle_settings(time_s)
        if address & 0x80:
            self._write(address & 0x7F, byte, time_s)
        elif address == _GLOB_CMD:
            self._burst = self._burst_data()
        else:
            self._answer = self._read(address & ~1)
        return answer

    def predict(self) -> bytes:
        """Return the complete burst, whose data were frozen at its start."""
        predicted, self._burst = self._burst or b"", self._burst and b""
        return predicted

    # --- frames

    def _check_pause(self, time_s: float) -> None:
        if self._frames or time_s - self._ended_s < _STALL_S:
            pause = "no pause" if self._frames else f"{1e6 * (time_s - self._ended_s):.1f} µs"
            raise Violation(
                "spi_stall",
                f"the ADIS16465 gets its next 16-bit frame {pause} after the last",
                f"Raise chip select for {1e6 * _STALL_S:g} µs between frames",
            )

    def _burst_data(self) -> bytes:
        words = [self._take_diagnosis(), *(self._read_output(output) >> 16 for output in range(_OUTPUTS))]
        data = _WORDS.pack(*[word & 0xFFFF for word in (*words, self._temperature, self._counter)])
        return data + (sum(data) & 0xFFFF).to_bytes(2, "big")

    def _continue_burst(self) -> int:
        if not self._burst:
            raise Violation(
                "spi_frame",
                f"the ADIS16465 is asked for more than the {_BURST_WORDS} words of a burst",
                "Raise chip select after 22 bytes",
            )
        answer, self._burst = self._burst[0], self._burst[1:]
        return answer

    # --- registers

    def _reset(self, time_s: float) -> None:
        self._registers.reset()
        self._waiting: dict[int, tuple[float, int]] = {}  # address → when a setting acts, its value
        self._diagnosis = self._counter = 0
        self.overrun = False
        self._counts = [0] * _OUTPUTS  # rates, then accelerations; 32 bits each
        self._answer = 0
        self._data_valid = False
        self._usable_s = time_s
        self._samples = 1  # of the internal 2000 Hz until the next update
        self._next_update_s = time_s + self._sample_time(1)
        self._next_change_s = self._next_update_s

    def _read(self, address: int) -> int:
        if address in self._registers.values:
            return self._registers.values[address]
        if address == _DIAG_STAT:
            return self._take_diagnosis()
        if _X_GYRO_LOW <= address < _TEMP_OUT:
            output, high = divmod(address - _X_GYRO_LOW, 4)
            return self._read_output(output) >> (16 if high else 0) & 0xFFFF
        fixed = {
            0x00: 0,  # reserved: drivers read it to clock an answer out
            _TEMP_OUT: self._temperature,
            _DATA_CNTR: self._counter,
            _RANG_MDL: self._range_model,
            _PROD_ID: _ADIS16470 if self.fault is Fault.OTHER_PART else PROD_ID,
        }
        if address not in fixed:
            raise self._registers.describe_unmodelled("read of", address)
        return fixed[address]

    def _take_diagnosis(self) -> int:
        """Return the diagnosis and clear its flags, except that of a persistent overrun."""
        diagnosis, self._diagnosis = self._diagnosis, 0
        return diagnosis | (_OVERRUN if self.overrun else 0)

    def _write(self, address: int, byte: int, time_s: float) -> None:
        """Write one byte of a register; an odd address is its upper byte."""
        register, shift = address & ~1, 8 * (address & 1)
        if register == _GLOB_CMD:
            self._command_part(byte << shift, time_s)
            return
        if register not in self._registers.values:
            raise self._registers.describe_unmodelled("write to", address)
        _when, waiting_value = self._waiting.get(register, (0.0, self._registers.values[register]))
        value = waiting_value & ~(0xFF << shift) | byte << shift
        self._registers.check(register, value)
        self._waiting[register] = time_s + _UPDATE_S.get(register, 0.0), value

    def _command_part(self, value: int, time_s: float) -> None:
        if value & ~_SOFTWARE_RESET:
            raise Violation(
                "unmodelled_bits",
                f"ADIS16465 GLOB_CMD = 0x{value:04X}: only the software reset is modelled",
                "Model it",
            )
        if value:
            self._reset(time_s + _RESET_S)

    def _settle_settings(self, time_s: float) -> None:
        """Apply the settings that are due."""
        if not self._waiting:
            return
        for register, (when_s, value) in list(self._waiting.items()):
            if when_s <= time_s:
                del self._waiting[register]
                self._registers.values[register] = value
                self._check_setting(register, value)

    def _check_setting(self, register: int, value: int) -> None:
        limit = {_FILT_CTRL: _MAX_FILTER, _DEC_RATE: _MAX_DEC_RATE}.get(register, value)
        if value > limit:
            raise Violation(
                "sensor_setup", f"ADIS16465 register 0x{register:02X} = {value}: the most is {limit}", "Use less"
            )

    # --- measuring

    def _sample_time(self, samples: int) -> float:
        return samples / (_RATE_HZ * self._speed)

    def _update(self, time_s: float) -> None:
        """Set new outputs. The data-ready line signals new outputs and is inactive shortly before."""
        self._show_temperature(time_s)
        rates = self._gyroscope.read(time_s)
        self._counts = [
            saturate(round(rate / self._per_count) + self._user_bias(axis), bits=32) for axis, rate in enumerate(rates)
        ]
        force_m_s2 = self._accelerometer.read(time_s)
        self._counts += [saturate(round(component / _M_S2_PER_COUNT), bits=32) for component in force_m_s2]
        self._counter = self._counter + 1 & 0xFFFF
        self._data_valid = True
        self._samples += 1 + self._registers.values[_DEC_RATE]
        self._next_update_s = self._usable_s + self._sample_time(self._samples)
        self._next_change_s = self._next_update_s - _UPDATING_S

    def _user_bias(self, axis: int) -> int:
        """Return the user's bias of an axis in counts of the 32-bit rate (Linux, adis16475.c: calibbias)."""
        low, high = (self._registers.values[_XG_BIAS_LOW + 4 * axis + half] for half in (0, 2))
        return (high << 16 | low) - (1 << 32 if high >> 15 else 0)

    def _show_temperature(self, time_s: float) -> None:
        self._temperature = saturate(round(self._gyroscope.temperature_c(time_s) * 10)) & 0xFFFF

    def _read_output(self, output: int) -> int:
        """Return a 32-bit output. Without averaging or filter, the lower 16 bits are 0."""
        if self._registers.values[_DEC_RATE] or self._registers.values[_FILT_CTRL]:
            return self._counts[output]
        return saturate(self._counts[output] + 0x8000 >> 16) << 16
