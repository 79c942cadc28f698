"""The configured IMUs of one autopilot as a source of samples: rates asked for, corrections undone."""

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
from rig.data.recording.channel import Channel, of_thermometer, stamped
from rig.data.recording.recorded_sensor import UNKNOWN_CHANGE_K, RecordedSensor, range_m_s2, recorded_as
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.sensors.errors import SensorError
from rig.sensors.mavlink.corrections import Correction, correction_of, delay_s, names_of, refusals
from rig.sensors.mavlink.counting import ImuCounter
from rig.sensors.mavlink.link import Link
from rig.sensors.mavlink.readings import CUT_STEPS, INT16_MAX, MILLI, UNIT_US, Field, Reading, is_cut, reading_of
from rig.sensors.mavlink.writing import unfinished
from rig.sensors.own_port import closed_on_failure
from rig.sensors.scales import DEGREES_PER_COUNT, fine_axes, thermometer_channels
from rig.sensors.silence import USUAL, Patience
from rig.sensors.source import OnSamples
from rig.sensors.thermometer import Thermometer

RATE_LOOK = 40  # messages by which the rate is judged
RATE_WAIT_S = 20.0
RATE_TOLERANCE = 0.05
ASKED_FOR, ASKED_S = 10, 2.0  # messages that a look asks for one by one, and how long it waits for them
WIDEST = 0.98  # of what 16 bits hold, where undoing a correction may have shifted the end of the scale


class _Imu:
    """One configured IMU of the stream: its correction, its numbers, the intervals of its first messages.

    `without_reading` counts the messages that hold no new rate, or no new force where that is recorded.
    """

    def __init__(self, name: str, section: SensorSection) -> None:
        self.name, self.section, self.line = name, section, line_of(section)
        self.described = describe(name, section)
        self.correction = Correction()
        self.counter = ImuCounter(name, 1e6 / section.rate_hz, UNIT_US[self.line.imu])
        self.thermometer = Thermometer(f"sensors.{name}: the autopilot at {self.line.port}", section.rate_hz)
        self.intervals_us: list[int] = []
        self.without_reading = 0
        self._needed: frozenset[Field] = frozenset(("rate", "force") if self._has_force else ("rate",))

    @property
    def _has_force(self) -> bool:
        return self.section.acceleration is not None

    @property
    def looked_at(self) -> bool:
        """Whether enough messages came to judge them."""
        return max(len(self.intervals_us), self.without_reading) >= RATE_LOOK

    def settle(self) -> None:
        """Describe the samples by what the first messages have provided."""
        self.described = describe(self.name, self.section, provides_temperature=self.thermometer.provides)

    def take(self, message: Any, *, whole: bool) -> tuple[int, int, Reading] | None:
        """Number, time and reading; None of a copy. `whole`: none was lost since the message before."""
        reading = reading_of(message)
        if not self.thermometer.provides:
            self.thermometer.last_c = reading.temperature_c
        if not self._needed <= reading.provided:
            self.without_reading += 1
            return None
        before_us, first = self.counter.time_us, self.counter.number < 0
        if not self.counter.count(reading.time):
            return None
        if whole and not first and len(self.intervals_us) < RATE_LOOK:
            self.intervals_us.append(self.counter.time_us - before_us)
        return self.counter.number, self.counter.time_us, reading

    def samples(self, taken: list[tuple[int, int, Reading]], first: int, host_time_s: float) -> NDArray[Any]:
        """Samples of the readings, numbered from the number `first`."""
        numbers, times_us, readings = zip(*taken, strict=True)
        samples = stamped(self.described.sample_dtype, np.array(numbers) - first, np.array(times_us), host_time_s)
        if self.thermometer.provides and self.described.measures(TEMPERATURE):
            temperatures_c = self.thermometer.read(np.array([each.temperature_c for each in readings]))
            self.described.channel(TEMPERATURE).fill(samples, temperatures_c)
        rates = self.correction.raw_rate(np.array([each.rate_rad_s for each in readings]))
        self.described.channel(RATE).fill(samples, rates)
        if self.described.measures(ACCELERATION):
            forces = self.correction.raw_force(np.array([each.force_m_s2 for each in readings]))
            self.described.channel(ACCELERATION).fill(samples, forces)
        return samples


