"""The simulated servo in virtual time: its profiles, its shaft, its watchdog, and what it forgets."""

import math
import struct
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.world.servo.bus import SimulatedBus
from rig.world.servo.servo import SimulatedServo
from rig.world.servo.truth import LineTruth, ServoTruth
from rig.world.servo.wire_format import ServoPacket, encode, encode_status

TURN_RAD = 2 * math.pi
READY = {"Operating Mode": 4, "Drive Mode": 4}
EVEN = ServoTruth(settings=READY, encoder_once_deg=0.0, encoder_twice_deg=0.0, ripple_fraction=0.0, backlash_deg=0.0)


def write(servo: SimulatedServo, time_s: float, address: int, data: bytes) -> int:
    """The error number."""
    answer = servo.obey(ServoPacket(1, 0x03, address.to_bytes(2, "little") + data, True), time_s)
    assert answer is not None
    return answer[8]


def read(servo: SimulatedServo, time_s: float, address: int, form: str) -> int:
    asked = struct.pack("<HH", address, struct.calcsize(form))
    answer = servo.obey(ServoPacket(1, 0x02, asked, True), time_s)
    assert answer is not None and answer[8] == 0
    value: int = struct.unpack(form, answer[9:-2])[0]
    return value


def go(servo: SimulatedServo, time_s: float, goal: int, velocity: int, acceleration: int) -> None:
    assert write(servo, time_s, 108, struct.pack("<II", acceleration, velocity)) == 0
    assert write(servo, time_s, 116, struct.pack("<i", goal)) == 0


def held(truth: ServoTruth) -> SimulatedServo:
    servo = SimulatedServo(truth, 0.0)
    assert write(servo, 0.0, 64, b"\1") == 0
    return servo


def rates(servo: SimulatedServo, since_s: float, until_s: float) -> NDArray[np.float64]:
    return np.array([servo.rate_at(t) for t in np.arange(since_s, until_s, 0.001)])


def test_a_time_based_move_takes_its_time_and_its_ramps_theirs() -> None:
    servo = held(replace(EVEN, lag_s=0.0))
    before_rad = servo.angle_at(1.0)
    go(servo, 1.0, read(servo, 1.0, 132, "<i") + 4096, 6000, 250)
    assert servo.is_moving(6.99) and not servo.is_moving(7.01)
    assert servo.angle_at(8.0) - before_rad == pytest.approx(TURN_RAD, abs=TURN_RAD / 4096)
    assert servo.rate_at(4.0) == pytest.approx(TURN_RAD / 5.75, rel=1e-3)
    assert servo.rate_at(1.125) == pytest.approx(TURN_RAD / 5.75 / 2, rel=1e-3)


def test_a_velocity_based_move_goes_in_steps_of_its_units() -> None:
    """The manual: t1 = 64 V/A, t2 = 64 ΔPos/V, in milliseconds and register units."""
    servo = held(replace(EVEN, settings={"Operating Mode": 4}, lag_s=0.0))
    go(servo, 1.0, read(servo, 1.0, 132, "<i") + 4096, 44, 11)
    takes_ms = 64 * 4096 / 44 + 64 * 44 / 11
    assert servo.shaft.ends_s() - 1.0 == pytest.approx(takes_ms / 1000, rel=2e-3)
    assert servo.rate_at(4.0) == pytest.approx(math.radians(44 * 1.374), rel=1e-3)


def test_a_profile_of_zero_is_as_fast_as_it_can() -> None:
    servo = held(EVEN)
    go(servo, 1.0, read(servo, 1.0, 132, "<i") + 4096, 0, 0)
    assert max(rates(servo, 1.0, 3.0)) == pytest.approx(200 * 0.229 / 60 * TURN_RAD, rel=1e-3)


def test_a_goal_where_it_is_brakes_it_while_it_moves() -> None:
    servo = held(EVEN)
    go(servo, 1.0, read(servo, 1.0, 132, "<i") + 4096, 4000, 200)
    here = read(servo, 2.0, 132, "<i")
    go(servo, 2.0, here, 200, 100)
    assert abs(servo.rate_at(2.25)) < 1e-9
    assert abs(read(servo, 2.3, 132, "<i") - here) <= 4


def test_the_rate_is_the_slope_of_the_angle_with_ripple_play_and_the_encoder_s_error_in_it() -> None:
    servo = held(ServoTruth(settings=READY))
    go(servo, 1.0, read(servo, 1.0, 132, "<i") + 4096, 4000, 200)
    for time_s in np.arange(1.3, 4.7, 0.0371):
        slope = (servo.angle_at(time_s + 1e-5) - servo.angle_at(time_s - 1e-5)) / 2e-5
        assert servo.rate_at(time_s) == pytest.approx(slope, abs=1e-4)
    even = rates(servo, 1.5, 4.5)
    assert 0.07 < (max(even) - min(even)) / 2 / even.mean() < 0.12


