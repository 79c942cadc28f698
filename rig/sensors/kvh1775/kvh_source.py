"""A configured KVH 1775 as a source of samples: set up for the run, with its messages converted to samples."""

from collections.abc import Iterator, Mapping
from contextlib import closing
from math import radians
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.config.sensors.sensor_sections import OwnPortSection, SensorSection, field_name
from rig.data.not_provided import RANGE_C, Absent
from rig.data.quantity import ACCELERATION, FIELD, RATE, TEMPERATURE
from rig.data.recording.channel import stamp_samples, thermometer_channel
from rig.data.recording.recorded_sensor import RecordedSensor, build_sensor, range_m_s2
from rig.estimation.arrays import Array
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.sensors.errors import SensorError
from rig.sensors.kvh1775.format_c_field import READING_MESSAGES, MagneticFieldReader
from rig.sensors.kvh1775.kvh_driver import Kvh1775
from rig.sensors.kvh1775.kvh_settings import Kvh1775Settings, corrections, refusals
from rig.sensors.own_port import closing_on_failure
from rig.sensors.port_silence import PATIENCE, Patience
from rig.sensors.sample_source import OnSamples
from rig.sensors.scales import DEGREES_PER_COUNT, FIELD_FULL_SCALE_T, FULL_SCALE_COUNTS, fine_axes
from rig.sensors.thermometer import Thermometer

# ICD 56-0298 Rev. B, section 5: bits 0 to 2 of a message's status say that the axes of the gyroscope are valid, bits 4
# to 6 those of the accelerometer. Temperature and field have no such bits.
NOT_PROVIDED: Mapping[str, Absent] = MappingProxyType(
    {"rate": Absent(bits=0x07), "force": Absent(bits=0x70), "temperature": Absent(within=RANGE_C)}
)
MAX_INVALID_S = 1.0  # of messages in a row that are marked invalid


class Kvh1775Source:
    """An instrument, set up for a run. A message with an axis marked invalid counts as lost."""

    def __init__(
        self, name: str, section: SensorSection, on_samples: OnSamples, *, patience: Patience = PATIENCE
    ) -> None:
        """Connect and set up the instrument. Raise SensorError `kvh_other_serial_number`, and those of `refusals`."""
        self._name, self._on_samples = name, on_samples
        line = _port_section(section)
        self._required = make_settings(section)
        self._description = describe(name, section)
        self._invalid_run = 0
        self._thermometer = Thermometer(f"sensors.{name}: the KVH 1775 on {line.port}", section.rate_hz)
        self._first: int | None = None  # number of the first message that became a sample
        self._field_name, self._field = field_name(name), describe_field(name, section)
        self._field_reader = MagneticFieldReader(FIELD_FULL_SCALE_T / FULL_SCALE_COUNTS, FULL_SCALE_COUNTS)
        self._driver = Kvh1775(name, line.port, line.baud, self._take, patience=patience)
        with closing_on_failure(self.close):
            for refusal in judge(self._driver, name, section):
                raise refusal
            stored = self._driver.settings
            changes = corrections(stored, self._required)
            self._corrected = {setting: stored[setting] for setting in changes}
            self._driver.correct(changes)
            self._driver.run()
            self._driver.test()

    @property
    def corrected(self) -> Mapping[str, str]:
        """The settings that were corrected, with their former values."""
        return self._corrected

    @property
    def sensors(self) -> Mapping[str, RecordedSensor]:
        """The instrument's inertial sensor and, in format C, its magnetometer, by name."""
        field = {} if self._field is None else {self._field_name: self._field}
        return {self._name: self._description, **field}

    def start(self) -> None:
        """Start to pass samples to the consumer."""
        self._driver.start(self._required)

    def check(self, clock_s: float | None = None) -> None:
        """Raise an error that has occurred since the last call: as `OwnPort.check` does, or `kvh_axis_invalid`."""
        self._driver.own_port.check(clock_s)

    def catch_up(self) -> None:
        """Wait until all data that have arrived by now are taken (see `OwnPort.catch_up`)."""
        self._driver.own_port.catch_up()

    def close(self) -> None:
        """End the thread and close the port."""
        self._driver.close()

    def _take(self, messages: NDArray[Any], numbers: NDArray[Any], times_us: NDArray[Any], host_time_s: float) -> None:
        """Pass valid samples on, on the reader's thread. Samples of the magnetic field have no validity bits."""
        if self._field is not None:
            fields = self._field_reader.feed(messages, numbers, times_us, host_time_s)
            if len(fields):
                self._on_samples(self._field_name, fields)
        temperatures_c, description = self._thermometer.read(self._temperatures_c(messages)), self._description
        valid = NOT_PROVIDED["rate"].mask_provided(messages["rotation"], messages["status"])
        if description.measures(ACCELERATION):
            valid &= NOT_PROVIDED["force"].mask_provided(messages["acceleration_g"], messages["status"])
        self._watch(messages, valid)
        valid &= np.isfinite(temperatures_c)
        if not valid.any():
            return
        if self._first is None:
            self._first = int(numbers[valid][0])
        samples = stamp_samples(description.sample_dtype, numbers[valid] - self._first, times_us[valid], host_time_s)
        description.channel(TEMPERATURE).fill(samples, temperatures_c[valid])
        rate_rad_s = messages["rotation"][valid].astype(np.float64)
        if self._required.rotation == "delta":
            rate_rad_s *= self._required.rate_hz  # per second of its own clock, which determines its intervals
        description.channel(RATE).fill(samples, rate_rad_s)
        if description.measures(ACCELERATION):
            force_m_s2 = messages["acceleration_g"][valid].astype(np.float64) * STANDARD_GRAVITY_M_S2
            description.channel(ACCELERATION).fill(samples, force_m_s2)
        self._on_samples(self._name, samples)

    def _watch(self, messages: NDArray[Any], valid: NDArray[np.bool_]) -> None:
        """Raise SensorError `kvh_axis_invalid` if all messages have been invalid for `MAX_INVALID_S`."""
        good = np.flatnonzero(valid)
        self._invalid_run = len(valid) - 1 - int(good[-1]) if len(good) else self._invalid_run + len(valid)
        if self._invalid_run > MAX_INVALID_S * self._required.rate_hz:
            raise SensorError(
                "kvh_axis_invalid",
                f"sensors.{self._name}: the KVH 1775 has called its readings invalid for {MAX_INVALID_S:g} s, status "
                f"0x{int(messages['status'][-1]):02x} where 0x77 is good",
                "Wait until it is warm, look at its built-in test with `rig kvh info`; if the problem persists, ask "
                "its maker",
            )

    def _temperatures_c(self, messages: NDArray[Any]) -> Array:
        """Return the temperatures (n,), °C, NaN for messages without one, which are three of four in format C."""
        if self._required.message == "C":
            celsius = np.where(messages["sequence"] % 4 == 0, messages["fourth"].astype(np.float64), np.nan)
        else:
            celsius = messages["temperature"] * DEGREES_PER_COUNT
        return np.where(NOT_PROVIDED["temperature"].mask_provided(celsius), celsius, np.nan)