class MavlinkSource:
    """The autopilot's configured IMUs, set up: parameters read, rates asked for and seen to come."""

    def __init__(
        self, sections: Mapping[str, SensorSection], on_samples: OnSamples, *, patience: Patience = USUAL
    ) -> None:
        """Raises SensorError as `Link` and `refusals`; autopilot_other_uid, autopilot_several_imus, autopilot_rate."""
        self._on_samples = on_samples
        self._imus: dict[str, _Imu] = {line_of(section).imu: _Imu(name, section) for name, section in sections.items()}
        self._first: dict[str, int] = {}
        (name, section), *_ = sections.items()
        line = line_of(section)
        self.link = Link(name, line.port, line.baud, self._take, patience=patience)
        with closed_on_failure(self.close):
            self.link.identify()
            for refusal in (*unfinished(self.link), *self._judge()):
                raise refusal
            self.link.wanted = frozenset(self._imus)
            for message, imu in self._imus.items():
                self.link.ask_for(message, imu.counter.interval_us)
            self._see_rates()
            for imu in self._imus.values():
                imu.settle()

    @property
    def corrected(self) -> Mapping[str, str]:
        """Settings that were changed: none, to read an autopilot."""
        return {}

    @property
    def sensors(self) -> Mapping[str, RecordedSensor]:
        """The configured IMUs by name."""
        return {imu.name: imu.described for imu in self._imus.values()}

    def start(self) -> None:
        """Start to hand samples on, as of `SampleSource`."""
        self.link.own_port.stream()

    def check(self, clock_s: float | None = None) -> None:
        """Check the autopilot, as of `SampleSource`. Raises SensorError as `OwnPort.check`, and `autopilot_armed`."""
        self.link.own_port.check(clock_s)

    def close(self) -> None:
        """Ends the thread and closes the port."""
        self.link.close()

    def _judge(self) -> Iterator[SensorError]:
        for imu in self._imus.values():
            found, problems = judged(self.link, imu.name, imu.section)
            yield from problems
            if not problems:
                imu.correction = correction_of(names_of(self.link.known.firmware, imu.line), found)

    def _see_rates(self) -> None:
        imus = self._imus.values()
        self.link.own_port.wait(lambda: all(imu.looked_at for imu in imus), RATE_WAIT_S)
        for imu in imus:
            asked_hz, intervals_us = imu.section.rate_hz, imu.intervals_us[1:]
            if imu.without_reading > imu.counter.number:
                raise SensorError(
                    "autopilot_no_reading",
                    f"sensors.{imu.name}: by its field fields_updated {imu.line.imu} held no new reading in "
                    f"{imu.without_reading} of {imu.without_reading + max(imu.counter.number, 0)} messages",
                    "Lower rate_hz, or choose another message with mavlink.imu",
                )
            came_hz = 1e6 * len(intervals_us) / sum(intervals_us) if intervals_us else 0.0
            if abs(came_hz / asked_hz - 1.0) > RATE_TOLERANCE:
                raise SensorError(
                    "autopilot_rate",
                    f"sensors.{imu.name}: {imu.line.imu} was asked for {asked_hz:g} times a second and comes "
                    f"{came_hz:.1f} times",
                    "Lower rate_hz: the autopilot sends no faster than its main loop and its line allow",
                )

    def _take(self, messages: list[tuple[Any, bool]], host_time_s: float) -> None:
        """Hand over samples of each IMU, on the reader's thread; before the start only the rates are seen."""
        taken: dict[str, list[tuple[int, int, Reading]]] = {}
        for message, whole in messages:
            kind = message.get_type()
            found = self._imus[kind].take(message, whole=whole)
            if found is not None and self.link.own_port.streams:
                self._first.setdefault(kind, found[0])
                taken.setdefault(kind, []).append(found)
        for kind, each in taken.items():
            imu = self._imus[kind]
            self._on_samples(imu.name, imu.samples(each, self._first[kind], host_time_s))


def judged(link: Link, name: str, section: SensorSection) -> tuple[Mapping[str, float], list[SensorError]]:
    """The parameters' values of the configured IMU, and what speaks against reading it."""
    line = line_of(section)
    known = link.known
    names = names_of(known.firmware, line)
    several = names.others if line.imu == "HIGHRES_IMU" else ()
    asked = link.parameters(names.needed, [*names.off, *several])
    found = {each: parameter.value for each, parameter in asked.items()}
    problems = list(refusals(f"sensors.{name}", names, found))
    if line.uid is not None and known.uid != line.uid:
        problems.append(
            SensorError(
                "autopilot_other_uid",
                f"sensors.{name}: the autopilot at {line.port} has the number {known.uid or 'unknown'}, the "
                f"configuration says {line.uid}",
                "Correct mavlink.uid in the configuration, or connect that autopilot",
            )
        )
    if any(found.get(each, 0.0) for each in several):
        problems.append(
            SensorError(
                "autopilot_several_imus",
                f"sensors.{name}: this autopilot has several IMUs, and HIGHRES_IMU is of whichever it prefers just now",
                "Read them by SCALED_IMU, SCALED_IMU2 and SCALED_IMU3",
            )
        )
    return found, problems


