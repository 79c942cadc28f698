"""A configured device that prints lines as a source of samples: its numbers made counts in SI units."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from math import radians
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.config.lines_section import (
    ACCELEROMETER,
    GYROSCOPE,
    MAGNETOMETER,
    SECONDS,
    LineAccelerationSection,
    LineFieldSection,
    LineRateSection,
    LinesSection,
)
from rig.config.sensor_sections import OwnPortSection, SensorSection, field_name
from rig.data.channel import Channel, of_thermometer, of_three_axes
from rig.data.quantity import ACCELERATION, FIELD, RATE, TEMPERATURE, Quantity
from rig.data.recorded_mounting import recorded_mounting
from rig.data.recorded_sensor import RecordedSensor
from rig.estimation.arrays import Array
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.sensors.errors import SensorError
from rig.sensors.lines.driver import LinesDevice
from rig.sensors.lines.stamping import COARSE
from rig.sensors.silence import USUAL, Patience
from rig.sensors.source import OnSamples

UNITS = {
    "rad/s": 1.0, "deg/s": radians(1), "mdeg/s": radians(1e-3), "mrad/s": 1e-3,
    "m/s2": 1.0, "g": STANDARD_GRAVITY_M_S2, "mg": STANDARD_GRAVITY_M_S2 * 1e-3,
    "T": 1.0, "uT": 1e-6, "nT": 1e-9, "gauss": 1e-4, "mgauss": 1e-7,
}  # fmt: skip
FULL_SCALE_COUNTS = 1 << 30  # of numbers whose resolution nobody states: half of what 32 bits hold
AT_THE_END = 1 - 1e-4  # of the range, where readings count as saturated: a count of 16 bits below it is none
FIELD_FULL_SCALE_T = 1e-3
DEGREES_PER_COUNT = 0.01
LookedAt = str | SensorError
_OfTriad = LineRateSection | LineAccelerationSection | LineFieldSection


class LinesSource:
    """A device that prints what it should; its samples are handed on from `start` on."""

    def __init__(self, name: str, section: SensorSection, on_samples: OnSamples, *, patience: Patience = USUAL) -> None:
        """Raises SensorError as `LinesDevice`."""
        self._name, self._on_samples = name, on_samples
        line, self._section = _parts_of(section)
        self._described = describe(name, section)
        self._field_name, self._field = field_name(name), describe_field(name, section)
        self._device = LinesDevice(name, line, self._section, section.rate_hz, self._take, patience=patience)

    @property
    def corrected(self) -> Mapping[str, str]:
        """Settings that were corrected: none, for nothing is sent to the device."""
        return {}

    @property
    def sensors(self) -> Mapping[str, RecordedSensor]:
        """The one there is, and its magnetometer if it prints one."""
        field = {} if self._field is None else {self._field_name: self._field}
        return {self._name: self._described, **field}

    def start(self) -> None:
        """Start the device's samples, as of `SampleSource`."""
        self._device.start()

    def check(self, clock_s: float | None = None) -> None:
        """Check the device, as of `SampleSource`. Raises SensorError as `LinesDevice.check`."""
        self._device.check(clock_s)

    def close(self) -> None:
        """Ends the thread and closes the port."""
        self._device.close()

    def _take(self, values: Array, numbers: NDArray[np.int64], times_us: NDArray[np.int64], host_time_s: float) -> None:
        """Hand over the lines' numbers as samples, on the reader's thread."""
        columns = self._section.columns
        for name, sensor in self.sensors.items():
            samples = np.zeros(len(values), sensor.sample_dtype)
            samples["sequence"], samples["board_time_us"] = numbers, times_us
            samples["host_time_s"] = host_time_s
            for channel in sensor.channels:
                if channel.quantity == TEMPERATURE.name:
                    samples[channel.column] = self._temperatures(values, channel)
                    continue
                section, axes = _described_by(self._section, channel.quantity)
                read = values[:, [columns.index(axis) for axis in axes]] * _unit(section)
                most = np.iinfo(np.int32).max
                samples[channel.column] = np.clip(np.rint(read / channel.unit_per_count), -most, most)
            self._on_samples(name, samples)

    def _temperatures(self, values: Array, channel: Channel) -> Any:
        if "temperature" not in self._section.columns:
            return 0  # counts above what is stated
        told = self._section.temperature
        celsius = values[:, self._section.columns.index("temperature")] * told.scale + told.offset_c
        most = np.iinfo(np.int16).max
        return np.clip(np.rint((celsius - channel.offset) / channel.unit_per_count), -most, most)


