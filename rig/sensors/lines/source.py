"""A configured device that prints lines as a source of samples: its numbers made counts in SI units."""

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
from rig.data.recording.channel import Channel, of_thermometer, of_three_axes, stamped
from rig.data.recording.recorded_sensor import UNKNOWN_CHANGE_K, RecordedSensor, range_m_s2, recorded_as
from rig.estimation.arrays import Array
from rig.sensors.errors import SensorError
from rig.sensors.lines.driver import LinesDevice
from rig.sensors.lines.fields import NOT_PROVIDED
from rig.sensors.lines.stamping import is_coarse
from rig.sensors.scales import DEGREES_PER_COUNT, FIELD_FULL_SCALE_T, FULL_SCALE_COUNTS, thermometer_channels
from rig.sensors.silence import USUAL, Patience
from rig.sensors.source import OnSamples
from rig.sensors.thermometer import Thermometer

AT_THE_END = 1 - 1e-4  # of the range, where readings count as saturated: a count of 16 bits below it is none
LookedAt = str | SensorError
AXES = {RATE: GYROSCOPE, ACCELERATION: ACCELEROMETER, FIELD: MAGNETOMETER}
_OfTriad = LineRateSection | LineAccelerationSection | LineFieldSection


@dataclass(frozen=True, slots=True)
class Seen:
    """What the first lines of a device show: whether it provides a temperature, and the steps of its time, s."""

    provides_temperature: bool = True
    time_step_s: float = 0.0


UNSEEN = Seen()  # of a device that nobody has looked at: as its section says


class LinesSource:
    """A device that prints what it should; its samples are handed on from `start` on."""

    def __init__(self, name: str, section: SensorSection, on_samples: OnSamples, *, patience: Patience = USUAL) -> None:
        """Raises SensorError as `LinesDevice`."""
        self._on_samples = on_samples
        line, lines = _parts_of(section)
        self._device = LinesDevice(name, line, lines, section.rate_hz, self._take, patience=patience)
        self._thermometer = Thermometer(self._device.where, section.rate_hz)
        if "temperature" in lines.columns:
            self._thermometer.read(_temperatures_c(lines, self._device.seen))
        seen = Seen(self._thermometer.provides, self._device.time_step_s)
        self._read = dict(_read(name, section, seen))
        self._not_provided = dict.fromkeys(self._read, 0)
        self._lines, self._name = lines, name

    @property
    def corrected(self) -> Mapping[str, str]:
        """Settings that were corrected: none, for nothing is sent to the device."""
        return {}

    @property
    def sensors(self) -> Mapping[str, RecordedSensor]:
        """The gyroscope, the magnetometer if it prints one, and what it prints that has no axes."""
        return {name: sensor for name, (sensor, _) in self._read.items()}

    def start(self) -> None:
        """Start the device's samples, as of `SampleSource`."""
        self._device.start()

    def check(self, clock_s: float | None = None) -> None:
        """Check the device, as of `SampleSource`.

        Raises SensorError as `OwnPort.check`, `lines_damaged`, `lines_time_jumped`, `temperature_lost`.
        """
        self._device.own_port.check(clock_s)

    def close(self) -> None:
        """Ends the thread and closes the port."""
        self._device.close()

    def _take(self, values: Array, numbers: NDArray[np.int64], times_us: NDArray[np.int64], host_time_s: float) -> None:
        """Hand over the lines' numbers as samples, on the reader's thread."""
        for name, (sensor, columns) in self._read.items():
            readings = [
                self._thermometer.read(_temperatures_c(self._lines, values))
                if channel.quantity == TEMPERATURE.name and name == self._name and printed.places
                else printed.readings(values, channel)
                for channel, printed in zip(sensor.channels, columns, strict=True)
            ]
            whole = np.all([np.isfinite(each).reshape(len(values), -1).all(axis=1) for each in readings], axis=0)
            numbered = numbers
            if name != self._name:  # what a line does not provide of it was not measured, and is not lost
                numbered = numbers - self._not_provided[name] - np.cumsum(~whole)
                self._not_provided[name] += int(np.count_nonzero(~whole))
            if not whole.any():
                continue
            samples = stamped(sensor.sample_dtype, numbered[whole], times_us[whole], host_time_s)
            for channel, read in zip(sensor.channels, readings, strict=True):
                channel.fill(samples, read[whole])
            self._on_samples(name, samples)