def make_settings(section: SensorSection) -> Kvh1775Settings:
    """Return the settings that a configured sensor needs."""
    line = _port_section(section)
    return Kvh1775Settings(section.rate_hz, line.message, line.rotation)


def judge(driver: Kvh1775, name: str, section: SensorSection) -> Iterator[SensorError]:
    """Yield reasons not to use the instrument: another serial number, or settings that only the owner may change."""
    if driver.serial_number != section.serial_number:
        yield SensorError(
            "kvh_other_serial_number",
            f"sensors.{name}: the KVH 1775 on {driver.port} has serial number {driver.serial_number}, but the "
            f"configuration states {section.serial_number}",
            "Correct serial_number in the configuration, or connect that instrument",
        )
    yield from refusals(f"sensors.{name}", driver.settings)


def describe(name: str, section: SensorSection) -> RecordedSensor:
    """Return the description of the instrument's samples for a recording."""
    channels = [fine_axes(RATE, radians(section.range_deg_s)), thermometer_channel(DEGREES_PER_COUNT, 0.0)]
    if section.acceleration is not None:
        channels.append(fine_axes(ACCELERATION, range_m_s2(section.acceleration)))
    return build_sensor(section, *channels, clock=name)


def describe_field(name: str, section: SensorSection) -> RecordedSensor | None:
    """Return the magnetometer's description for a recording; None if the messages have no field."""
    if _port_section(section).message != "C":
        return None
    field = fine_axes(FIELD, FIELD_FULL_SCALE_T)  # the ICD does not state its range
    part, rate_hz = "kvh1775_magnetometer", section.rate_hz / READING_MESSAGES
    return build_sensor(section, field, part=part, rate_hz=rate_hz, clock=name)


def kvh1775(
    name: str, section: SensorSection, on_samples: OnSamples, *, patience: Patience = PATIENCE
) -> closing[Kvh1775Source]:
    """Return the instrument's source as a context manager. Raise the SensorErrors of `Kvh1775Source`."""
    return closing(Kvh1775Source(name, section, on_samples, patience=patience))


def look(name: str, section: SensorSection) -> Iterator[str | SensorError]:
    """Yield the instrument's state and problems, without changes of its memory. Raise as `Kvh1775` does."""
    line = _port_section(section)
    with closing(Kvh1775(name, line.port, line.baud)) as driver:
        yield f"KVH 1775 at {line.port}: serial number {driver.serial_number}"
        for setting, value in corrections(driver.settings, make_settings(section)).items():
            yield f"{setting} is {driver.settings[setting]}; a run sets it to {value}"
        yield from judge(driver, name, section)
        driver.run()
        yield f"built-in test: {driver.test().values.hex(' ')}"


def _port_section(section: SensorSection) -> OwnPortSection:
    if section.serial is None:
        raise ValueError("the configuration lets no sensor with a port of its own pass without one")
    return section.serial
