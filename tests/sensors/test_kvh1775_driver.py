"""The KVH 1775's driver and the simulated instrument, with bytes on a pseudo-terminal between them."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.data.quantity import ACCELERATION, FIELD, RATE, TEMPERATURE
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.sensors.errors import SensorError
from rig.sensors.kvh1775.kvh_driver import Kvh1775
from rig.sensors.kvh1775.kvh_source import Kvh1775Source, kvh1775, look
from rig.sensors.port_silence import PATIENCE, Patience
from support.processes.waiting import wait_for, wait_for_error
from support.wires.kvh_on_a_wire import SERIAL_NUMBER, KvhOnAWire, kvh_on_a_wire, section

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")

TURNING = (0.5, -0.25, 1.0, 0.1, -0.2, 0.97)


class Collected:
    """Samples as they come."""

    def __init__(self) -> None:
        self.parts: list[NDArray[Any]] = []
        self.fields: list[NDArray[Any]] = []

    def __call__(self, sensor: str, samples: NDArray[Any]) -> None:
        assert sensor in ("kvh", "kvh_field")
        (self.parts if sensor == "kvh" else self.fields).append(samples)

    @property
    def samples(self) -> NDArray[Any]:
        return np.concatenate(self.parts)

    def wait(self, source: Kvh1775Source, count: int = 1, *, until_us: int = 0) -> NDArray[Any]:
        """The samples once there are so many, and the instrument's clock shows `until_us`."""

        def enough() -> bool:
            return sum(map(len, self.parts)) >= count and bool(self.parts[-1]["board_time_us"][-1] >= until_us)

        wait_for(enough, f"{count} samples, until {until_us} µs", meanwhile=source.check)
        return self.samples


@contextmanager
def streaming(
    wire: KvhOnAWire, patience: Patience = PATIENCE, **changes: Any
) -> Iterator[tuple[Kvh1775Source, Collected]]:
    collected = Collected()
    with kvh1775("kvh", section(wire.port, **changes), collected, patience=patience) as source:
        source.start()
        yield source, collected


def refused(port: str, **changes: object) -> SensorError:
    with pytest.raises(SensorError) as caught, kvh1775("kvh", section(port, **changes), Collected()):
        pass
    return caught.value


@pytest.mark.one_in(2)
@pytest.mark.slow
@pytest.mark.parametrize("message", ["A", "B", "C"])
@pytest.mark.parametrize("rotation", ["delta", "rate"])
def test_samples_are_what_the_instrument_feels(message: str, rotation: str) -> None:
    with kvh_on_a_wire(motion_at=lambda time_s: TURNING, pace=4) as wire:
        changes: dict[str, Any] = {
            "message": message,
            "rotation": rotation,
            "rate_hz": 250,
            "acceleration": {"range_g": 10},
        }
        with streaming(wire, **changes) as (source, collected):
            samples = collected.wait(source, 300)
            described = source.sensors["kvh"]
    assert isinstance(described, RecordedSensor)
    rate = described.channel(RATE).values(samples)
    force = described.channel(ACCELERATION).values(samples)
    assert rate.mean(axis=0) == pytest.approx(TURNING[:3], abs=3e-6)
    assert rate[2:].std(axis=0) == pytest.approx([1e-5] * 3, rel=0.3)
    assert force.mean(axis=0) == pytest.approx(np.array(TURNING[3:]) * 9.80665, abs=3e-3)
    assert samples["sequence"].tolist() == list(range(len(samples))), "300 are more than two rounds of 128"
    steps_us = np.diff(samples["board_time_us"].astype(np.int64))
    assert set(steps_us.tolist()) <= {3999, 4000, 4001}
    assert (described.channel(TEMPERATURE).values(samples) == 22.0).all()


FIELD_T = (2.1e-5, -0.4e-5, -4.2e-5)


