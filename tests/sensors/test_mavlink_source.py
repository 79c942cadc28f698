"""An autopilot's IMUs as a source: what it corrects is undone or refused, what goes wrong has a name."""

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import numpy as np
import pytest

from rig.config.sensors.sensor_sections import SensorSection
from rig.data.quantity import ACCELERATION, RATE, TEMPERATURE
from rig.data.recording.recorded_sensor import UNKNOWN_CHANGE_K
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.sensors.errors import SensorError
from rig.sensors.mavlink.autopilot_source import MavlinkSource, look, mavlink
from rig.sensors.mavlink.dialect import dialect
from support.processes.waiting import wait_for, wait_for_error
from support.wires.autopilot_on_a_wire import BIAS_RAD_S, UID, AutopilotOnAWire, autopilot_on_a_wire, section

pytestmark = pytest.mark.slow

UNCORRECTED = {
    "ardupilot": {"INS_GYROFFS_X": 0.01, "INS_ACCOFFS_Z": 0.3, "INS_ACCSCAL_Z": 1.05, "AHRS_ORIENTATION": 6},
    "px4": {"CAL_GYRO0_XOFF": 0.01, "CAL_ACC0_ZOFF": 0.3, "CAL_ACC0_ZSCALE": 1.05, "SENS_BOARD_ROT": 6},
}


class Listening:
    """What a source hands on, and the source."""

    def __init__(self, sections: dict[str, SensorSection]) -> None:
        self.samples: dict[str, list[Any]] = {name: [] for name in sections}
        self._stack = ExitStack()
        self.source: MavlinkSource = self._stack.enter_context(mavlink(sections, self._take))
        self.source.start()

    def _take(self, name: str, samples: Any) -> None:
        self.samples[name].append(samples)

    def __enter__(self) -> "Listening":
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def hear(self, count: int, name: str = "imu", until_us: float = 0.0) -> Any:
        """The first samples of one, so many at least, until its clock shows that."""

        def enough() -> bool:
            parts = self.samples[name]
            return sum(map(len, parts)) >= count and bool(parts[-1]["board_time_us"][-1] >= until_us)

        wait_for(enough, "samples", meanwhile=self.source.check)
        return np.concatenate(self.samples[name])


@pytest.mark.one_in(3)
@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
@pytest.mark.parametrize("imu", ["HIGHRES_IMU", "SCALED_IMU"])
def test_readings_are_raw_again_whatever_the_parameters(firmware: Any, imu: str) -> None:
    with (
        autopilot_on_a_wire(firmware, UNCORRECTED[firmware]) as wire,
        Listening({"imu": section(wire.port, imu)}) as heard,
    ):
        samples = heard.hear(60)
        described = heard.source.sensors["imu"]
    step = 1.0 if imu == "SCALED_IMU" else 0.01
    rates = described.channel(RATE).values(samples)[5:].mean(axis=0)
    assert rates == pytest.approx(np.negative(BIAS_RAD_S), abs=1e-3 * step), "m = g - b"
    forces = described.channel(ACCELERATION).values(samples)[5:].mean(axis=0)
    assert forces == pytest.approx([0, 0, STANDARD_GRAVITY_M_S2], abs=1e-2 * step)
    assert described.channel(RATE).resolution == pytest.approx(2e-3 if imu == "SCALED_IMU" else 3.25e-8, rel=0.01)
    assert described.channel(TEMPERATURE).values(samples)[0] == pytest.approx(25 if imu == "HIGHRES_IMU" else 22)
    assert samples["sequence"].tolist() == list(range(len(samples)))
    assert np.diff(samples["board_time_us"].astype(np.int64)).mean() == pytest.approx(1e4, rel=0.02)


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("imu", "of_it"),
    [
        ("SCALED_IMU", {"provides_temperature": False}),
        ("HIGHRES_IMU", {"provides_temperature": False}),
        ("RAW_IMU", {"mavlink_version": 1}),
    ],
)
@pytest.mark.parametrize("stated", [None, {"stated_c": 31.0, "stated_within_k": 4.0}])
def test_a_temperature_that_is_not_provided_is_none_or_the_stated_one(imu: str, of_it: Any, stated: Any) -> None:
    with autopilot_on_a_wire(**of_it) as wire:
        sections = {"imu": section(wire.port, imu, temperature=stated)}
        told = " ".join(map(str, look(sections)))
        with Listening(sections) as heard:
            samples = heard.hear(20)
            described = heard.source.sensors["imu"]
    assert samples.dtype == described.sample_dtype
    if stated is None:
        assert not described.measures(TEMPERATURE) and described.unseen_change_k == UNKNOWN_CHANGE_K
        assert "provides no temperature" in told
    else:
        assert described.temperature_stated and described.unseen_change_k == 4.0
        assert described.channel(TEMPERATURE).values(samples)[-1] == 31.0 and "31 °C is stated" in told