@dataclass(frozen=True, slots=True)
class _Printed:
    """Where a channel's numbers stand in a line; a printed 1 is `size` in the channel's unit, a printed 0 `zero`."""

    places: tuple[int, ...]
    size: float = 1.0
    zero: float = 0.0

    def readings(self, values: Array, channel: Channel) -> Array:
        """The channel's readings (n,) or (n, 3) of printed `values` (n, columns); what is stated has no place there."""
        if not self.places:
            return np.full(len(values), channel.offset)
        return values[:, self.places].reshape(len(values), *channel.measures.shape) * self.size + self.zero


def describe(name: str, section: SensorSection) -> RecordedSensor:
    """What a reader of the gyroscope's samples must know."""
    _, (sensor, _) = next(_read(name, section, UNSEEN))
    return sensor


def _read(
    name: str, section: SensorSection, seen: Seen
) -> Iterator[tuple[str, tuple[RecordedSensor, tuple[_Printed, ...]]]]:
    """What is read of the lines, by names, the gyroscope first: as it is recorded, and where each channel stands."""
    _, lines = _parts_of(section)
    own = [
        _triad(lines, RATE, lines.rate, radians(section.range_deg_s)),
        *_thermometer(lines, provides=seen.provides_temperature),
    ]
    if section.acceleration is not None and lines.acceleration is not None:
        own.append(_triad(lines, ACCELERATION, lines.acceleration, range_m_s2(section.acceleration)))

    def recorded(part: str, *channels: tuple[Channel, _Printed]) -> tuple[RecordedSensor, tuple[_Printed, ...]]:
        of, printed = zip(*channels, strict=True)
        return recorded_as(section, *of, part=part, clock=name), printed

    gyroscope, printed = recorded(section.part, *own)
    std_s = stamp_std_s(lines, section.rate_hz, seen.time_step_s)
    yield name, (replace(gyroscope, stamp_std_s=std_s), printed)
    if lines.field is not None:
        field = _triad(lines, FIELD, lines.field, FIELD_FULL_SCALE_T)
        yield field_name(name), recorded("lines_magnetometer", field)
    for scalar, told in lines.scalars.items():
        unit = UNITS[told.unit]
        channel = Channel(unit.quantity, unit.quantity, "<f8", 1.0)
        place = _Printed((lines.columns.index(scalar),), told.scale * unit.size, unit.zero)
        yield scalar_name(name, scalar), recorded(f"lines_{channel.measures.sensor}", (channel, place))


def stamp_std_s(lines: LinesSection, rate_hz: float, step_s: float = 0.0) -> float | None:
    """Standard uncertainty of a sample's time on the clock that stamps it; None where that is exact enough.

    The device prints its time in steps of `step_s`, if somebody has looked, and of a whole unit but for seconds else.
    """
    if lines.clock == "arrival":
        return 1e-3 * lines.jitter_ms / 3**0.5
    if lines.clock == "device" and lines.time is not None:
        step_s = step_s or (0.0 if lines.time.unit == "s" else UNITS[lines.time.unit].size)
        return step_s / 12**0.5 if is_coarse(step_s, rate_hz) else None
    return None


def lines(
    name: str, section: SensorSection, on_samples: OnSamples, *, patience: Patience = USUAL
) -> closing[LinesSource]:
    """The device for the length of the `with` block. Raises SensorError as `LinesSource`."""
    return closing(LinesSource(name, section, on_samples, patience=patience))