@pytest.mark.slow
def test_format_c_has_its_magnetometer_as_a_sensor_of_its_own() -> None:
    with (
        kvh_on_a_wire(pace=4, field_at=lambda time_s: FIELD_T) as wire,
        streaming(wire, message="C", rate_hz=250) as (source, collected),
    ):
        collected.wait(source, 300)
        wire.order(lambda kvh: setattr(kvh.faults, "lose", 5))  # in two readings at least
        collected.wait(source, 400)
        described = source.sensors["kvh_field"]
    assert isinstance(described, RecordedSensor)
    assert (described.clock, described.rate_hz, described.serial_number) == ("kvh", 62.5, SERIAL_NUMBER)
    samples = np.concatenate(collected.fields)
    read_t = described.channel(FIELD).values(samples)
    assert read_t == pytest.approx(np.tile(FIELD_T, (len(samples), 1)), abs=1e-11), "whole ones, each axis in its place"
    steps = np.diff(samples["sequence"].astype(np.int64))
    assert samples["sequence"][0] == 0 and np.count_nonzero(steps > 1) == 1 and steps.max() in (2, 3)
    times_us = np.diff(samples["board_time_us"].astype(np.int64))
    assert (np.abs(times_us - 16_000 * steps) <= 2).all(), "four messages each, across the wraps of their numbers"


@pytest.mark.slow
def test_what_somebody_left_is_corrected_and_stays_corrected() -> None:
    left = {"DR": "100", "OUTPUTFMT": "C", "ROTFMT": "RATE", "ROTUNITS": "DEG", "TEMPUNITS": "F", "FILTEN,G": "0"}
    with kvh_on_a_wire({**left, "FILTTYPE,A": "BUTTER"}) as wire:
        with kvh1775("kvh", section(wire.port), Collected()) as source:
            assert source.corrected == {**left, "FILTTYPE,A": "BUTTER"}
        with kvh1775("kvh", section(wire.port), Collected()) as source:
            assert source.corrected == {}, "it is in the instrument's memory now"
        assert wire.memory["ROTUNITS"] == "RAD"


@pytest.mark.slow
def test_an_instrument_that_waits_for_an_external_sync_is_brought_back() -> None:
    with kvh_on_a_wire({"MSYNC": "EXT"}) as wire, streaming(wire) as (source, collected):
        assert source.corrected["MSYNC"] == "EXT" and source.corrected["FILTTYPE,G"] == "AVE"
        collected.wait(source, 10)


@pytest.mark.slow
def test_an_instrument_somebody_left_in_configuration_mode_is_found() -> None:
    with kvh_on_a_wire() as wire:
        wire.order(lambda kvh: kvh.receive(b"=config,1\r"))
        with streaming(wire) as (source, collected):
            collected.wait(source, 10)


def test_looking_changes_nothing_and_says_what_a_run_would() -> None:
    with kvh_on_a_wire({"OUTPUTFMT": "C", "AXES": "0,1,0,-1,0,0,0,0,1"}) as wire:
        seen = list(look("kvh", section(wire.port, serial_number="another")))
        assert wire.memory["OUTPUTFMT"] == "C"
    assert "OUTPUTFMT is C; a run sets it to B" in seen
    names = [each.name for each in seen if isinstance(each, SensorError)]
    assert names == ["kvh_other_serial_number", "kvh_axes_not_identity"]
    assert seen[-1] == "built-in test: " + " ".join(["7f"] * 6)


@pytest.mark.parametrize(
    ("left", "name", "said"),
    [
        ({"AXES": "4,0,0,0,1,0,0,0,1"}, "kvh_axes_not_identity", "+4.000000E+00"),
        ({"FILTTYPE,G": "CUSTOM"}, "kvh_custom_filter", "gyroscope"),
        ({"FILTTYPE,A": "CUSTOM"}, "kvh_custom_filter", "accelerometer"),
    ],
)
def test_what_changes_the_readings_is_refused_by_name(left: dict[str, str], name: str, said: str) -> None:
    with kvh_on_a_wire(left) as wire:
        error = refused(wire.port)
        assert wire.memory["OUTPUTFMT"] == "A", "nothing was changed before"
    assert error.name == name and said in error.what


def test_another_specimen_is_refused() -> None:
    with kvh_on_a_wire() as wire:
        error = refused(wire.port, serial_number="1775-8")
    assert error.name == "kvh_other_serial_number" and SERIAL_NUMBER in error.what


@pytest.mark.slow
def test_a_built_in_test_that_fails_is_refused() -> None:
    with kvh_on_a_wire() as wire:
        wire.order(lambda kvh: setattr(kvh.faults, "test", 0x7D))
        error = refused(wire.port)
    assert error.name == "kvh_test_failed" and "7d 7f" in error.what