def test_px4_reads_its_barometer_now_and_then_and_its_temperature_stands_meanwhile() -> None:
    with autopilot_on_a_wire("px4") as wire, Listening({"imu": section(wire.port, rate_hz=100)}) as heard:
        samples = heard.hear(60)
        described = heard.source.sensors["imu"]
    assert described.channel(TEMPERATURE).values(samples) == pytest.approx(np.full(len(samples), 25.0))


def test_three_imus_at_one_port_are_read_at_once() -> None:
    left = {"INS_GYR2OFFS_Y": 0.5, "INS_GYR3OFFS_Y": -0.5}
    imus = {"a": "SCALED_IMU", "b": "SCALED_IMU2", "c": "SCALED_IMU3"}
    with autopilot_on_a_wire("ardupilot", left, imus=3) as wire:
        sections = {name: section(wire.port, imu, serial_number=name) for name, imu in imus.items()}
        with Listening(sections) as heard:
            for name in imus:
                rates = heard.source.sensors[name].channel(RATE).values(heard.hear(20, name))[5:]
                assert rates.mean(axis=0) == pytest.approx(np.negative(BIAS_RAD_S), abs=1e-3)


def test_lost_messages_are_missing_and_doubled_ones_are_not_there_twice() -> None:
    with autopilot_on_a_wire() as wire, Listening({"imu": section(wire.port)}) as heard:
        wire.faults.doubled = 0.3
        wire.faults.lost = 0.1
        samples = heard.hear(300)
        numbers = samples["sequence"].astype(int)
        missing = numbers[-1] + 1 - len(numbers)
        counter = heard.source.link.counter
    assert (np.diff(numbers) > 0).all() and counter.doubled > 50
    assert 10 < missing <= counter.lost
    assert np.rint(np.diff(samples["board_time_us"].astype(float)) / 1e4).tolist() == np.diff(numbers).tolist()


@pytest.mark.thorough
def test_milliseconds_that_begin_anew_go_on() -> None:
    wrap_us = 2**32 * 1e3
    with (
        autopilot_on_a_wire(uptime_s=wrap_us * 1e-6 - 30.0, pace=1.0) as wire,
        Listening({"imu": section(wire.port, "SCALED_IMU")}) as heard,
    ):
        assert heard.hear(1)["board_time_us"][0] < wrap_us, "they had begun anew before it streamed"
        wire.wire.clock.pace(100.0)
        steps = np.diff(heard.hear(1, until_us=wrap_us + 1e6)["board_time_us"].astype(np.int64))
    assert steps.min() > 0 and steps.max() < 20_000


