"""The configured IMUs of one autopilot as a source of samples: rates requested, corrections undone."""

from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import replace
from math import radians
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.config.sensors.mavlink_section import MavlinkSection
from rig.config.sensors.sensor_sections import SensorSection
from rig.data.quantity import ACCELERATION, RATE, TEMPERATURE, Quantity
from rig.data.recording.channel import Channel, stamp_samples, thermometer_channel
from rig.data.recording.recorded_sensor import UNKNOWN_CHANGE_K, RecordedSensor, build_sensor, range_m_s2
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.sensors.errors import SensorError
from rig.sensors.mavlink.autopilot_link import AutopilotLink
from rig.sensors.mavlink.corrections import OnboardCorrection, delay_s, parameter_names, read_correction, refusals
from rig.sensors.mavlink.imu_readings import (
    INT16_MAX,
    MILLI,
    TRUNCATION_STEPS,
    UNIT_US,
    Field,
    ImuReading,
    decode_reading,
    is_integer,
)
from rig.sensors.mavlink.message_losses import ImuCounter
from rig.sensors.mavlink.writing import find_unfinished_change
from rig.sensors.own_port import closing_on_failure
from rig.sensors.port_silence import PATIENCE, Patience
from rig.sensors.sample_source import OnSamples
from rig.sensors.scales import DEGREES_PER_COUNT, fine_axes, thermometer_channels
from rig.sensors.thermometer import Thermometer

RATE_MESSAGES = 40  # for judging the rate
MAX_RATE_WAIT_S = 20.0
RATE_TOLERANCE = 0.05
MESSAGES, WAIT_S = 10, 2.0  # that a check requests one by one, and its wait for them
RANGE_FRACTION = 0.98  # of the 16-bit range, because undoing a correction may shift the end of the scale


class _ImuStream:
    """One configured IMU of the stream: its correction, numbering, and the intervals of its first messages.

    `without_reading` counts the messages without a new rate, or without a new force if forces are recorded.
    """

    def __init__(self, name: str, section: SensorSection) -> None:
        self.name, self.section, self.line = name, section, mavlink_section(section)
        self.description = describe(name, section)
        self.correction = OnboardCorrection()
        self.counter = ImuCounter(name, 1e6 / section.rate_hz, UNIT_US[self.line.imu])
        self.thermometer = Thermometer(f"sensors.{name}: the autopilot at {self.line.port}", section.rate_hz)
        self.intervals_us: list[int] = []
        self.without_reading = 0
        self._needed: frozenset[Field] = frozenset(("rate", "force") if self._has_force else ("rate",))

    @property
    def _has_force(self) -> bool:
        return self.section.acceleration is not None

    @property
    def has_enough_messages(self) -> bool:
        """Whether enough messages came to judge the rate."""
        return max(len(self.intervals_us), self.without_reading) >= RATE_MESSAGES

    def settle(self) -> None:
        """Describe the samples by the fields that the first messages provided."""
        self.description = describe(self.name, self.section, provides_temperature=self.thermometer.provides)

    def take(self, message: Any, *, is_consecutive: bool) -> tuple[int, int, ImuReading] | None:
        """Return a message's reading, after its number and time in µs; None for a repeated or incomplete reading.

        `is_consecutive`: whether no message was lost before this one.
        """
        reading = decode_reading(message)
        if not self.thermometer.provides:
            self.thermometer.last_c = reading.temperature_c
        if not self._needed <= reading.provided:
            self.without_reading += 1
            return None
        before_us, first = self.counter.time_us, self.counter.number < 0
        if not self.counter.count(reading.time):
            return None
        if is_consecutive and not first and len(self.intervals_us) < RATE_MESSAGES:
            self.intervals_us.append(self.counter.time_us - before_us)
        return self.counter.number, self.counter.time_us, reading

    def samples(self, numbered: list[tuple[int, int, ImuReading]], first: int, host_time_s: float) -> NDArray[Any]:
        """Return the samples of the readings, numbered from `first`."""
        numbers, times_us, readings = zip(*numbered, strict=True)
        samples = stamp_samples(
            self.description.sample_dtype, np.array(numbers) - first, np.array(times_us), host_time_s
        )
        if self.thermometer.provides and self.description.measures(TEMPERATURE):
            temperatures_c = self.thermometer.read(np.array([reading.temperature_c for reading in readings]))
            self.description.channel(TEMPERATURE).fill(samples, temperatures_c)
        rates = self.correction.raw_rate(np.array([reading.rate_rad_s for reading in readings]))
        self.description.channel(RATE).fill(samples, rates)
        if self.description.measures(ACCELERATION):
            forces = self.correction.raw_force(np.array([reading.force_m_s2 for reading in readings]))
            self.description.channel(ACCELERATION).fill(samples, forces)
        return samples


