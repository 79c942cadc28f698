"""The servo's driver with the maker's client against the simulated servo: moves, rests, states, and a stop."""

import math
import signal
from itertools import pairwise

import numpy as np
import pytest

from rig.errors import Fault, Refused
from rig.observation.motion.turn_speed import turn_speed
from rig.turners.servo.servo_driver import Servo
from rig.turners.servo.servo_state import SERVO_STATE_DTYPE, ServoState
from rig.world.servo.truth import ServoTruth
from support.wires.driven_servo import BOARD, MODEL, STANDS_RAD_S, act_at_speed, control_servo, turn
from support.wires.servo_on_a_wire import SET_UP, servo_on_a_wire

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("no_crowd")]  # their clock stands while the machine is busy


def test_a_look_moves_nothing_and_switches_no_torque_on() -> None:
    with servo_on_a_wire() as wire:
        before_rad = wire.angle_rad
        with Servo(wire.port, MODEL, clock=wire.clock) as servo:
            report = servo.report()
            assert (report.servo.name, report.firmware) == (MODEL, 48)
            assert report.voltage_limits_v == (9.5, 16.0)
            assert not report.torque_on
            assert servo.problems(BOARD) == []
        assert wire.angle_rad == before_rad
        assert wire.do("register", "Torque Enable") == 0


def test_moves_arrive_and_the_shaft_stays_held_without_anybody_speaking_to_it() -> None:
    states: list[ServoState] = []
    with servo_on_a_wire() as wire:
        with control_servo(wire, on_state=states.append) as servo:
            assert wire.do("register", "Bus Watchdog") == 100
            for by_deg in (60.0, -60.0):
                before_rad = wire.angle_rad
                servo.move(turn(servo.latest.q_rad[0], by_deg))
                rotation_deg = math.degrees(wire.angle_rad - before_rad)
                assert abs(rotation_deg - by_deg) < 4.0, "the encoder is out by 1.3° either way, and there is play"
                assert abs(wire.rate_rad_s) < STANDS_RAD_S
        assert wire.do("register", "Torque Enable") == 1
        assert wire.do("register", "Bus Watchdog") == 0
    assert all(one.time_s < other.time_s for one, other in pairwise(states))
    record = np.array([state.to_record() for state in states], SERVO_STATE_DTYPE)
    assert record["q_rad"].shape == (len(states), 1)
    assert np.ptp(record["q_rad"]) > math.radians(55.0)


def test_a_whole_turn_is_asked_for_to_the_millisecond_and_its_speed_is_measured() -> None:
    states: list[ServoState] = []
    with (
        servo_on_a_wire(ServoTruth("XM430-W210", settings=SET_UP)) as wire,
        Servo(wire.port, "xm430_w210", states.append, watchdog_s=2.0, clock=wire.clock) as servo,
    ):
        servo.take_control(BOARD)
        motion = turn(servo.latest.q_rad[0], 500.0, speed_deg_s=300.0)
        servo.move(motion)
    time_s = np.array([state.time_s for state in states])
    q_rad = np.array([state.q_rad[0] for state in states])
    speed = math.radians(20.0)
    even = (q_rad > motion.start_q_rad[0] + speed) & (q_rad < motion.target_q_rad[0] - speed)
    found = turn_speed(time_s[even], q_rad[even])
    assert abs(found.speed_rad_s / motion.speed_rad_s - 1.0) < 6 * found.speed_std_rad_s / motion.speed_rad_s + 2e-3


def test_a_servo_as_delivered_is_put_into_extended_position_and_time_based_profile() -> None:
    with servo_on_a_wire(ServoTruth(settings={"Baud Rate": 3})) as wire:
        with control_servo(wire) as servo:
            servo.move(turn(servo.latest.q_rad[0], 20.0))
        assert (wire.do("register", "Operating Mode"), wire.do("register", "Drive Mode")) == (4, 4)


@pytest.mark.thorough
def test_after_a_trip_of_the_watchdog_the_next_run_s_move_is_no_jump() -> None:
    """Its profile is zero then, which is as fast as the servo can."""
    states: list[ServoState] = []
    with servo_on_a_wire() as wire:
        with control_servo(wire):
            wire.do("put", "Bus Watchdog", 255)
            wire.do("put", "Profile Velocity", 0)
            wire.do("put", "Profile Acceleration", 0)
        with control_servo(wire, on_state=states.append) as servo:
            servo.move(turn(servo.latest.q_rad[0], 40.0, speed_deg_s=60.0))
        assert max(abs(state.qd_rad_s[0]) for state in states) < math.radians(60.0) * 1.15


