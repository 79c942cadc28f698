"""A configured device that sends lines of text, as a source of samples: their numbers are converted to counts."""

from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from math import radians

import numpy as np
from numpy.typing import NDArray

from rig.config.sensors.lines_section import (
    ACCELEROMETER,
    GYROSCOPE,
    MAGNETOMETER,
    LineAccelerationSection,
    LineFieldSection,
    LineRateSection,
    LinesSection,
)
from rig.config.sensors.sensor_sections import OwnPortSection, SensorSection, field_name, scalar_name
from rig.config.units import UNITS
from rig.data.quantity import ACCELERATION, FIELD, RATE, TEMPERATURE, Quantity
from rig.data.recording.channel import Channel, stamp_samples, thermometer_channel, triad_channel
from rig.data.recording.recorded_sensor import UNKNOWN_CHANGE_K, RecordedSensor, build_sensor, range_m_s2
from rig.estimation.arrays import Array
from rig.sensors.errors import SensorError
from rig.sensors.lines.fields import NOT_PROVIDED
from rig.sensors.lines.lines_driver import LinesDevice
from rig.sensors.lines.stamping import is_coarse
from rig.sensors.port_silence import PATIENCE, Patience
from rig.sensors.sample_source import OnSamples
from rig.sensors.scales import DEGREES_PER_COUNT, FIELD_FULL_SCALE_T, FULL_SCALE_COUNTS, thermometer_channels
from rig.sensors.thermometer import Thermometer

SATURATION_FRACTION = 1 - 1e-4  # of the range: within a 16-bit count of the end
LookResult = str | SensorError
AXIS_NAMES = {RATE: GYROSCOPE, ACCELERATION: ACCELEROMETER, FIELD: MAGNETOMETER}
_TriadSection = LineRateSection | LineAccelerationSection | LineFieldSection


@dataclass(frozen=True, slots=True)
class FirstLines:
    """Facts from the first lines of a device: whether it provides a temperature, and the step of its time, s."""

    provides_temperature: bool = True
    time_step_s: float = 0.0


UNCONNECTED_LINES = FirstLines()  # before a connection, according to the section


class LinesSource:
    """A device that sends its samples as lines of text, in the configured columns; they are passed on after `start`."""

    def __init__(
        self, name: str, section: SensorSection, on_samples: OnSamples, *, patience: Patience = PATIENCE
    ) -> None:
        """Connect and read the first lines. Raise SensorError as `LinesDevice` does."""
        self._on_samples = on_samples
        line, lines = _split_section(section)
        self._device = LinesDevice(name, line, lines, section.rate_hz, self._take, patience=patience)
        self._thermometer = Thermometer(self._device.where, section.rate_hz)
        if "temperature" in lines.columns:
            self._thermometer.read(_temperatures_c(lines, self._device.first_values))
        first_lines = FirstLines(self._thermometer.provides, self._device.time_step_s)
        self._readers = dict(_make_readers(name, section, first_lines))
        self._not_provided = dict.fromkeys(self._readers, 0)
        self._lines, self._name = lines, name

    @property
    def corrected(self) -> Mapping[str, str]:
        """The corrected settings: always empty, because nothing is sent to the device."""
        return {}

    @property
    def sensors(self) -> Mapping[str, RecordedSensor]:
        """The device's sensors by name: gyroscope, magnetometer if configured, and sensors of one number."""
        return {name: sensor for name, (sensor, _) in self._readers.items()}

    def start(self) -> None:
        """Start to pass samples to the consumer."""
        self._device.start()

    def check(self, clock_s: float | None = None) -> None:
        """Raise SensorError `lines_damaged`, `lines_time_jumped`, `temperature_lost`, or as `OwnPort.check` does."""
        self._device.own_port.check(clock_s)

    def catch_up(self) -> None:
        """Wait for the bytes that have arrived (see `OwnPort.catch_up`)."""
        self._device.own_port.catch_up()

    def close(self) -> None:
        """End the thread and close the port."""
        self._device.close()

    def _take(self, values: Array, numbers: NDArray[np.int64], times_us: NDArray[np.int64], host_time_s: float) -> None:
        """Pass on the `values` of lines as samples with these numbers and times, on the reader's thread."""
        for name, (sensor, printed_channels) in self._readers.items():
            readings = [
                self._thermometer.read(_temperatures_c(self._lines, values))
                if channel.quantity == TEMPERATURE.name and name == self._name and printed.columns
                else printed.readings(values, channel)
                for channel, printed in zip(sensor.channels, printed_channels, strict=True)
            ]
            complete = np.all(
                [np.isfinite(reading).reshape(len(values), -1).all(axis=1) for reading in readings], axis=0
            )
            sample_numbers = numbers
            if name != self._name:  # a value that a line does not provide was not measured, and is not lost
                sample_numbers = numbers - self._not_provided[name] - np.cumsum(~complete)
                self._not_provided[name] += int(np.count_nonzero(~complete))
            if not complete.any():
                continue
            samples = stamp_samples(sensor.sample_dtype, sample_numbers[complete], times_us[complete], host_time_s)
            for channel, reading in zip(sensor.channels, readings, strict=True):
                channel.fill(samples, reading[complete])
            self._on_samples(name, samples)