class MavlinkSource:
    """The autopilot's configured IMUs, set up: parameters read, rates requested and confirmed."""

    def __init__(
        self, sections: Mapping[str, SensorSection], on_samples: OnSamples, *, patience: Patience = PATIENCE
    ) -> None:
        """Connect and set up.

        Raise SensorError `autopilot_rate`, `autopilot_other_uid`, `autopilot_several_imus`, and what `AutopilotLink`
        and `refusals` raise.
        """
        self._on_samples = on_samples
        self._imus: dict[str, _ImuStream] = {
            mavlink_section(section).imu: _ImuStream(name, section) for name, section in sections.items()
        }
        self._first: dict[str, int] = {}
        (name, section), *_ = sections.items()
        line = mavlink_section(section)
        self.link = AutopilotLink(name, line.port, line.baud, self._take, patience=patience)
        with closing_on_failure(self.close):
            self.link.identify()
            for refusal in (*find_unfinished_change(self.link), *self._judge()):
                raise refusal
            self.link.wanted = frozenset(self._imus)
            for message, imu in self._imus.items():
                self.link.ask_for(message, imu.counter.interval_us)
            self._confirm_rates()
            for imu in self._imus.values():
                imu.settle()

    @property
    def corrected(self) -> Mapping[str, str]:
        """The changed settings: always empty, because an autopilot is only read."""
        return {}

    @property
    def sensors(self) -> Mapping[str, RecordedSensor]:
        """The configured IMUs by name."""
        return {imu.name: imu.description for imu in self._imus.values()}

    def start(self) -> None:
        """Start to pass samples to the consumer."""
        self.link.stream()

    def check(self, clock_s: float | None = None) -> None:
        """Raise an error that has occurred since the last call.

        It is one of `OwnPort.check`, `autopilot_armed` or `autopilot_parameter_changed`.
        """
        self.link.own_port.check(clock_s)

    def catch_up(self) -> None:
        """Wait for what has arrived (see `OwnPort.catch_up`)."""
        self.link.own_port.catch_up()

    def close(self) -> None:
        """End the thread and close the port."""
        self.link.close()

    def _judge(self) -> Iterator[SensorError]:
        for imu in self._imus.values():
            values, problems = check_parameters(self.link, imu.name, imu.section)
            yield from problems
            if not problems:
                imu.correction = read_correction(parameter_names(self.link.identity.firmware, imu.line), values)

    def _confirm_rates(self) -> None:
        """Raise SensorError unless every IMU's messages come at the requested rate with new readings."""
        imus = self._imus.values()
        self.link.own_port.wait(lambda: all(imu.has_enough_messages for imu in imus), MAX_RATE_WAIT_S)
        for imu in imus:
            requested_hz, intervals_us = imu.section.rate_hz, imu.intervals_us[1:]
            if imu.without_reading > imu.counter.number:
                raise SensorError(
                    "autopilot_no_reading",
                    f"sensors.{imu.name}: by its field fields_updated {imu.line.imu} contained no new reading in "
                    f"{imu.without_reading} of {imu.without_reading + max(imu.counter.number, 0)} messages",
                    "Lower rate_hz, or choose another message with mavlink.imu",
                )
            measured_hz = 1e6 * len(intervals_us) / sum(intervals_us) if intervals_us else 0.0
            if abs(measured_hz / requested_hz - 1.0) > RATE_TOLERANCE:
                raise SensorError(
                    "autopilot_rate",
                    f"sensors.{imu.name}: {imu.line.imu} was requested {requested_hz:g} times a second but comes "
                    f"{measured_hz:.1f} times",
                    "Lower rate_hz: the autopilot sends no faster than its main loop and its line allow",
                )

    def _take(self, messages: list[tuple[Any, bool]], host_time_s: float) -> None:
        """Pass on the samples of each IMU, on the reader's thread; before the start only measure the rates."""
        readings: dict[str, list[tuple[int, int, ImuReading]]] = {}
        for message, is_consecutive in messages:
            kind = message.get_type()
            numbered_reading = self._imus[kind].take(message, is_consecutive=is_consecutive)
            if numbered_reading is not None and self.link.own_port.streams:
                self._first.setdefault(kind, numbered_reading[0])
                readings.setdefault(kind, []).append(numbered_reading)
        for kind, imu_readings in readings.items():
            imu = self._imus[kind]
            self._on_samples(imu.name, imu.samples(imu_readings, self._first[kind], host_time_s))