@pytest.mark.one_in(5)
@pytest.mark.parametrize(
    ("firmware", "imu", "left", "name"),
    [
        ("ardupilot", "SCALED_IMU", {"INS_TCAL1_ENABLE": 1}, "autopilot_corrects"),
        ("ardupilot", "SCALED_IMU", {"INS_HNTCH_ENABLE": 1}, "autopilot_corrects"),
        ("ardupilot", "SCALED_IMU", {"AHRS_ORIENTATION": 0, "INS_GYRO_FILTER": 2}, "autopilot_filter_slow"),
        ("ardupilot", "HIGHRES_IMU", {"INS_GYR2_ID": 7}, "autopilot_several_imus"),
        ("ardupilot", "SCALED_IMU2", {}, "autopilot_message_refused"),
        ("px4", "SCALED_IMU", {"IMU_GYRO_CAL_EN": 1}, "autopilot_corrects"),
        ("px4", "HIGHRES_IMU", {"EKF2_EN": 1}, "autopilot_corrects"),
        ("px4", "SCALED_IMU", {"SENS_BOARD_Z_OFF": 0.5}, "autopilot_corrects"),
        ("px4", "SCALED_IMU", {"CAL_GYRO0_ID": 0}, "autopilot_not_calibrated"),
    ],
)
def test_what_cannot_be_undone_is_refused(firmware: Any, imu: str, left: dict[str, float], name: str) -> None:
    with autopilot_on_a_wire(firmware, left) as wire, pytest.raises(SensorError) as caught:
        Listening({"imu": section(wire.port, imu)})
    assert caught.value.problem.name == name


def test_px4_readings_that_no_estimator_touches_are_taken_beside_one() -> None:
    with autopilot_on_a_wire("px4", {"EKF2_EN": 1}) as wire:
        Listening({"imu": section(wire.port, "SCALED_IMU")}).__exit__()


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("spoil", "changes", "name"),
    [
        (lambda wire: setattr(wire.autopilot, "armed", True), {}, "autopilot_armed"),
        (lambda wire: setattr(wire.faults, "deaf", True), {}, "autopilot_silent"),
        (lambda wire: None, {"uid": "00112233"}, "autopilot_other_uid"),
    ],
)
def test_what_is_not_ready_is_refused(
    spoil: Callable[[AutopilotOnAWire], None], changes: dict[str, Any], name: str
) -> None:
    """More of it: tests/sensors/test_faults_by_part.py."""
    with autopilot_on_a_wire() as wire, pytest.raises(SensorError) as caught:
        wire.wire.order(lambda: spoil(wire))
        Listening({"imu": section(wire.port, **changes)})
    assert caught.value.problem.name == name


def test_an_autopilot_that_arms_while_it_streams_ends_it() -> None:
    with autopilot_on_a_wire(uptime_s=100.0) as wire, Listening({"imu": section(wire.port)}) as heard:
        heard.hear(10)
        assert wire.autopilot is not None
        wire.autopilot.armed = True
        assert wait_for_error(SensorError, heard.source.check).problem.name == "autopilot_armed"


@pytest.mark.parametrize(("name", "ends"), [("INS_GYROFFS_Y", True), ("INS_GYR_CAL", False)])
def test_a_parameter_of_the_readings_that_another_program_changes_ends_a_stream(name: str, ends: bool) -> None:
    with autopilot_on_a_wire("ardupilot") as wire, Listening({"imu": section(wire.port)}) as heard:
        heard.hear(20)
        autopilot = wire.autopilot
        assert autopilot is not None
        mavlink2 = dialect()
        sender = mavlink2.MAVLink(None, srcSystem=254)
        change = mavlink2.MAVLink_param_set_message(1, 1, name.encode(), 0.5, 9).pack(sender)
        wire.wire.order(lambda: autopilot.receive(change))
        if ends:
            error = wait_for_error(SensorError, heard.source.check)
            assert error.name == "autopilot_parameter_changed" and f"{name} changed from 0 to 0.5" in str(error)
        else:
            heard.hear(60)


def test_a_look_says_what_is_undone() -> None:
    with autopilot_on_a_wire("ardupilot", {"INS_GYROFFS_X": 0.01}) as wire:
        seen = list(look({"imu": section(wire.port)}))
    assert all(isinstance(each, str) for each in seen)
    text = "\n".join(map(str, seen))
    assert f"ArduPilot 4.5.7, number {UID}" in text and "INS_GYROFFS_X: 0.01" in text and "11.3 ms" in text