def describe(name: str, section: SensorSection) -> RecordedSensor:
    """What a reader of its samples must know."""
    _, lines = _parts_of(section)
    channels = [_channel(RATE, lines.rate, radians(section.range_deg_s)), _thermometer(lines)]
    if section.acceleration is not None and lines.acceleration is not None:
        range_m_s2 = (section.acceleration.range_g or 0.0) * STANDARD_GRAVITY_M_S2
        channels.append(_channel(ACCELERATION, lines.acceleration, range_m_s2))
    return RecordedSensor(
        part=section.part,
        serial_number=section.serial_number,
        rate_hz=section.rate_hz,
        channels=tuple(channels),
        mounting=recorded_mounting(section.mounting),
        clock=name,
        stamp_std_s=stamp_std_s(lines, section.rate_hz),
    )


def describe_field(name: str, section: SensorSection) -> RecordedSensor | None:
    """How a recording describes the device's magnetometer; None where it prints none."""
    _, lines = _parts_of(section)
    if lines.field is None:
        return None
    return RecordedSensor(
        part="lines_magnetometer",
        serial_number=section.serial_number,
        rate_hz=section.rate_hz,
        channels=(_channel(FIELD, lines.field, FIELD_FULL_SCALE_T),),
        mounting=recorded_mounting(section.mounting),
        clock=name,
    )


def stamp_std_s(lines: LinesSection, rate_hz: float) -> float | None:
    """Standard uncertainty of a sample's time on the clock that stamps it; None where that is exact enough."""
    if lines.clock == "arrival":
        return 1e-3 * lines.jitter_ms / 3**0.5
    if lines.clock == "device" and lines.time is not None and lines.time.unit == "ms" and 1e-3 * rate_hz > COARSE:
        return SECONDS["ms"] / 12**0.5
    return None


@contextmanager
def lines(
    name: str, section: SensorSection, on_samples: OnSamples, *, patience: Patience = USUAL
) -> Iterator[LinesSource]:
    """The device for the length of the `with` block. Raises SensorError as `LinesSource`."""
    source = LinesSource(name, section, on_samples, patience=patience)
    try:
        yield source
    finally:
        source.close()


def look(name: str, section: SensorSection) -> Iterator[LookedAt]:
    """What there is, and what is wrong with it. Raises SensorError as `LinesDevice`."""
    line, told = _parts_of(section)
    with LinesDevice(name, line, told, section.rate_hz) as device:
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
        if (std_s := stamp_std_s(told, section.rate_hz)) is not None:
            yield f"its samples are timed to {1e3 * std_s:.2g} ms, which is a line of the budget"


def _channel(quantity: Quantity, section: _OfTriad, full_scale: float) -> Channel:
    """Three axes in steps of the last digit that is printed, where that is stated and fits 32 bits."""
    step = 0.0 if section.decimals is None else _unit(section) * 10.0**-section.decimals
    step = max(step, full_scale / FULL_SCALE_COUNTS)
    return of_three_axes(quantity, step, max(int(AT_THE_END * full_scale / step), 1), full_scale)


def _thermometer(section: LinesSection) -> Channel:
    told = section.temperature
    if told.stated_c is not None:  # a thermometer whose steps are so wide that it shows no change
        return of_thermometer(told.stated_within_k, told.stated_c)
    step = 0.0 if told.decimals is None else told.scale * 10.0**-told.decimals
    return of_thermometer(max(step, DEGREES_PER_COUNT), 0.0)


def _unit(section: _OfTriad) -> float:
    """What a printed 1 is in the SI unit."""
    return section.scale * UNITS[section.unit]


def _described_by(section: LinesSection, quantity: str) -> tuple[_OfTriad, tuple[str, str, str]]:
    found: dict[str, tuple[_OfTriad | None, tuple[str, str, str]]] = {
        RATE.name: (section.rate, GYROSCOPE),
        ACCELERATION.name: (section.acceleration, ACCELEROMETER),
        FIELD.name: (section.field, MAGNETOMETER),
    }
    told, axes = found[quantity]
    if told is None:
        raise ValueError("the configuration lets no quantity pass that it does not describe")
    return told, axes


def _parts_of(section: SensorSection) -> tuple[OwnPortSection, LinesSection]:
    if section.serial is None or section.lines is None:
        raise ValueError("the configuration lets no device that prints lines pass without its port and its lines")
    return section.serial, section.lines