def check_parameters(
    link: AutopilotLink, name: str, section: SensorSection
) -> tuple[Mapping[str, float], list[SensorError]]:
    """Return the parameter values of the configured IMU, and the problems for which it cannot be used."""
    line = mavlink_section(section)
    identity = link.identity
    names = parameter_names(identity.firmware, line)
    further_imus = names.others if line.imu == "HIGHRES_IMU" else ()
    parameters = link.parameters(names.needed, [*names.must_be_zero, *further_imus])
    values = {parameter_name: parameter.value for parameter_name, parameter in parameters.items()}
    problems = list(refusals(f"sensors.{name}", names, values))
    if line.uid is not None and identity.uid != line.uid:
        problems.append(
            SensorError(
                "autopilot_other_uid",
                f"sensors.{name}: the autopilot at {line.port} has the number {identity.uid or 'unknown'}, but the "
                f"configuration states {line.uid}",
                "Correct mavlink.uid in the configuration, or connect that autopilot",
            )
        )
    if any(values.get(parameter_name, 0.0) for parameter_name in further_imus):
        problems.append(
            SensorError(
                "autopilot_several_imus",
                f"sensors.{name}: this autopilot has several IMUs, and HIGHRES_IMU is of whichever it prefers just now",
                "Read them by SCALED_IMU, SCALED_IMU2 and SCALED_IMU3",
            )
        )
    return values, problems


def describe(name: str, section: SensorSection, *, provides_temperature: bool = True) -> RecordedSensor:
    """Return the description of the samples for a recording; before a connection a temperature is taken as provided."""
    integer = is_integer(mavlink_section(section).imu)
    stated = mavlink_section(section).temperature
    channels = [
        _channel(RATE, radians(section.range_deg_s), MILLI if integer else None),
        *thermometer_channels(thermometer_channel(DEGREES_PER_COUNT, 0.0) if provides_temperature else None, stated),
    ]
    if section.acceleration is not None:
        step = MILLI * STANDARD_GRAVITY_M_S2 if integer else None
        channels.append(_channel(ACCELERATION, range_m_s2(section.acceleration), step))
    return build_sensor(section, *channels, clock=name)


def mavlink(
    sections: Mapping[str, SensorSection], on_samples: OnSamples, *, patience: Patience = PATIENCE
) -> closing[MavlinkSource]:
    """Return the source of the IMUs at one port as a context manager. Raise the SensorErrors of `MavlinkSource`."""
    return closing(MavlinkSource(sections, on_samples, patience=patience))


def look(sections: Mapping[str, SensorSection]) -> Iterator[str | SensorError]:
    """Yield the autopilot's state and problems, without changes. Raise the SensorErrors of `AutopilotLink`."""
    (first, section), *_ = sections.items()
    line = mavlink_section(section)
    messages: list[Any] = []

    def collect(new_messages: list[tuple[Any, bool]], _: float) -> None:
        messages.extend(message for message, _ in new_messages)

    with closing(AutopilotLink(first, line.port, line.baud, collect)) as link:
        link.identify()
        yield f"{link.identity.words}, at {line.port}"
        yield from find_unfinished_change(link)
        for name, imu_section in sections.items():
            names = parameter_names(link.identity.firmware, mavlink_section(imu_section))
            values, problems = check_parameters(link, name, imu_section)
            yield from problems
            if not problems:
                yield from _describe_temperature(name, imu_section, link, messages)
                undone = [f"{parameter}: {values[parameter]:g}" for parameter in names.needed if parameter in values]
                yield f"{name}: {mavlink_section(imu_section).imu}; undone: {', '.join(undone)}"
                yield f"{name}: the low-pass delays rates by {1e3 * delay_s(names, values):.1f} ms"


def _describe_temperature(name: str, section: SensorSection, link: AutopilotLink, messages: list[Any]) -> Iterator[str]:
    """Yield a sentence on the source of the temperature, unless the first messages provide one."""
    line = mavlink_section(section)
    link.wanted = (line.imu,)
    for _ in range(MESSAGES):
        link.request(line.imu)
    done = link.own_port.wait(lambda: sum(message.get_type() == line.imu for message in messages) >= MESSAGES, WAIT_S)
    link.wanted = ()  # no interval was changed, so none has to be restored
    readings = [decode_reading(message) for message in messages if message.get_type() == line.imu]
    if not done or any("temperature" in reading.provided for reading in readings):
        return
    stated = line.temperature
    yield f"{name}: {line.imu} provides no temperature" + (
        f": {stated.stated_c:g} °C is stated, within {stated.stated_within_k:g} K"
        if stated is not None
        else f", and none is stated: U allows for a change of {UNKNOWN_CHANGE_K:g} K (mavlink.temperature.stated_c)"
    )


def mavlink_section(section: SensorSection) -> MavlinkSection:
    """Return the section that selects the IMU. Raise ValueError if there is none."""
    if section.mavlink is None:
        raise ValueError("the configuration lets no IMU of an autopilot pass without its section")
    return section.mavlink


def _channel(quantity: Quantity, end_of_scale: float, sent: float | None) -> Channel:
    """Return the channel of three axes; `sent` is the unit of the integers in messages, None for floats."""
    channel = fine_axes(quantity, end_of_scale)
    if sent is None:
        return channel
    widest = min(end_of_scale, RANGE_FRACTION * INT16_MAX * sent)
    return replace(channel, full_scale_counts=round(widest / channel.unit_per_count), step=TRUNCATION_STEPS * sent)