@dataclass(frozen=True, slots=True)
class _Printed:
    """The columns of a channel in a line; a printed number n means n × `size` + `zero` in the channel's unit."""

    columns: tuple[int, ...]
    size: float = 1.0
    zero: float = 0.0

    def readings(self, values: Array, channel: Channel) -> Array:
        """Return the channel's readings (n,) or (n, 3) in `values` (n, columns).

        If the lines do not contain the channel, its readings are the constant that the configuration states.
        """
        if not self.columns:
            return np.full(len(values), channel.offset)
        return values[:, self.columns].reshape(len(values), *channel.measures.shape) * self.size + self.zero


def describe(name: str, section: SensorSection) -> RecordedSensor:
    """Return the description of the gyroscope's samples for a recording."""
    _, (sensor, _) = next(_make_readers(name, section, UNCONNECTED_LINES))
    return sensor


def _make_readers(
    name: str, section: SensorSection, first_lines: FirstLines
) -> Iterator[tuple[str, tuple[RecordedSensor, tuple[_Printed, ...]]]]:
    """Yield name, description and printed channels of each sensor in the lines, the gyroscope first."""
    _, lines = _split_section(section)
    own_channels = [
        _make_triad(lines, RATE, lines.rate, radians(section.range_deg_s)),
        *_make_thermometer(lines, provides=first_lines.provides_temperature),
    ]
    if section.acceleration is not None and lines.acceleration is not None:
        own_channels.append(_make_triad(lines, ACCELERATION, lines.acceleration, range_m_s2(section.acceleration)))

    def make_sensor(part: str, *channels: tuple[Channel, _Printed]) -> tuple[RecordedSensor, tuple[_Printed, ...]]:
        channels_only, printed = zip(*channels, strict=True)
        return build_sensor(section, *channels_only, part=part, clock=name), printed

    gyroscope, printed = make_sensor(section.part, *own_channels)
    std_s = stamp_std_s(lines, section.rate_hz, first_lines.time_step_s)
    yield name, (replace(gyroscope, stamp_std_s=std_s), printed)
    if lines.field is not None:
        field = _make_triad(lines, FIELD, lines.field, FIELD_FULL_SCALE_T)
        yield field_name(name), make_sensor("lines_magnetometer", field)
    for scalar, scalar_section in lines.scalars.items():
        unit = UNITS[scalar_section.unit]
        channel = Channel(unit.quantity, unit.quantity, "<f8", 1.0)
        printed_scalar = _Printed((lines.columns.index(scalar),), scalar_section.scale * unit.size, unit.zero)
        yield scalar_name(name, scalar), make_sensor(f"lines_{channel.measures.sensor}", (channel, printed_scalar))


def stamp_std_s(lines: LinesSection, rate_hz: float, step_s: float = 0.0) -> float | None:
    """Return the standard uncertainty of a sample's time on the clock that stamps it; None if it is negligible.

    `step_s` is the step of the time in the device's lines. If it is 0, one unit of this time is taken as its step,
    except if the unit is the second: then the step is neglected.
    """
    if lines.clock == "arrival":
        return 1e-3 * lines.jitter_ms / 3**0.5
    if lines.clock == "device" and lines.time is not None:
        step_s = step_s or (0.0 if lines.time.unit == "s" else UNITS[lines.time.unit].size)
        return step_s / 12**0.5 if is_coarse(step_s, rate_hz) else None
    return None


def lines(
    name: str, section: SensorSection, on_samples: OnSamples, *, patience: Patience = PATIENCE
) -> closing[LinesSource]:
    """Return the device's source as a context manager. Raise the SensorErrors of `LinesSource`."""
    return closing(LinesSource(name, section, on_samples, patience=patience))


