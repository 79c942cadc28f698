"""A configured KVH 1775 as a source of samples: set up as the run needs it, its messages made samples."""

from collections.abc import Iterator, Mapping
from contextlib import closing
from math import radians
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.config.sensors.sensor_sections import OwnPortSection, SensorSection, field_name
from rig.data.not_provided import POSSIBLE_C, Absent
from rig.data.quantity import ACCELERATION, FIELD, RATE, TEMPERATURE
from rig.data.recording.channel import of_thermometer, stamped
from rig.data.recording.recorded_sensor import RecordedSensor, range_m_s2, recorded_as
from rig.estimation.arrays import Array
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.sensors.errors import SensorError
from rig.sensors.kvh1775.driver import Kvh1775
from rig.sensors.kvh1775.field import MESSAGES_EACH, FieldReader
from rig.sensors.kvh1775.settings import Wanted, corrections, refusals
from rig.sensors.own_port import closed_on_failure
from rig.sensors.scales import DEGREES_PER_COUNT, FIELD_FULL_SCALE_T, FULL_SCALE_COUNTS, fine_axes
from rig.sensors.silence import USUAL, Patience
from rig.sensors.source import OnSamples
from rig.sensors.thermometer import Thermometer

# ICD 56-0298 Rev. B, section 5: bits 0 to 2 of a message's status say that the axes of the gyroscope are valid, bits 4
# to 6 those of the accelerometer. Nothing says of temperature and field whether they are.
NOT_PROVIDED: Mapping[str, Absent] = MappingProxyType(
    {"rate": Absent(bits=0x07), "force": Absent(bits=0x70), "temperature": Absent(within=POSSIBLE_C)}
)
INVALID_S = 1.0  # of messages in a row that say of themselves they are wrong


class Kvh1775Source:
    """An instrument that is set up.

    A message that says of itself an axis is invalid is no sample: it counts as lost.
    """

    def __init__(self, name: str, section: SensorSection, on_samples: OnSamples, *, patience: Patience = USUAL) -> None:
        """Raises SensorError as `Kvh1775`, `refusals`, and `kvh_other_serial_number`."""
        self._name, self._on_samples = name, on_samples
        line = _line_of(section)
        self._wanted = wanted_of(section)
        self._described = describe(name, section)
        self._invalid_in_a_row = 0
        self._thermometer = Thermometer(f"sensors.{name}: the KVH 1775 on {line.port}", section.rate_hz)
        self._first: int | None = None  # number of the first message that became a sample
        self._field_name, self._field = field_name(name), describe_field(name, section)
        self._field_reader = FieldReader(FIELD_FULL_SCALE_T / FULL_SCALE_COUNTS, FULL_SCALE_COUNTS)
        self._driver = Kvh1775(name, line.port, line.baud, self._take, patience=patience)
        with closed_on_failure(self.close):
            for refusal in judge(self._driver, name, section):
                raise refusal
            found = self._driver.settings
            changes = corrections(found, self._wanted)
            self._corrected = {setting: found[setting] for setting in changes}
            self._driver.correct(changes)
            self._driver.run()
            self._driver.test()

    @property
    def corrected(self) -> Mapping[str, str]:
        """Settings that were not as the run needs them: name → what was there."""
        return self._corrected

    @property
    def sensors(self) -> Mapping[str, RecordedSensor]:
        """The one there is, and its magnetometer in format C."""
        field = {} if self._field is None else {self._field_name: self._field}
        return {self._name: self._described, **field}

    def start(self) -> None:
        """Start the instrument's samples, as of `SampleSource`."""
        self._driver.start(self._wanted)

    def check(self, clock_s: float | None = None) -> None:
        """Check the instrument, as of `SampleSource`. Raises SensorError as `OwnPort.check`, and `kvh_axis_invalid`."""
        self._driver.own_port.check(clock_s)

    def close(self) -> None:
        """Ends the thread and closes the port."""
        self._driver.close()

    def _take(self, messages: NDArray[Any], numbers: NDArray[Any], times_us: NDArray[Any], host_time_s: float) -> None:
        """Hand over what is valid, as samples, on the reader's thread. Nothing says of the field whether it is."""
        if self._field is not None:
            fields = self._field_reader.feed(messages, numbers, times_us, host_time_s)
            if len(fields):
                self._on_samples(self._field_name, fields)
        temperatures_c, described = self._thermometer.read(self._temperatures_c(messages)), self._described
        valid = NOT_PROVIDED["rate"].provided(messages["rotation"], messages["status"])
        if described.measures(ACCELERATION):
            valid &= NOT_PROVIDED["force"].provided(messages["acceleration_g"], messages["status"])
        self._watch(messages, valid)
        valid &= np.isfinite(temperatures_c)
        if not valid.any():
            return
        if self._first is None:
            self._first = int(numbers[valid][0])
        samples = stamped(described.sample_dtype, numbers[valid] - self._first, times_us[valid], host_time_s)
        described.channel(TEMPERATURE).fill(samples, temperatures_c[valid])
        rate_rad_s = messages["rotation"][valid].astype(np.float64)
        if self._wanted.rotation == "delta":
            rate_rad_s *= self._wanted.rate_hz  # its own seconds, in which it counts its intervals
        described.channel(RATE).fill(samples, rate_rad_s)
        if described.measures(ACCELERATION):
            force_m_s2 = messages["acceleration_g"][valid].astype(np.float64) * STANDARD_GRAVITY_M_S2
            described.channel(ACCELERATION).fill(samples, force_m_s2)
        self._on_samples(self._name, samples)

    def _watch(self, messages: NDArray[Any], valid: NDArray[np.bool_]) -> None:
        good = np.flatnonzero(valid)
        self._invalid_in_a_row = len(valid) - 1 - int(good[-1]) if len(good) else self._invalid_in_a_row + len(valid)
        if self._invalid_in_a_row > INVALID_S * self._wanted.rate_hz:
            raise SensorError(
                "kvh_axis_invalid",
                f"sensors.{self._name}: the KVH 1775 has called its readings invalid for {INVALID_S:g} s, status "
                f"0x{int(messages['status'][-1]):02x} where 0x77 is good",
                "Wait until it is warm, look at its built-in test with `rig kvh info`; if it stays, ask its maker",
            )

    def _temperatures_c(self, messages: NDArray[Any]) -> Array:
        """(n,) °C, NaN in messages that hold none: format C says it in every fourth."""
        if self._wanted.message == "C":
            celsius = np.where(messages["sequence"] % 4 == 0, messages["fourth"].astype(np.float64), np.nan)
        else:
            celsius = messages["temperature"] * DEGREES_PER_COUNT
        return np.where(NOT_PROVIDED["temperature"].provided(celsius), celsius, np.nan)


