"""What goes wrong with a servo while it turns: named, and the shaft at rest."""

import math
import os
import signal
from collections.abc import Callable
from contextlib import suppress

import pytest

from rig.errors import Fault
from rig.turners.servo.servo_registers import WATCHDOG_TRIPPED
from rig.turners.servo.servo_state import ServoState
from rig.world.servo.truth import ServoTruth
from support.processes.forked import find_fork_server
from support.processes.waiting import wait_for
from support.wires.driven_servo import STANDS_RAD_S, act_at_speed, control_servo, turn, turn_on_and_on
from support.wires.servo_on_a_wire import SET_UP, ServoOnAWire, servo_on_a_wire

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("no_crowd")]  # each fault takes its time to be known

WATCHDOG_S = 0.3  # the driver's own
MANY = 10**6

Act = Callable[[ServoOnAWire], object]
# What happens → the names it may get: which of two signs comes first is a matter of milliseconds.
FAULTS: dict[str, tuple[Act, set[str]]] = {
    "adapter pulled out": (lambda wire: wire.do("pull_out"), {"servo_port_lost"}),
    "bus cable pulled": (lambda wire: wire.do("of_line", "silent", True), {"servo_link_lost"}),
    "supply off": (lambda wire: wire.do("switch", False), {"servo_link_lost"}),
    "supply off and on": (
        lambda wire: (wire.do("switch", False), wire.do("switch", True)),
        {"servo_restarted", "servo_torque_lost"},
    ),
    "shaft held fast": (lambda wire: wire.do("fault", "held_fast", True), {"servo_overload"}),
    "too hot": (lambda wire: wire.do("fault", "temperature_c", 85.0), {"servo_overheated"}),
    "voltage gone low": (lambda wire: wire.do("fault", "voltage_v", 8.0), {"servo_hardware_error"}),
    "torque switched off by another program": (lambda wire: wire.do("let_go"), {"servo_torque_lost"}),
    "answers nothing more": (lambda wire: wire.do("fault", "dumb", True), {"servo_link_lost"}),
    "every reply damaged": (lambda wire: wire.do("of_bus", "spoil", MANY), {"servo_replies_damaged"}),
    "every reply lost": (lambda wire: wire.do("of_bus", "lose", MANY), {"servo_link_lost"}),
    "a second servo with its ID": (
        lambda wire: wire.do("add", ServoTruth(settings=SET_UP, start_deg=200.0, seed=9)),
        {"servo_replies_damaged", "servo_link_lost", "servo_restarted", "servo_hardware_error"},
    ),
    "watchdog tripped": (lambda wire: wire.do("trip"), {"servo_watchdog_tripped"}),
    "started anew by another program": (lambda wire: wire.do("reboot"), {"servo_restarted", "servo_torque_lost"}),
}


@pytest.mark.one_in(6)
@pytest.mark.parametrize("what", FAULTS)
def test_a_fault_is_named_and_the_shaft_stands_within_a_second_of_it(what: str) -> None:
    act, names = FAULTS[what]
    truth = ServoTruth(settings=SET_UP | {"Shutdown": 0x35}, overload_after_s=0.3)
    with servo_on_a_wire(truth) as wire:
        with pytest.raises(Fault) as fault, control_servo(wire, WATCHDOG_S) as servo:
            servo.move(turn(servo.latest.q_rad[0], 340.0), act_at_speed(wire, lambda: act(wire)))
        assert fault.value.name in names
        rate_rad_s = wire.rate_rad_s
        assert abs(rate_rad_s) < STANDS_RAD_S


def test_a_stop_that_the_servo_refuses_is_told_with_its_error() -> None:
    """Its watchdog stops the shaft then, as nobody speaks to it any more."""
    with servo_on_a_wire() as wire:
        with pytest.raises(Fault) as fault, control_servo(wire, WATCHDOG_S) as servo:

            def deny_and_stop() -> None:
                wire.do("fault", "denies", True)
                raise Fault("board_link_lost", "the board is gone", "plug it in")

            servo.move(turn(servo.latest.q_rad[0], 340.0), act_at_speed(wire, deny_and_stop))
        notes = " ".join(getattr(fault.value, "__notes__", ()))
        assert "the servo refused the stop (error 1 at " in f"{fault.value} {notes}", (fault.value, notes)


