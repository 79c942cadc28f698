"""A configured device that prints lines as a source of samples: its numbers made counts in SI units."""

from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from math import radians

import numpy as np
from numpy.typing import NDArray

from rig.config.lines_section import (
    ACCELEROMETER,
    GYROSCOPE,
    MAGNETOMETER,
    LineAccelerationSection,
    LineFieldSection,
    LineRateSection,
    LinesSection,
)
from rig.config.sensor_sections import OwnPortSection, SensorSection, field_name, scalar_name
from rig.config.units import UNITS
from rig.data.channel import Channel, of_stated_temperature, of_thermometer, of_three_axes, stamped
from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity
from rig.data.recorded_sensor import RecordedSensor, range_m_s2, recorded_as
from rig.estimation.arrays import Array
from rig.sensors.errors import SensorError
from rig.sensors.lines.driver import LinesDevice
from rig.sensors.lines.stamping import COARSE
from rig.sensors.scales import DEGREES_PER_COUNT, FIELD_FULL_SCALE_T, FULL_SCALE_COUNTS
from rig.sensors.silence import USUAL, Patience
from rig.sensors.source import OnSamples

AT_THE_END = 1 - 1e-4  # of the range, where readings count as saturated: a count of 16 bits below it is none
LookedAt = str | SensorError
AXES = {RATE: GYROSCOPE, ACCELERATION: ACCELEROMETER, FIELD: MAGNETOMETER}
_OfTriad = LineRateSection | LineAccelerationSection | LineFieldSection


class LinesSource:
    """A device that prints what it should; its samples are handed on from `start` on."""

    def __init__(self, name: str, section: SensorSection, on_samples: OnSamples, *, patience: Patience = USUAL) -> None:
        """Raises SensorError as `LinesDevice`."""
        self._on_samples = on_samples
        line, lines = _parts_of(section)
        self._read = dict(_read(name, section))
        self._device = LinesDevice(name, line, lines, section.rate_hz, self._take, patience=patience)

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

        Raises SensorError as `OwnPort.check`, `lines_damaged`, `lines_time_jumped`.
        """
        self._device.own_port.check(clock_s)

    def close(self) -> None:
        """Ends the thread and closes the port."""
        self._device.close()

    def _take(self, values: Array, numbers: NDArray[np.int64], times_us: NDArray[np.int64], host_time_s: float) -> None:
        """Hand over the lines' numbers as samples, on the reader's thread."""
        for name, (sensor, columns) in self._read.items():
            samples = stamped(sensor.sample_dtype, numbers, times_us, host_time_s)
            for channel, printed in zip(sensor.channels, columns, strict=True):
                if printed.places:  # what is stated of a temperature has none: its counts stay zero
                    channel.fill(samples, printed.readings(values, channel))
            self._on_samples(name, samples)


@dataclass(frozen=True, slots=True)
class _Printed:
    """Where a channel's numbers stand in a line; a printed 1 is `size` in the channel's unit, a printed 0 `zero`."""

    places: tuple[int, ...]
    size: float = 1.0
    zero: float = 0.0

    def readings(self, values: Array, channel: Channel) -> Array:
        """The channel's readings (n,) or (n, 3) of printed `values` (n, columns)."""
        return values[:, self.places].reshape(len(values), *channel.measures.shape) * self.size + self.zero


def describe(name: str, section: SensorSection) -> RecordedSensor:
    """What a reader of the gyroscope's samples must know."""
    _, (sensor, _) = next(_read(name, section))
    return sensor


def _read(name: str, section: SensorSection) -> Iterator[tuple[str, tuple[RecordedSensor, tuple[_Printed, ...]]]]:
    """What is read of the lines, by names, the gyroscope first: as it is recorded, and where each channel stands."""
    _, lines = _parts_of(section)
    own = [_triad(lines, RATE, lines.rate, radians(section.range_deg_s)), _thermometer(lines)]
    if section.acceleration is not None and lines.acceleration is not None:
        own.append(_triad(lines, ACCELERATION, lines.acceleration, range_m_s2(section.acceleration)))

    def recorded(part: str, *channels: tuple[Channel, _Printed]) -> tuple[RecordedSensor, tuple[_Printed, ...]]:
        of, printed = zip(*channels, strict=True)
        return recorded_as(section, *of, part=part, clock=name), printed

    gyroscope, printed = recorded(section.part, *own)
    yield name, (replace(gyroscope, stamp_std_s=stamp_std_s(lines, section.rate_hz)), printed)
    if lines.field is not None:
        field = _triad(lines, FIELD, lines.field, FIELD_FULL_SCALE_T)
        yield field_name(name), recorded("lines_magnetometer", field)
    for scalar, told in lines.scalars.items():
        unit = UNITS[told.unit]
        channel = Channel(unit.of, unit.of, "<f8", 1.0)
        place = _Printed((lines.columns.index(scalar),), told.scale * unit.size, unit.zero)
        yield scalar_name(name, scalar), recorded(f"lines_{channel.measures.sensor}", (channel, place))


def stamp_std_s(lines: LinesSection, rate_hz: float) -> float | None:
    """Standard uncertainty of a sample's time on the clock that stamps it; None where that is exact enough."""
    if lines.clock == "arrival":
        return 1e-3 * lines.jitter_ms / 3**0.5
    if lines.clock == "device" and lines.time is not None and lines.time.unit == "ms" and 1e-3 * rate_hz > COARSE:
        return UNITS["ms"].size / 12**0.5
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
                mean = device.seen[:, [told.columns.index(axis) for axis in axes]].mean(axis=0) * section_of.scale
                yield f"{what}: {' '.join(f'{value:+.4g}' for value in mean)} {section_of.unit}, the mean"
        for called, scalar in told.scalars.items():
            mean = device.seen[:, told.columns.index(called)].mean() * scalar.scale
            yield f"{called}: {mean:.6g} {scalar.unit}, the mean"
        if (std_s := stamp_std_s(told, section.rate_hz)) is not None:
            yield f"its samples are timed to {1e3 * std_s:.2g} ms, which is a line of the budget"


def _triad(lines: LinesSection, quantity: Quantity, section: _OfTriad, full_scale: float) -> tuple[Channel, _Printed]:
    """Three axes in steps of the last digit that is printed, where that is stated and fits 32 bits."""
    unit = section.scale * UNITS[section.unit].size
    step = 0.0 if section.decimals is None else unit * 10.0**-section.decimals
    step = max(step, full_scale / FULL_SCALE_COUNTS)
    channel = of_three_axes(quantity, step, max(int(AT_THE_END * full_scale / step), 1), full_scale)
    return channel, _Printed(tuple(map(lines.columns.index, AXES[quantity])), unit)


def _thermometer(lines: LinesSection) -> tuple[Channel, _Printed]:
    told = lines.temperature
    if told.stated_c is not None:
        return of_stated_temperature(told.stated_c, told.stated_within_k), _Printed(())
    step = 0.0 if told.decimals is None else told.scale * 10.0**-told.decimals
    place = lines.columns.index("temperature")
    return of_thermometer(max(step, DEGREES_PER_COUNT), 0.0), _Printed((place,), told.scale, told.offset_c)


def _parts_of(section: SensorSection) -> tuple[OwnPortSection, LinesSection]:
    if section.serial is None or section.lines is None:
        raise ValueError("the configuration lets no device that prints lines pass without its port and its lines")
    return section.serial, section.lines