def wanted_of(section: SensorSection) -> Wanted:
    """What a configured sensor has to be set to."""
    line = _line_of(section)
    return Wanted(section.rate_hz, line.message, line.rotation)


def judge(driver: Kvh1775, name: str, section: SensorSection) -> Iterator[SensorError]:
    """What speaks against using the instrument: another number than configured, settings nobody may just change."""
    if driver.serial_number != section.serial_number:
        yield SensorError(
            "kvh_other_serial_number",
            f"sensors.{name}: the KVH 1775 on {driver.port} has serial number {driver.serial_number}, the "
            f"configuration says {section.serial_number}",
            "Correct serial_number in the configuration, or connect that instrument",
        )
    yield from refusals(f"sensors.{name}", driver.settings)


def describe(name: str, section: SensorSection) -> RecordedSensor:
    """What a reader of its samples must know."""
    channels = [fine_axes(RATE, radians(section.range_deg_s)), of_thermometer(DEGREES_PER_COUNT, 0.0)]
    if section.acceleration is not None:
        channels.append(fine_axes(ACCELERATION, range_m_s2(section.acceleration)))
    return recorded_as(section, *channels, clock=name)


def describe_field(name: str, section: SensorSection) -> RecordedSensor | None:
    """How a recording describes the instrument's magnetometer; None where its messages have no field."""
    if _line_of(section).message != "C":
        return None
    field = fine_axes(FIELD, FIELD_FULL_SCALE_T)  # the ICD says nothing of its own range
    part, rate_hz = "kvh1775_magnetometer", section.rate_hz / MESSAGES_EACH
    return recorded_as(section, field, part=part, rate_hz=rate_hz, clock=name)


def kvh1775(
    name: str, section: SensorSection, on_samples: OnSamples, *, patience: Patience = USUAL
) -> closing[Kvh1775Source]:
    """The instrument for the length of the `with` block. Raises SensorError as `Kvh1775Source`."""
    return closing(Kvh1775Source(name, section, on_samples, patience=patience))


def look(name: str, section: SensorSection) -> Iterator[str | SensorError]:
    """What there is, and what is wrong with it; nothing in its memory is changed. Raises SensorError as `Kvh1775`."""
    line = _line_of(section)
    with closing(Kvh1775(name, line.port, line.baud)) as driver:
        yield f"KVH 1775 at {line.port}: serial number {driver.serial_number}"
        for setting, value in corrections(driver.settings, wanted_of(section)).items():
            yield f"{setting} is {driver.settings[setting]}; a run sets it to {value}"
        yield from judge(driver, name, section)
        driver.run()
        yield f"built-in test: {driver.test().values.hex(' ')}"


def _line_of(section: SensorSection) -> OwnPortSection:
    if section.serial is None:
        raise ValueError("the configuration lets no sensor with a port of its own pass without one")
    return section.serial
