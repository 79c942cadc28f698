"""The simulated KVH 1775 does with bytes what the interface document says of the real one."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from rig.config.world.laboratory import SimulatedSensorSection
from rig.sensors.kvh1775.kvh_messages import MessageReader
from rig.world.board.sensor_truth import SensorTruth
from rig.world.kvh1775.instrument import SimulatedKvh1775
from rig.world.kvh1775.memory import KvhMemory
from support.wires.kvh_on_a_wire import STILL, section

PERFECT = SimulatedSensorSection(
    scale=(1, 1, 1), bias_rad_s=(0, 0, 0), noise_rad_s=0.0, accelerometer={"noise_m_s2": 0.0}, temperature_c=20
)
ZEROS = ",".join(["+0.000000E+00"] * 3)


def instrument(
    memory: KvhMemory, motion_at: Callable[[float], Sequence[float]] = lambda time_s: STILL, ppm: float = 0.0
) -> SimulatedKvh1775:
    return SimulatedKvh1775(
        SensorTruth(section("/dev/ttyUSB0", acceleration={}), PERFECT),
        motion_at,
        memory,
        serial_number="42",
        oscillator_ppm=ppm,
        uptime_s=0.0,
        seed=np.random.SeedSequence(1),
        time_s=0.0,
    )


def said(kvh: SimulatedKvh1775, *commands: str) -> list[str]:
    """What it answers in configuration mode."""
    kvh.receive(b"=config,1\n")
    kvh.take_sent()
    for command in commands:
        kvh.receive(command.encode() + b"\r\n")
    return kvh.take_sent().decode().split("\r\n")[:-1]


@pytest.mark.parametrize(
    ("command", "answer"),
    [
        ("?is", "IS,42"),
        ("?Dr", "DR,1000"),
        ("=dr,250", "DR,250"),
        ("=DR,333", "INVALID,=DR,333"),
        ("?FILTTYPE,A", "FILTTYPE,A,CHEBY"),
        ("=FILTTYPE,G,BUTTER", "FILTTYPE,G,BUTTER"),
        ("=BAUD,1", "INVALID,=BAUD,1"),
        ("=AXES,4,0,0,0,1,0,0,0,1", f"AXES,+4.000000E+00,{ZEROS},+1.000000E+00,{ZEROS},+1.000000E+00"),
        ("=AXES,1,0,0,0,nan,0,0,0,1", "INVALID,=AXES,1,0,0,0,NAN,0,0,0,1"),
        ("=OUTPUTRATE,100", "INVALID,=OUTPUTRATE,100"),
    ],
)
def test_commands_and_answers(command: str, answer: str) -> None:
    assert said(instrument(KvhMemory({})), command) == [answer]


def test_settings_outlast_the_supply_and_the_factorys_come_back_but_for_the_baud_rate() -> None:
    memory = KvhMemory({"BAUD": "115200"})
    said(instrument(memory), "=MSYNC,EXT", "=ROTUNITS,DEG")
    assert said(instrument(memory), "?MSYNC", "?FILTTYPE,G", "?ROTUNITS") == [
        "MSYNC,EXT",
        "FILTTYPE,G,AVE",
        "ROTUNITS,DEG",
    ]
    assert said(instrument(memory), "=MSYNC,IMU", "?FILTTYPE,G")[1] == "FILTTYPE,G,AVE", "the averager stays"
    assert said(instrument(memory), "=RSTCFG", "?ROTUNITS", "?BAUD") == ["RSTCFG", "ROTUNITS,RAD", "BAUD,115200"]


def test_a_setting_it_does_not_have_cannot_be_left_in_it() -> None:
    with pytest.raises(ValueError, match="DR,123"):
        KvhMemory({"DR": "123"})


def test_it_streams_in_normal_mode_only_and_hears_two_commands_there() -> None:
    kvh = instrument(KvhMemory({}))
    assert MessageReader().feed(kvh.take_sent()).tests[0].passed, "what it says of itself when it is switched on"
    kvh.advance(0.0105)
    assert len(MessageReader().feed(kvh.take_sent()).messages) == 10
    kvh.receive(b"?dr\r\n?bit,2\r\n")
    kvh.advance(0.0115)
    heard = MessageReader().feed(kvh.take_sent())
    assert len(heard.messages) == 1 and len(heard.tests[0].values) == 8
    assert said(kvh, "?DR") == ["DR,1000"]
    kvh.advance(0.5)
    assert kvh.take_sent() == b""
    kvh.receive(b"=CONFIG,0\r\n")
    assert kvh.take_sent() == b"", "leaving is not answered"
    kvh.advance(0.6)
    assert len(MessageReader().feed(kvh.take_sent()).messages) == 100


def test_delta_angles_sum_to_the_angle_and_its_own_clock_says_when() -> None:
    """Of a rate that grows, sampled at 10 Hz by a clock that is 1000 ppm fast: a gyroscope of light measures the rate,
    and the instrument sums it over what it takes for seconds."""
    kvh = instrument(KvhMemory({"DR": "10", "OUTPUTFMT": "B", "ROTUNITS": "DEG"}), lambda t: (t, -t, 0, 0, 0, 1), 1000)
    kvh.advance(10.0)
    messages = MessageReader().feed(kvh.take_sent()).messages
    time_s = 0.1 * len(messages) / 1.001
    assert len(messages) == 100, "the next one is 10 ms away"
    assert np.radians(messages["rotation"].sum(axis=0, dtype=float)) == pytest.approx(
        [1.001 * time_s**2 / 2, -1.001 * time_s**2 / 2, 0], rel=1e-5
    )
    assert messages["time_us"].tolist() == [100_000 * (number + 1) for number in range(100)]


def test_axes_turn_and_scale_rates_and_accelerations() -> None:
    kvh = instrument(
        KvhMemory({"AXES": "0,2,0,-1,0,0,0,0,1", "ROTFMT": "RATE"}), lambda t: (0.1, 0.2, 0.3, 0.5, 0.6, 0.7)
    )
    kvh.advance(0.0011)
    (message,) = MessageReader().feed(kvh.take_sent()).messages
    assert message["rotation"].tolist() == pytest.approx([0.4, -0.1, 0.3])
    assert message["acceleration_g"].tolist() == pytest.approx([1.2, -0.5, 0.7])


@pytest.mark.parametrize(("unit", "number"), [("C", 20), ("C_100", 2000), ("F", 68), ("F_100", 6800)])
def test_the_temperature_has_four_units(unit: str, number: int) -> None:
    kvh = instrument(KvhMemory({"TEMPUNITS": unit}))
    kvh.advance(0.0011)
    (message,) = MessageReader().feed(kvh.take_sent()).messages
    assert message["temperature"] == number