def describe(name: str, section: SensorSection, *, provides_temperature: bool = True) -> RecordedSensor:
    """What a reader of its samples must know; without a connection a temperature counts as provided."""
    cut = is_cut(line_of(section).imu)
    stated = line_of(section).temperature
    channels = [
        _channel(RATE, radians(section.range_deg_s), MILLI if cut else None),
        *thermometer_channels(of_thermometer(DEGREES_PER_COUNT, 0.0) if provides_temperature else None, stated),
    ]
    if section.acceleration is not None:
        step = MILLI * STANDARD_GRAVITY_M_S2 if cut else None
        channels.append(_channel(ACCELERATION, range_m_s2(section.acceleration), step))
    return recorded_as(section, *channels, clock=name)


def mavlink(
    sections: Mapping[str, SensorSection], on_samples: OnSamples, *, patience: Patience = USUAL
) -> closing[MavlinkSource]:
    """The IMUs at one port for the length of the `with` block. Raises SensorError as `MavlinkSource`."""
    return closing(MavlinkSource(sections, on_samples, patience=patience))


def look(sections: Mapping[str, SensorSection]) -> Iterator[str | SensorError]:
    """What there is and what is wrong with it; nothing is changed. Raises SensorError as `Link`."""
    (first, section), *_ = sections.items()
    line = line_of(section)
    heard: list[Any] = []

    def hear(messages: list[tuple[Any, bool]], _: float) -> None:
        heard.extend(message for message, _ in messages)

    with closing(Link(first, line.port, line.baud, hear)) as link:
        link.identify()
        yield f"{link.known.words}, at {line.port}"
        yield from unfinished(link)
        for name, each in sections.items():
            names = names_of(link.known.firmware, line_of(each))
            found, problems = judged(link, name, each)
            yield from problems
            if not problems:
                yield from _of_the_temperature(name, each, link, heard)
                undone = [f"{each}: {found[each]:g}" for each in names.needed if each in found]
                yield f"{name}: {line_of(each).imu}; undone: {', '.join(undone)}"
                yield f"{name}: the low-pass delays rates by {1e3 * delay_s(names, found):.1f} ms"


def _of_the_temperature(name: str, section: SensorSection, link: Link, heard: list[Any]) -> Iterator[str]:
    """How the temperature is known, unless the first messages that it is asked for provide one."""
    line = line_of(section)
    link.wanted = (line.imu,)
    for _ in range(ASKED_FOR):
        link.request(line.imu)
    came = link.own_port.wait(lambda: sum(each.get_type() == line.imu for each in heard) >= ASKED_FOR, ASKED_S)
    link.wanted = ()  # nothing was changed that is to be as before
    readings = [reading_of(each) for each in heard if each.get_type() == line.imu]
    if not came or any("temperature" in reading.provided for reading in readings):
        return
    stated = line.temperature
    yield f"{name}: {line.imu} provides no temperature" + (
        f": {stated.stated_c:g} °C is stated, within {stated.stated_within_k:g} K"
        if stated is not None
        else f", and none is stated: U allows for a change of {UNKNOWN_CHANGE_K:g} K (mavlink.temperature.stated_c)"
    )


def line_of(section: SensorSection) -> MavlinkSection:
    """The section that says which IMU it is."""
    if section.mavlink is None:
        raise ValueError("the configuration lets no IMU of an autopilot pass without its section")
    return section.mavlink


def _channel(quantity: Quantity, end_of_scale: float, sent: float | None) -> Channel:
    """The channel of three axes; `sent` is the unit of the whole numbers that are sent, None where none are."""
    channel = fine_axes(quantity, end_of_scale)
    if sent is None:
        return channel
    widest = min(end_of_scale, WIDEST * INT16_MAX * sent)
    return replace(channel, full_scale_counts=round(widest / channel.unit_per_count), step=CUT_STEPS * sent)