@pytest.mark.slow
def test_a_command_it_does_not_know_is_named() -> None:
    with kvh_on_a_wire() as wire:
        del wire.memory._settings["FILTEN,G"]
        with pytest.raises(SensorError) as caught:
            Kvh1775("kvh", wire.port, 921600)
    assert caught.value.name == "kvh_command_refused" and "?FILTEN,G with INVALID" in caught.value.what


@pytest.mark.slow
def test_half_a_command_of_somebody_else_is_in_nobodys_way() -> None:
    with kvh_on_a_wire() as wire:
        wire.order(lambda kvh: kvh.receive(b"=config,1\r\n=OUTPUTF"))
        with streaming(wire) as (source, collected):
            collected.wait(source, 10)


@pytest.mark.slow
def test_a_wrong_baud_rate_is_named() -> None:
    with kvh_on_a_wire({"BAUD": "115200"}) as wire, pytest.raises(SensorError) as caught:
        Kvh1775("kvh", wire.port, 921600, patience=Patience(first_s=0.4))
    assert caught.value.name == "kvh_wrong_baud_rate"


@pytest.mark.slow
def test_a_dead_line_and_a_missing_port_are_named() -> None:
    with kvh_on_a_wire(dead=True) as wire, pytest.raises(SensorError) as caught:
        Kvh1775("kvh", wire.port, 921600, patience=Patience(first_s=0.3))
    assert caught.value.name == "no_kvh"
    with pytest.raises(SensorError) as caught:
        Kvh1775("kvh", "/dev/there-is-none", 921600)
    assert caught.value.name == "no_port"


@pytest.mark.slow
def test_a_line_that_carries_one_way_only_is_named() -> None:
    with kvh_on_a_wire() as wire:
        wire.line.send_to_device = lambda data, host_baud: None  # pyrefly: ignore[method-assign]  # a stand-in
        with pytest.raises(SensorError) as caught:
            Kvh1775("kvh", wire.port, 921600, patience=Patience(first_s=0.5))
    assert caught.value.name == "kvh_does_not_hear"


@pytest.mark.slow
@pytest.mark.parametrize("message", ["A", "B"])
def test_lost_messages_are_counted(message: str) -> None:
    with (
        kvh_on_a_wire(pace=6) as wire,
        streaming(wire, message=message, rate_hz=100) as (source, collected),
    ):
        collected.wait(source, 20)
        wire.order(lambda kvh: setattr(kvh.faults, "lose", 100))
        samples = collected.wait(source, 60)
    steps = np.diff(samples["sequence"].astype(int))
    assert sorted(set(steps.tolist())) == [1, 101]
    times_us = samples["board_time_us"].astype(np.int64)
    assert times_us[-1] - times_us[0] == pytest.approx(
        10_000 * (samples["sequence"][-1] - samples["sequence"][0]), abs=2
    )


@pytest.mark.slow
@pytest.mark.parametrize("message", ["A", "B"])
def test_a_gap_nobody_can_count_ends_the_stream(message: str) -> None:
    with kvh_on_a_wire() as wire, streaming(wire, message=message) as (source, collected):
        collected.wait(source, 20)
        wire.order(lambda kvh: setattr(kvh.faults, "lose", 250))
        error = wait_for_error(SensorError, source.check)
        assert error.name == "kvh_gap_ambiguous" and error.what.startswith("sensors.kvh: the KVH 1775 on ")


@pytest.mark.slow
def test_a_laboratory_that_stands_still_is_no_silence() -> None:
    """A simulated one does on a busy machine, and the arm's clock with it."""
    impatient = Patience(silent_s=0.2)
    with kvh_on_a_wire(pace=2) as wire, streaming(wire, impatient, message="A") as (source, collected):
        source.check(clock_s=7.0)
        collected.wait(source, 20)
        wire.wire.limit_s = 0.0
        time.sleep(3 * impatient.silent_s)
        wire.wire.limit_s = np.inf
        source.check(clock_s=7.0)
        collected.wait(source, len(collected.samples) + 100)
    assert (np.diff(collected.samples["sequence"]) == 1).all()


