"""A device that prints lines on a pseudo-terminal: its samples come whole, and whatever is wrong with it has a name."""

from collections.abc import Iterator
from itertools import chain, count, repeat
from typing import Any, get_args

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import BaseModel

from rig.config.sensors.lines_section import (
    UNDETERMINED,
    LineAccelerationSection,
    LineFieldSection,
    LineRateSection,
    LineScalarSection,
    LineTimeSection,
)
from rig.config.units import UNITS
from rig.data.quantity import ACCELERATION, FIELD, PRESSURE, RATE, SCALARS, TEMPERATURE
from rig.sensors.errors import SensorError
from rig.sensors.lines.lines_source import describe, lines, look
from rig.sensors.port_silence import Patience
from rig.sensors.sample_source import SampleSource
from support.processes.waiting import wait_for
from support.wires.printed_lines import SEVEN, lines_section, pty_printing, sensor_section

BOOT = b"ets Jul 29 2019\r\nrst:0x1\r\n"


def printed(number: int) -> bytes:
    return b"%d,1.5,-2.25,3,0.5,-0.25,1\r\n" % (number * 10_000)


def stream(begin: int = 0) -> Iterator[bytes]:
    return (printed(number) for number in count(begin))


class Taken:
    """What a source handed on."""

    def __init__(self) -> None:
        self.parts: list[NDArray[Any]] = []

    def __call__(self, sensor: str, samples: NDArray[Any]) -> None:
        self.parts.append(samples)

    def wait(self, source: SampleSource, samples: int) -> NDArray[Any]:
        wait_for(lambda: sum(map(len, self.parts)) >= samples, f"{samples} samples", meanwhile=source.check)
        return np.concatenate(self.parts)


@pytest.mark.slow
def test_samples_come_in_si_units_and_boot_text_is_no_sample() -> None:
    taken = Taken()
    with pty_printing(chain([BOOT], stream())) as (port, _), lines("imu", sensor_section(port), taken) as source:
        source.start()
        samples = taken.wait(source, 50)
        described = source.sensors["imu"]
    assert (samples["sequence"] == np.arange(len(samples))).all()
    assert (np.diff(samples["board_time_us"].astype(int)) == 10_000).all()
    assert described.channel(RATE).values(samples)[0] == pytest.approx(np.radians([1.5, -2.25, 3]), abs=1e-8)
    assert described.channel(ACCELERATION).values(samples)[0] == pytest.approx(
        np.array([0.5, -0.25, 1]) * 9.80665, abs=1e-6
    )
    thermometer = described.channel(TEMPERATURE)
    assert (thermometer.values(samples)[0], thermometer.resolution) == (22.0, 5.0), "it has none: as it is stated"


@pytest.mark.slow
def test_a_device_that_prints_every_line_twice_has_each_sample_once() -> None:
    taken, twice = Taken(), (line for line in stream() for _ in range(2))
    with pty_printing(twice) as (port, _), lines("imu", sensor_section(port), taken) as source:
        source.start()
        samples = taken.wait(source, 50)
    assert (np.diff(samples["sequence"].astype(int)) == 1).all()
    assert (np.diff(samples["board_time_us"].astype(int)) == 10_000).all()


@pytest.mark.slow
def test_columns_without_axes_are_sensors_of_their_own_on_the_same_clock() -> None:
    columns = (*SEVEN[:4], "air", "room", "-")
    scalars = {"air": {"unit": "hPa", "scale": 100}, "room": {"unit": "K", "scale": 1000}}
    section: dict[str, Any] = {"columns": columns, "scalars": scalars, "acceleration": None}
    taken: dict[str, NDArray[Any]] = {}

    def take(sensor: str, samples: NDArray[Any]) -> None:
        taken.setdefault(sensor, samples)

    with pty_printing(stream()) as (port, _), lines("imu", sensor_section(port, **section), take) as source:
        source.start()
        wait_for(lambda: len(taken) == 3, "samples of all three", meanwhile=source.check)
        described = source.sensors
    air, room = described["imu_air"], described["imu_room"]
    assert not air.has_axes and (air.part, air.clock, room.part) == ("lines_barometer", "imu", "lines_thermometer")
    assert air.channel(PRESSURE).values(taken["imu_air"]) == pytest.approx(5000.0)
    assert room.channel(TEMPERATURE).values(taken["imu_room"]) == pytest.approx(-250 - 273.15)
    assert (taken["imu_air"]["board_time_us"] == taken["imu"]["board_time_us"]).all()