def look(name: str, section: SensorSection) -> Iterator[LookResult]:
    """Yield the device's state and its problems. Raise the SensorErrors of `LinesDevice`."""
    line, spec = _split_section(section)
    with closing(LinesDevice(name, line, spec, section.rate_hz)) as device:
        counts = device.counts
        rate = "" if np.isnan(device.rate_hz) else f", {device.rate_hz:.4g} a second by its own time"
        yield f"lines at {line.port}: {counts.samples} samples{rate}"
        if counts.before or counts.comments:
            yield f"{counts.before} lines before the first sample and {counts.comments} comments were skipped"
        for quantity, triad, axes in (
            ("rate", spec.rate, GYROSCOPE),
            ("acceleration", spec.acceleration, ACCELEROMETER),
            ("field", spec.field, MAGNETOMETER),
        ):
            if triad is not None:
                mean = _mean(device.first_values[:, [spec.columns.index(axis) for axis in axes]]) * triad.scale
                yield f"{quantity}: {' '.join(f'{value:+.4g}' for value in mean)} {triad.unit}, the mean"
        for scalar_column, scalar in spec.scalars.items():
            mean = _mean(device.first_values[:, [spec.columns.index(scalar_column)]])[0] * scalar.scale
            yield f"{scalar_column}: {mean:.6g} {scalar.unit}, the mean"
        yield from _describe_temperature(spec, device.first_values)
        if (std_s := stamp_std_s(spec, section.rate_hz, device.time_step_s)) is not None:
            yield f"its samples are timed to {1e3 * std_s:.2g} ms, which is a line of the budget"


def _describe_temperature(lines: LinesSection, values: Array) -> Iterator[str]:
    """Yield a sentence on the source of the temperature, unless the device provides it."""
    if "temperature" in lines.columns and np.isfinite(_temperatures_c(lines, values)).any():
        return
    stated = lines.temperature.stated
    yield "it provides no temperature" + (
        f": {stated.stated_c:g} °C is stated, within {stated.stated_within_k:g} K"
        if stated is not None
        else f", and none is stated: U allows for a change of {UNKNOWN_CHANGE_K:g} K (lines.temperature.stated_c)"
    )


def _mean(values: Array) -> Array:
    """Return the means (k,) of the numbers in values (n, k); NaN for a column without numbers."""
    is_number = np.isfinite(values)
    count = is_number.sum(axis=0)
    sums = np.where(is_number, values, 0.0).sum(axis=0)
    return np.where(count > 0, sums / np.maximum(count, 1), np.nan)


def _make_triad(
    lines: LinesSection, quantity: Quantity, section: _TriadSection, full_scale: float
) -> tuple[Channel, _Printed]:
    """Return a channel of three axes, and its columns.

    The channel's step is one unit of the last printed digit, or more if the range would not fit into 32 bits.
    """
    unit = section.scale * UNITS[section.unit].size
    step = 0.0 if section.decimals is None else unit * 10.0**-section.decimals
    step = max(step, full_scale / FULL_SCALE_COUNTS)
    channel = triad_channel(quantity, step, max(int(SATURATION_FRACTION * full_scale / step), 1), full_scale)
    return channel, _Printed(tuple(map(lines.columns.index, AXIS_NAMES[quantity])), unit)


def _make_thermometer(lines: LinesSection, *, provides: bool) -> Iterator[tuple[Channel, _Printed]]:
    """Yield the channel of the printed or else of the stated temperature, with its columns; nothing without either."""
    printed, printed_channel = None, _Printed(())
    if provides and "temperature" in lines.columns:
        temperature = lines.temperature
        step = 0.0 if temperature.decimals is None else temperature.scale * 10.0**-temperature.decimals
        printed = thermometer_channel(max(step, DEGREES_PER_COUNT), 0.0)
        printed_channel = _Printed((lines.columns.index("temperature"),), temperature.scale, temperature.offset_c)
    yield from ((channel, printed_channel) for channel in thermometer_channels(printed, lines.temperature.stated))


def _temperatures_c(lines: LinesSection, values: Array) -> Array:
    """Return the temperatures (n,), °C, in printed `values` (n, columns); NaN if the device provides none."""
    temperature = lines.temperature
    celsius = values[:, lines.columns.index("temperature")] * temperature.scale + temperature.offset_c
    return np.where(NOT_PROVIDED["temperature"].mask_provided(celsius), celsius, np.nan)


def _split_section(section: SensorSection) -> tuple[OwnPortSection, LinesSection]:
    if section.serial is None or section.lines is None:
        raise ValueError("the configuration lets no device that prints lines pass without its port and its lines")
    return section.serial, section.lines