def test_the_play_is_taken_up_when_the_way_is_reversed() -> None:
    servo = held(replace(EVEN, backlash_deg=0.25))
    for time_s, goal in ((1.0, 2000), (4.0, 1000)):
        go(servo, time_s, goal, 2000, 200)
    seen = rates(servo, 4.0, 6.1)
    begins = int(np.argmax(seen != 0.0)) * 0.001
    assert 0.02 < begins < 0.15, "the drive has begun, the shaft not yet"


def test_the_watchdog_stops_it_abruptly_and_takes_no_goal_until_it_is_cleared() -> None:
    servo = held(EVEN)
    assert write(servo, 0.9, 98, b"\x0a") == 0
    go(servo, 1.0, read(servo, 1.0, 132, "<i") + 4096, 6000, 250)
    servo.advance(1.19)
    assert servo.rate_at(1.19) > 0.5
    servo.advance(1.5)
    assert servo.rate_at(1.199) > 0.5 and servo.rate_at(1.201) == 0.0
    assert read(servo, 1.5, 98, "<B") == 255
    assert read(servo, 1.5, 112, "<I") == read(servo, 1.5, 108, "<I") == 0
    assert read(servo, 1.5, 64, "<B") == 1
    assert write(servo, 1.6, 116, struct.pack("<i", 0)) == 4
    assert write(servo, 1.6, 98, b"\0") == 0
    assert write(servo, 1.6, 116, struct.pack("<i", 0)) == 0


def test_the_watchdog_is_fed_by_instructions_for_others_and_sleeps_with_torque_off() -> None:
    servo = held(ServoTruth(settings=READY))
    assert write(servo, 0.0, 98, b"\x05") == 0
    for time_s in np.arange(0.05, 1.0, 0.05):
        servo.advance(float(time_s))
        assert servo.obey(ServoPacket(9, 0x01, b"", True), float(time_s)) is None
    assert servo.memory["Bus Watchdog"] == 5
    assert write(servo, 1.0, 64, b"\0") == 0
    servo.advance(9.0)
    assert servo.memory["Bus Watchdog"] == 5


def test_a_shaft_held_fast_switches_the_motor_off_until_a_reboot() -> None:
    servo = held(ServoTruth(settings=READY))
    go(servo, 1.0, 4096, 6000, 250)
    servo.faults.held_fast = True
    for time_s in np.arange(1.1, 3.0, 0.01):
        servo.advance(float(time_s))
    assert servo.memory["Torque Enable"] == 0
    answer = servo.obey(ServoPacket(1, 0x02, b"\x46\0\1\0", True), 3.0)
    assert answer == encode_status(1, 0x80, b"\x20")
    assert write(servo, 3.1, 64, b"\1") & 0x7F == 7


def test_without_its_supply_it_forgets_its_turns_and_its_ram_and_counts_anew() -> None:
    servo = held(ServoTruth(settings=READY))
    go(servo, 1.0, read(servo, 1.0, 132, "<i") + 3 * 4096, 5000, 250)
    angle_rad = servo.angle_at(8.0)
    servo.switch_supply(False, 8.0)
    assert servo.obey(ServoPacket(1, 0x01, b"", True), 8.1) is None
    servo.switch_supply(True, 9.0)
    assert 0 <= read(servo, 9.5, 132, "<i") < 4096
    assert [read(servo, 9.5, address, "<B") for address in (64, 98, 11)] == [0, 0, 4]
    assert read(servo, 9.5, 112, "<I") == 0
    assert 495 <= read(servo, 9.5, 120, "<H") <= 505
    assert servo.angle_at(9.5) == angle_rad


def test_its_clock_is_its_own_and_begins_anew_every_32_seconds() -> None:
    servo = SimulatedServo(ServoTruth(tick_ppm=10_000.0), 0.0)
    assert read(servo, 10.0, 120, "<H") == 10_100
    assert read(servo, 40.0, 120, "<H") == 40_400 - 32_768


def test_the_same_seed_gives_the_same_readings() -> None:
    def readings(seed: int) -> list[int]:
        servo = SimulatedServo(ServoTruth(seed=seed), 0.0)
        return [read(servo, 0.01 * i, 132, "<i") for i in range(50)]

    assert readings(5) == readings(5) != readings(6)


def test_an_ftdi_converter_hands_on_in_lumps_of_16_ms() -> None:
    clock = [0.0]
    bus = SimulatedBus(
        [SimulatedServo(ServoTruth(settings={"Baud Rate": 3}), 0.0)], LineTruth(latency_ms=16.0), lambda: clock[0]
    )
    clock[0] = 0.017
    bus.receive(encode(1, 0x01))
    clock[0] = 0.0319
    assert bus.take_sent() == b""
    clock[0] = 0.0321
    assert bus.take_sent() == encode_status(1, 0, (1020).to_bytes(2, "little") + b"\x30")