@pytest.mark.parametrize(
    ("columns", "scalars", "complaint"),
    [
        (SEVEN, {"air": {"unit": "hPa"}}, "no column air"),
        ((*SEVEN, "air"), {}, "no such column"),
        ((*SEVEN, "field"), {"field": {"unit": "hPa"}}, "cannot name a scalar"),
        ((*SEVEN, "air"), {"air": {"unit": "torr"}}, "scalars.air.unit"),
    ],
)
def test_a_column_that_nothing_describes_is_refused(columns: Any, scalars: Any, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        lines_section(columns=columns, scalars=scalars)


def units_of(section: type[BaseModel]) -> set[str]:
    """What the units that a section allows are units of."""
    return {UNITS[unit].quantity for unit in get_args(section.model_fields["unit"].annotation) if unit != UNDETERMINED}


def test_every_unit_of_a_column_is_of_a_quantity_that_is_known() -> None:
    assert units_of(LineScalarSection) == {scalar.name for scalar in SCALARS}
    assert units_of(LineRateSection) == {RATE.name} and units_of(LineAccelerationSection) == {ACCELERATION.name}
    assert units_of(LineFieldSection) == {FIELD.name} and units_of(LineTimeSection) == {"time"}


def test_a_device_that_prints_no_temperature_has_one_that_is_stated() -> None:
    assert describe("imu", sensor_section("/dev/null")).temperature_stated
    printed = lines_section(columns=(*SEVEN, "temperature"), temperature=None)
    section = sensor_section("/dev/null").model_copy(update={"lines": printed})
    assert not describe("imu", section).temperature_stated


@pytest.mark.slow
@pytest.mark.parametrize("stated", [None, {"stated_c": 31.0}])
def test_a_column_that_holds_no_temperature_is_none_or_the_stated_one(stated: Any) -> None:
    section: dict[str, Any] = {"columns": (*SEVEN, "temperature"), "temperature": stated}
    chunks = (printed(number).strip() + b",-127.00\r\n" for number in count())
    taken = Taken()
    with pty_printing(chunks) as (port, _), lines("imu", sensor_section(port, **section), taken) as source:
        source.start()
        samples = taken.wait(source, 20)
        described = source.sensors["imu"]
    assert described.measures(TEMPERATURE) is described.temperature_stated is (stated is not None)
    assert samples.dtype == described.sample_dtype
    assert described.channel(ACCELERATION).values(samples)[0] == pytest.approx(
        np.array([0.5, -0.25, 1]) * 9.80665, abs=1e-6
    )


@pytest.mark.slow
def test_what_is_blank_in_most_lines_is_recorded_when_it_is_there() -> None:
    """A barometer that is read ten times a second beside a gyroscope that is a hundred times."""
    section: dict[str, Any] = {"columns": (*SEVEN, "air"), "scalars": {"air": {"unit": "hPa"}}}
    air = [b"", b"1013.2"]
    chunks = (printed(number).strip() + b"," + air[number % 10 == 0] + b"\r\n" for number in count())
    parts: dict[str, list[NDArray[Any]]] = {"imu": [], "imu_air": []}
    taken = Taken()

    def take(sensor: str, samples: NDArray[Any]) -> None:
        parts[sensor].append(samples)
        if sensor == "imu_air":
            taken(sensor, samples)

    with pty_printing(chunks) as (port, _), lines("imu", sensor_section(port, **section), take) as source:
        source.start()
        taken.wait(source, 3)
        pressure = source.sensors["imu_air"].channel(PRESSURE)
    of_the_air, of_the_imu = (np.concatenate(parts[name]) for name in ("imu_air", "imu"))
    assert pressure.values(of_the_air) == pytest.approx(np.full(len(of_the_air), 101_320.0))
    assert of_the_air["sequence"].tolist() == [*range(len(of_the_air))], "none is lost that was not there"
    assert (np.diff(of_the_imu["sequence"].astype(int)) == 1).all() and len(of_the_imu) > len(of_the_air)


@pytest.mark.one_in(3)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("rate_hz", "text"),
    [
        (200.0, lambda time_s: b"%.2f" % time_s),
        (200.0, lambda time_s: b"%.6f" % np.float32(time_s)),
        (50.0, lambda time_s: b"%.1f" % time_s),
    ],
    ids=["two decimals", "single precision", "one decimal"],
)
def test_coarse_seconds_are_made_even_and_the_stated_rate_is_right(rate_hz: float, text: Any) -> None:
    section: dict[str, Any] = {"time": {"unit": "s", "wrap": 0}}
    times_s = (20_000.0 + number / rate_hz for number in count())
    chunks = (text(time_s) + b",1.5,-2.25,3,0.5,-0.25,1\r\n" for time_s in times_s)
    taken = Taken()
    with (
        pty_printing(chunks, 0.002) as (port, _),
        lines(
            "imu", sensor_section(port, rate_hz=rate_hz, **section), taken, patience=Patience(first_s=20.0)
        ) as source,
    ):
        source.start()
        samples = taken.wait(source, 600)
        described = source.sensors["imu"]
    assert (np.diff(samples["sequence"].astype(int)) == 1).all(), "none is lost"
    off_s = 1e-6 * samples["board_time_us"] - np.arange(len(samples)) / rate_hz
    assert described.stamp_std_s is not None and off_s.std() < 1.5 * described.stamp_std_s
    assert (np.diff(samples["board_time_us"].astype(np.int64)) > 0).all()


