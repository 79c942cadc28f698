"""The simulated device: it samples by its own oscillator and sends lines of formatted numbers.

It formats as C's and Python's `%.3f` do, one number after another, independently of the rig's parser.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from math import fmod, radians
from operator import xor

import numpy as np

from firmware_host.emulator.parts.accelerometer import STANDARD_GRAVITY_M_S2, Accelerometer
from firmware_host.emulator.parts.gyroscope import Gyroscope
from firmware_host.emulator.parts.magnetometer import GAUSS_T, Magnetometer, MagnetometerTruth
from rig.config.sensors.lines_section import LineAccelerationSection, LineFieldSection, LineRateSection, LinesSection
from rig.config.world.faulty import SimulatedFaultySection
from rig.config.world.printing_device import SimulatedLinesSection
from rig.world.board.sensor_truth import SensorTruth
from rig.world.faulty_gyroscope import FrozenGyroscope, Repeats

SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}
# Values of the units in rad/s, m/s² and T; and the units of time per second.
UNITS = {
    "rad/s": 1.0, "mrad/s": 1e-3, "deg/s": radians(1.0), "mdeg/s": radians(1e-3),
    "g": STANDARD_GRAVITY_M_S2, "mg": 1e-3 * STANDARD_GRAVITY_M_S2, "m/s2": 1.0,
    "gauss": GAUSS_T, "mgauss": 1e-3 * GAUSS_T, "uT": 1e-6, "nT": 1e-9, "T": 1.0,
}  # fmt: skip
TICKS_PER_S = {"ns": 1e9, "us": 1e6, "ms": 1e3, "s": 1.0}
DEFAULT_DECIMALS = 5
COLOURED_LINE = "\033[0;32m{}\033[0m"  # green, as in ESP-IDF's log at level I
LINE_END = b"\r\n"
NO_FAULTS = SimulatedFaultySection()


@dataclass(slots=True)
class PrinterFaults:
    """Faults that a test can set: the number of samples to `lose`, and whether the device is `stuck` at one line."""

    lose: int = 0
    stuck: bool = False


class Printer:
    """A device that sends lines of text, switched on at the virtual time `time_s`, when its clock reads `uptime_s`.

    - `motion_at`: its motion over time, rate in rad/s and specific force in g.
    - `field_at`: flux density in its axes over time, T; `magnetometer`: the errors of its reading.
    """

    def __init__(
        self,
        truth: SensorTruth,
        motion_at: Callable[[float], Sequence[float]],
        section: SimulatedLinesSection,
        prints: LinesSection,
        *,
        field_at: Callable[[float], Sequence[float]],
        magnetometer: MagnetometerTruth,
        rate_hz: float,
        baud_rate: float,
        seed: np.random.SeedSequence,
        time_s: float,
        faulty: SimulatedFaultySection = NO_FAULTS,
    ) -> None:
        """Switch the device on: it sends its boot text, then lines with the columns of `prints`."""
        self.faults = PrinterFaults()
        self.baud_rate = baud_rate
        self._section, self._prints, self._motion_at = section, prints, motion_at
        self._speed = 1.0 + 1e-6 * section.oscillator_ppm
        self._counted_from_s = time_s - section.uptime_s / self._speed
        self._step_s = 1.0 / rate_hz / self._speed
        self._began_s, self._samples, self._format_value = time_s, 0, 0
        gyroscope = Gyroscope(motion_at, truth.gyro, seed, truth.temperature_c)
        self._gyroscope, self._repeats = FrozenGyroscope(gyroscope, faulty), Repeats(faulty, seed)
        self._accelerometer: Accelerometer | None = None
        if truth.accelerometer is not None:
            self._accelerometer = Accelerometer(motion_at, truth.accelerometer, seed, truth.temperature_c)
        other = np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, 1))
        self._magnetometer = Magnetometer(field_at, magnetometer, other)
        self._lost = np.random.default_rng(other.spawn(1)[0])
        self._sent = bytearray(b"".join(line.encode() + LINE_END for line in section.boot_text))
        self._line = b""

    def misbehave(self, *, lose: int = 0, stuck: bool | None = None) -> None:
        """Set the given faults; `lose` is added to the number of samples still to be lost."""
        self.faults.lose += int(lose)
        self.faults.stuck = self.faults.stuck if stuck is None else bool(stuck)

    def take_sent(self) -> bytes:
        """Return the bytes sent since the last call."""
        data = bytes(self._sent)
        self._sent.clear()
        return data

    def receive(self, data: bytes) -> None:
        """Ignore bytes sent to the device, because it reads nothing."""

    def advance(self, time_s: float) -> None:
        """Simulate until the virtual time `time_s`, which lies in the laboratory's last tick."""
        while (at_s := self._began_s + (self._samples + 1) * self._step_s) <= time_s:
            self._samples += 1
            line = self._format_sample(at_s)
            if self.faults.lose > 0:
                self.faults.lose -= 1
            elif not (self._section.lost_fraction and self._lost.random() < self._section.lost_fraction):
                self._line = self._line if self.faults.stuck else line
                self._sent += self._line
                self._format_value += 1
                if self._section.comment_every and self._format_value % self._section.comment_every == 0:
                    self._sent += f"{self._prints.comment} still here".encode() + LINE_END

    def _format_sample(self, at_s: float) -> bytes:
        """Return the line of text of the sample at `at_s`."""
        prints = self._prints
        rates = self._repeats.next_rates(self._gyroscope.read(at_s))
        values = {axis: _format_value(rate, prints.rate) for axis, rate in zip(("gx", "gy", "gz"), rates, strict=True)}
        if self._accelerometer is not None:
            forces = self._accelerometer.read(at_s)
            for axis, force in zip(("ax", "ay", "az"), forces, strict=True):
                values[axis] = _format_value(force, prints.acceleration)
        if prints.field is not None:
            for axis, flux_density in zip(("mx", "my", "mz"), self._magnetometer.read(at_s), strict=True):
                values[axis] = _format_value(flux_density, prints.field)
        temperature = prints.temperature
        celsius = self._gyroscope.temperature_c(at_s)
        decimals = 2 if temperature.decimals is None else temperature.decimals
        degrees = f"{(celsius - temperature.offset_c) / temperature.scale:.{decimals}f}"
        values["temperature"] = degrees if self._section.temperature_text is None else self._section.temperature_text
        values["time"] = self._time(at_s)
        sequence = self._samples % prints.sequence_wrap if prints.sequence_wrap else self._samples
        values["sequence"] = str(sequence)
        values |= {name: f"{value:.{DEFAULT_DECIMALS}f}" for name, value in self._section.scalars.items()}
        texts = iter(self._section.texts)
        numbers = [next(texts, "0") if name == "-" else values.get(name, "0") for name in prints.columns]
        if prints.keys:
            text = ",".join(key + number for key, number in zip(prints.keys, numbers, strict=True))
        else:
            separator = SEPARATORS[prints.separator]
            text = separator.join(numbers) + separator * self._section.trailing_separator
        text = prints.prefix.replace("*", str(int(1e3 * at_s))) + text
        if prints.checksum == "nmea":
            text += f"*{reduce(xor, text.lstrip('$!').encode(), 0):02X}"
        return (COLOURED_LINE.format(text) if self._section.colours else text).encode() + LINE_END

    def _time(self, at_s: float) -> str:
        time = self._prints.time
        if time is None:
            return "0"
        counted = (at_s - self._counted_from_s) * self._speed * TICKS_PER_S[time.unit]
        counted = fmod(counted, time.wrap) if time.wrap else counted
        counted = float(np.float32(counted)) if self._section.time_in_single else counted
        return f"{counted:.{self._section.time_decimals}f}" if time.unit == "s" else str(int(counted))


def _format_value(value: float, section: LineRateSection | LineAccelerationSection | LineFieldSection | None) -> str:
    """Return a reading in SI units as the device's program prints it."""
    if section is None:  # printed in SI units; the rig does not read it
        return f"{value:.{DEFAULT_DECIMALS}f}"
    decimals = DEFAULT_DECIMALS if section.decimals is None else section.decimals
    return f"{value / section.scale / UNITS[section.unit]:.{decimals}f}"