def test_a_rest_lasts_as_long_as_it_should_by_the_states_clock() -> None:
    with servo_on_a_wire() as wire, control_servo(wire) as servo:
        began_s = servo.latest.time_s
        servo.rest(0.3)
        assert 0.3 <= servo.latest.time_s - began_s < 0.5


def test_states_come_at_the_rate_that_was_asked_for() -> None:
    states: list[ServoState] = []
    with servo_on_a_wire() as wire, control_servo(wire, on_state=states.append, rate_hz=100.0) as servo:
        states.clear()
        servo.rest(0.3)
        assert np.median(np.diff([state.time_s for state in states])) == pytest.approx(0.01, abs=2e-3)


def test_a_stop_on_request_holds_the_shaft_where_it_is() -> None:
    with servo_on_a_wire() as wire, control_servo(wire) as servo:
        took_s: list[float] = []

        def stop() -> None:
            began_s = wire.clock.now_s()
            assert servo.stop().at_rest
            took_s.append(wire.clock.now_s() - began_s)

        with pytest.raises(Fault) as fault:
            servo.move(turn(servo.latest.q_rad[0], 300.0), act_at_speed(wire, stop))
        assert fault.value.name == "servo_stopped"
        assert took_s[0] < 1.0
        assert abs(wire.rate_rad_s) < STANDS_RAD_S
        assert wire.do("register", "Torque Enable") == 1
        with pytest.raises(Fault):
            servo.rest(0.1)


def test_ctrl_c_stops_the_shaft_and_the_last_line_says_how_it_was_left() -> None:
    with servo_on_a_wire() as wire:
        with pytest.raises(KeyboardInterrupt) as interrupt, control_servo(wire) as servo:
            watch = act_at_speed(wire, lambda: signal.raise_signal(signal.SIGINT))
            servo.move(turn(servo.latest.q_rad[0], 300.0), watch)
        assert abs(wire.rate_rad_s) < STANDS_RAD_S
        assert "the shaft is at rest" in interrupt.value.__notes__[0]


def test_what_the_watch_raises_stops_the_shaft_and_goes_on_to_the_caller() -> None:
    def disk_full() -> None:
        raise OSError(28, "No space left on device")

    with servo_on_a_wire() as wire:
        with pytest.raises(OSError), control_servo(wire) as servo:
            servo.move(turn(servo.latest.q_rad[0], 300.0), act_at_speed(wire, disk_full))
        assert abs(wire.rate_rad_s) < STANDS_RAD_S


def test_a_state_that_nobody_takes_stops_the_shaft() -> None:
    armed: list[bool] = []

    def take(state: ServoState) -> None:
        if armed and abs(state.qd_rad_s[0]) > 1.0:
            raise ValueError("not mine")

    with servo_on_a_wire() as wire:
        with pytest.raises(Fault) as fault, control_servo(wire, on_state=take) as servo:
            armed.append(True)
            servo.move(turn(servo.latest.q_rad[0], 300.0))
        assert fault.value.name == "servo_state_not_taken"
        assert abs(wire.rate_rad_s) < STANDS_RAD_S


def test_one_program_at_a_time_has_the_port() -> None:
    with servo_on_a_wire(pty=True) as wire, Servo(wire.port, MODEL, clock=wire.clock):
        with pytest.raises(Refused) as refused, Servo(wire.port, MODEL, clock=wire.clock):
            pass
        assert refused.value.name == "servo_port_in_use"


@pytest.mark.one_in(3)
@pytest.mark.parametrize("name", ["servo_out_of_range", "servo_too_fast", "servo_move_too_long"])
def test_a_move_that_the_servo_cannot_make_is_not_begun(name: str) -> None:
    motion = {
        "servo_out_of_range": turn(1700.0, 90.0, 120.0),
        "servo_too_fast": turn(0.5, 90.0, 400.0),
        "servo_move_too_long": turn(0.5, 360.0, 8.0),
    }[name]
    with servo_on_a_wire() as wire:
        with pytest.raises(Fault) as fault, control_servo(wire) as servo:
            assert [problem.name for problem in servo.problems(BOARD, [motion])] == [name]
            before_rad = wire.angle_rad
            servo.move(motion)
        assert fault.value.name == name
        assert abs(wire.angle_rad - before_rad) < math.radians(0.5)