@pytest.mark.slow
def test_a_look_says_what_comes() -> None:
    with pty_printing(chain([BOOT], stream())) as (port, _):
        told = [str(each) for each in look("imu", sensor_section(port))]
    assert any("100 a second" in each for each in told) and any("+1.5 -2.25 +3 deg/s" in each for each in told)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("chunks", "name"),
    [
        (lambda: repeat(b"\x00" * 100), "lines_wrong_baud_rate"),
        (lambda: repeat(printed(7)), "lines_time_stands"),
    ],
)
def test_what_is_wrong_with_it_has_a_name(chunks: Any, name: str) -> None:
    """More of it: tests/sensors/test_faults_by_part.py."""
    with (
        pty_printing(chunks()) as (port, _),
        pytest.raises(SensorError, match=name) as refused,
        lines("imu", sensor_section(port), Taken(), patience=Patience(first_s=1.0)),
    ):
        pass
    assert "sensors.imu" in str(refused.value)


@pytest.mark.slow
def test_a_time_in_another_unit_is_named_as_that() -> None:
    with (
        pty_printing(stream()) as (port, _),
        pytest.raises(SensorError, match=r"lines_other_rate: .*set lines\.time\.unit to us"),
        lines("imu", sensor_section(port, time={"unit": "ms", "wrap": 0}), Taken()),
    ):
        pass


@pytest.mark.slow
def test_a_time_that_starts_again_without_a_stated_wrap_does_not_stand() -> None:
    begin = chain((printed(number) for number in range(400, 405)), stream())
    section = {"unit": "us", "wrap": 0}
    with (
        pty_printing(begin) as (port, _),
        pytest.raises(SensorError, match=r"lines_time_jumped: .* go back, from 4040000 to 0\. .*lines\.time\.wrap"),
        lines("imu", sensor_section(port, time=section), Taken()),
    ):
        pass


def test_arrival_times_are_recorded_as_less_certain() -> None:
    section = sensor_section("/dev/null", columns=SEVEN[1:], time=None, clock="arrival", jitter_ms=30)
    assert describe("imu", section).stamp_std_s == pytest.approx(0.03 / np.sqrt(3))
    assert describe("imu", sensor_section("/dev/null")).stamp_std_s is None


@pytest.mark.slow
@pytest.mark.parametrize("count", [12_000, pytest.param(600_000, marks=[pytest.mark.proof, pytest.mark.thorough])])
@pytest.mark.timeout(3600)
def test_1000_hz_of_seven_columns_lose_nothing(count: int) -> None:
    """Ten minutes of it; as fast as they are read, for a pseudo-terminal keeps some thousand bytes."""
    taken = [0]
    last = [-1]

    def take(sensor: str, samples: NDArray[Any]) -> None:
        assert (np.diff(samples["sequence"], prepend=last[0]) == 1).all()
        last[0] = int(samples["sequence"][-1])
        taken[0] += len(samples)

    rows = b"".join(b"%d,%.3f,-2.25,3.125,0.5012,-0.2512,1.0012\r\n" % (1000 * n, n % 90) for n in range(count + 500))
    chunks = (rows[at : at + 2000] for at in range(0, len(rows), 2000))
    with pty_printing(chunks, 0.001) as (port, _), lines("imu", sensor_section(port, rate_hz=1000), take) as source:
        source.start()
        wait_for(lambda: last[0] >= count - 3000, "all but those it looks at first", 3000.0, meanwhile=source.check)