def look(name: str, section: SensorSection) -> Iterator[LookedAt]:
    """What there is, and what is wrong with it. Raises SensorError as `LinesDevice`."""
    line, told = _parts_of(section)
    with closing(LinesDevice(name, line, told, section.rate_hz)) as device:
        counts = device.counts
        rate = "" if np.isnan(device.rate_hz) else f", {device.rate_hz:.4g} a second by its own time"
        yield f"lines at {line.port}: {counts.samples} samples{rate}"
        if counts.before or counts.comments:
            yield f"{counts.before} lines before the first sample and {counts.comments} comments were skipped"
        for what, section_of, axes in (
            ("rate", told.rate, GYROSCOPE),
            ("acceleration", told.acceleration, ACCELEROMETER),
            ("field", told.field, MAGNETOMETER),
        ):
            if section_of is not None:
                mean = _mean(device.seen[:, [told.columns.index(axis) for axis in axes]]) * section_of.scale
                yield f"{what}: {' '.join(f'{value:+.4g}' for value in mean)} {section_of.unit}, the mean"
        for called, scalar in told.scalars.items():
            mean = _mean(device.seen[:, [told.columns.index(called)]])[0] * scalar.scale
            yield f"{called}: {mean:.6g} {scalar.unit}, the mean"
        yield from _of_the_temperature(told, device.seen)
        if (std_s := stamp_std_s(told, section.rate_hz, device.time_step_s)) is not None:
            yield f"its samples are timed to {1e3 * std_s:.2g} ms, which is a line of the budget"


def _of_the_temperature(lines: LinesSection, seen: Array) -> Iterator[str]:
    """How the temperature is known, unless the device provides it."""
    if "temperature" in lines.columns and np.isfinite(_temperatures_c(lines, seen)).any():
        return
    stated = lines.temperature.stated
    yield "it provides no temperature" + (
        f": {stated.stated_c:g} °C is stated, within {stated.stated_within_k:g} K"
        if stated is not None
        else f", and none is stated: U allows for a change of {UNKNOWN_CHANGE_K:g} K (lines.temperature.stated_c)"
    )


def _mean(values: Array) -> Array:
    """(k,) means of the numbers in values (n, k), NaN of a column that has none."""
    there = np.isfinite(values)
    count = there.sum(axis=0)
    sums = np.where(there, values, 0.0).sum(axis=0)
    return np.where(count > 0, sums / np.maximum(count, 1), np.nan)


def _triad(lines: LinesSection, quantity: Quantity, section: _OfTriad, full_scale: float) -> tuple[Channel, _Printed]:
    """Three axes in steps of the last digit that is printed, where that is stated and fits 32 bits."""
    unit = section.scale * UNITS[section.unit].size
    step = 0.0 if section.decimals is None else unit * 10.0**-section.decimals
    step = max(step, full_scale / FULL_SCALE_COUNTS)
    channel = of_three_axes(quantity, step, max(int(AT_THE_END * full_scale / step), 1), full_scale)
    return channel, _Printed(tuple(map(lines.columns.index, AXES[quantity])), unit)


def _thermometer(lines: LinesSection, *, provides: bool) -> Iterator[tuple[Channel, _Printed]]:
    """The channel of the temperature that the device prints, else of the one that is stated, if any is."""
    printed, place = None, _Printed(())
    if provides and "temperature" in lines.columns:
        told = lines.temperature
        step = 0.0 if told.decimals is None else told.scale * 10.0**-told.decimals
        printed = of_thermometer(max(step, DEGREES_PER_COUNT), 0.0)
        place = _Printed((lines.columns.index("temperature"),), told.scale, told.offset_c)
    yield from ((channel, place) for channel in thermometer_channels(printed, lines.temperature.stated))


def _temperatures_c(lines: LinesSection, values: Array) -> Array:
    """(n,) °C of printed `values` (n, columns), NaN where the device provides none."""
    told = lines.temperature
    celsius = values[:, lines.columns.index("temperature")] * told.scale + told.offset_c
    return np.where(NOT_PROVIDED["temperature"].provided(celsius), celsius, np.nan)


def _parts_of(section: SensorSection) -> tuple[OwnPortSection, LinesSection]:
    if section.serial is None or section.lines is None:
        raise ValueError("the configuration lets no device that prints lines pass without its port and its lines")
    return section.serial, section.lines