@pytest.mark.slow
def test_bit_errors_cost_messages_and_nothing_else() -> None:
    with kvh_on_a_wire(motion_at=lambda time_s: TURNING, pace=4) as wire, streaming(wire) as (source, collected):
        wire.line.bit_error_rate = 1e-4  # every thirtieth message
        samples = collected.wait(source, 3000)
        described = source.sensors["kvh"]
    assert isinstance(described, RecordedSensor)
    assert len(samples) < samples["sequence"][-1] + 1
    rate = described.channel(RATE).values(samples)
    assert np.abs(rate - TURNING[:3]).max() < 1e-4


@pytest.mark.slow
def test_readings_it_calls_invalid_are_no_samples_and_end_the_stream_when_they_stay() -> None:
    # With microseconds: a busy computer keeps the instrument waiting, and no sequence number tells such a silence.
    with kvh_on_a_wire(pace=4) as wire, streaming(wire, message="B") as (source, collected):
        collected.wait(source, 20)
        wire.order(lambda kvh: setattr(kvh.faults, "status", 0x75))
        error = wait_for_error(SensorError, source.check)
    assert error.name == "kvh_axis_invalid" and "0x75" in error.what


@pytest.mark.slow
def test_an_accelerometer_that_is_not_read_may_be_invalid() -> None:
    with kvh_on_a_wire(pace=6) as wire:
        wire.order(lambda kvh: setattr(kvh.faults, "status", 0x07))
        with streaming(wire, rate_hz=250) as (source, collected):
            collected.wait(source, 400)


def silent(wire: KvhOnAWire) -> None:
    wire.line.silent = True


def restarted(wire: KvhOnAWire) -> None:
    wire.order(lambda kvh: wire.switch_on())


@pytest.mark.slow
def test_a_restart_is_named_where_the_built_in_test_comes_between_two_messages() -> None:
    with kvh_on_a_wire({"DR": "10"}) as wire, streaming(wire, rate_hz=10, message="A") as (source, collected):
        collected.wait(source, 2)

        def power_dip(_: object) -> None:
            wire.switch_on()
            assert wire.kvh is not None
            wire.kvh.misbehave(lose=1000)  # so the test comes alone

        wire.order(power_dip)
        assert wait_for_error(SensorError, source.check).name == "kvh_restarted"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("happens", "name"),
    [
        pytest.param(silent, "kvh_link_lost", marks=pytest.mark.slow),
        (restarted, "kvh_restarted"),
        (KvhOnAWire.close, "kvh_link_lost"),
    ],
)
def test_what_happens_in_a_stream_is_named(happens: Callable[[KvhOnAWire], None], name: str) -> None:
    wire = KvhOnAWire({})
    try:
        with streaming(wire) as (source, collected):
            collected.wait(source, 20)
            happens(wire)
            assert wait_for_error(SensorError, source.check).name == name
    finally:
        if happens is not KvhOnAWire.close:
            wire.close()


@pytest.mark.slow
def test_the_microseconds_wrap_while_it_streams() -> None:
    """71.6 min after it was switched on."""
    wrap_us = 2**32
    uptime_s = wrap_us * 1e-6 - 10.0
    with kvh_on_a_wire(uptime_s=uptime_s) as wire, streaming(wire, rate_hz=100) as (source, collected):
        begins_us = int(collected.wait(source)["board_time_us"][0])
        assert begins_us < wrap_us, "it had wrapped before it streamed"
        wire.wire.clock.pace(10.0)
        times_us = collected.wait(source, until_us=wrap_us + 1_000_000)["board_time_us"].astype(np.int64)
    assert np.diff(times_us).max() <= 10_001 and np.diff(times_us).min() >= 9_999


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.timeout(3600)
def test_ten_minutes_at_1000_hz_lose_nothing() -> None:
    """As fast as they are read, for a pseudo-terminal keeps some thousand bytes: a loss is the driver's."""
    count = 600_000
    seen = [0]

    def take(sensor: str, samples: NDArray[Any]) -> None:
        assert (samples["sequence"] == np.arange(seen[0], seen[0] + len(samples))).all()
        seen[0] += len(samples)

    with kvh_on_a_wire() as wire, kvh1775("kvh", section(wire.port), take) as source:
        source.start()
        wire.wire.clock.pace(1e6)
        wait_for(lambda: seen[0] >= count, "ten minutes", 3000.0, meanwhile=source.check)