@pytest.mark.thorough
def test_a_few_lost_replies_are_borne() -> None:
    with servo_on_a_wire() as wire, control_servo(wire) as servo:
        servo.move(turn(servo.latest.q_rad[0], 60.0), act_at_speed(wire, lambda: wire.do("of_bus", "lose", 3)))
        assert servo.missed_states >= 3


def test_a_lost_acknowledgement_moves_the_shaft_once() -> None:
    with servo_on_a_wire() as wire, control_servo(wire) as servo:
        wire.do("of_bus", "lose", 2)
        before_rad = wire.angle_rad
        servo.move(turn(servo.latest.q_rad[0], 40.0))
        assert abs(math.degrees(wire.angle_rad - before_rad) - 40.0) < 4.0


def test_a_driver_that_says_nothing_for_too_long_is_stopped_by_the_watchdog() -> None:
    """A disk that blocks the taker of states blocks the driver's thread."""
    slept: list[bool] = []

    def take(state: ServoState) -> None:
        if abs(state.qd_rad_s[0]) > 1.0 and not slept:
            slept.append(True)
            with wire.clock.without_the_driver():
                wait_for(lambda: wire.do("register", "Bus Watchdog") == WATCHDOG_TRIPPED, "the watchdog's trip")

    with servo_on_a_wire() as wire:
        with pytest.raises(Fault) as fault, control_servo(wire, 0.2, on_state=take) as servo:
            servo.move(turn(servo.latest.q_rad[0], 340.0))
        assert fault.value.name == "servo_watchdog_tripped"
        assert abs(wire.rate_rad_s) < STANDS_RAD_S


def test_a_shaft_that_does_not_arrive_is_stopped() -> None:
    truth = ServoTruth(settings=SET_UP, overload_after_s=1000.0)
    with servo_on_a_wire(truth) as wire:
        with pytest.raises(Fault) as fault, control_servo(wire) as servo:
            watch = act_at_speed(wire, lambda: wire.do("fault", "held_fast", True))
            servo.move(turn(servo.latest.q_rad[0], 60.0), watch)
        assert fault.value.name == "servo_slower_than_planned"


def test_a_falling_board_is_told_where_torque_is_gone() -> None:
    truth = ServoTruth(settings=SET_UP, fall_deg_s=-40.0)
    with servo_on_a_wire(truth) as wire:
        with pytest.raises(Fault) as fault, control_servo(wire) as servo:
            watch = act_at_speed(wire, lambda: wire.do("fault", "temperature_c", 85.0))
            servo.move(turn(servo.latest.q_rad[0], 300.0), watch)
        assert fault.value.name == "servo_overheated"
        assert "no state shows that the shaft is at rest" in fault.value.what
        assert "only the switch of its supply is sure" in fault.value.remedy


def test_a_program_that_hangs_in_a_move_is_stopped_by_its_own_driver() -> None:
    with servo_on_a_wire() as wire:
        with pytest.raises(Fault) as fault, control_servo(wire) as servo:
            motion = turn(servo.latest.q_rad[0], 1000.0)
            servo.move(motion, act_at_speed(wire, lambda: wait_for(lambda: servo._problem is not None, "a problem")))
        assert fault.value.name == "servo_unwatched"
        assert abs(wire.rate_rad_s) < STANDS_RAD_S


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_program_that_is_killed_or_frozen_leaves_a_shaft_that_stands_within_a_second(how: signal.Signals) -> None:
    with servo_on_a_wire() as wire:
        program = find_fork_server().Process(
            target=turn_on_and_on, args=(wire.port, WATCHDOG_S, wire.clock), daemon=True
        )
        program.start()
        try:
            wait_for(lambda: abs(wire.rate_rad_s) > 1.0, "the shaft turns")
            assert program.pid is not None
            os.kill(program.pid, how)
            wire.clock.go_on_until(wire.clock.now_s() + 1.0)
            assert abs(wire.rate_rad_s) < STANDS_RAD_S
            assert (wire.do("register", "Bus Watchdog"), wire.do("register", "Torque Enable")) == (WATCHDOG_TRIPPED, 1)
        finally:
            with suppress(ProcessLookupError):
                program.kill()
            program.join()
