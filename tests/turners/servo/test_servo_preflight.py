"""What of a servo is refused by name before anything moves."""

from dataclasses import replace
from pathlib import Path

import pytest
import serial

from rig.config.procedures.servo_section import ServoSection
from rig.errors import Refused
from rig.motion.carried import FlangeLoad
from rig.motion.steps import Plan, Transfer
from rig.turners.servo.latency import lower_latency
from rig.turners.servo.servo_driver import Servo
from rig.turners.servo.servo_kind import SERVO
from rig.turners.servo.servo_preflight import servo_problems
from rig.world.servo.truth import LineTruth, ServoTruth
from support.wires.driven_servo import BOARD, MODEL
from support.wires.servo_on_a_wire import PLAIN, SET_UP, servo_on_a_wire

pytestmark = pytest.mark.usefixtures("no_crowd")  # their clock stands while the machine is busy

GOOD = ServoTruth(settings=SET_UP)


def set_up(**registers: int) -> ServoTruth:
    return replace(GOOD, settings=SET_UP | {name.replace("_", " "): value for name, value in registers.items()})


REFUSED: dict[str, tuple[str, tuple[ServoTruth, ...], LineTruth]] = {
    "another model": ("other_servo", (replace(GOOD, model="XM430-W210"),), PLAIN),
    "a model nobody knows": ("other_servo", (set_up(Model_Number=1200),), PLAIN),
    "no watchdog": ("servo_firmware_old", (replace(GOOD, firmware=37, settings={"Baud Rate": 3}),), PLAIN),
    "no time-based profile": ("servo_firmware_old", (replace(GOOD, firmware=41, settings={"Baud Rate": 3}),), PLAIN),
    "torque on by itself": ("servo_starts_by_itself", (set_up(Startup_Configuration=1),), PLAIN),
    "RAM restored": ("servo_starts_by_itself", (set_up(Startup_Configuration=2),), PLAIN),
    "homing offset": ("servo_homing_offset", (set_up(Homing_Offset=-100),), PLAIN),
    "secondary ID": ("servo_secondary_id", (set_up(Secondary_ID=7),), PLAIN),
    "no shutdown by overload": ("servo_unprotected", (set_up(Shutdown=0x14),), PLAIN),
    "low voltage": ("servo_hardware_error", (replace(GOOD, voltage_v=8.9),), PLAIN),
    "hot": ("servo_hot", (replace(GOOD, temperature_c=75.0),), PLAIN),
    "another baud rate": ("no_servo", (set_up(Baud_Rate=1),), PLAIN),
    "another ID": ("no_servo", (set_up(ID=9),), PLAIN),
    "a latency timer of 16 ms": ("servo_line_slow", (GOOD,), LineTruth(latency_ms=16.0)),
    "slow replies": ("servo_line_slow", (GOOD,), LineTruth(reply_delay_ms=12.0)),
    "two with one ID": ("servo_not_alone", (GOOD, replace(GOOD, start_deg=200.0, seed=4)), PLAIN),
    "two with one ID, one of them slow": ("servo_not_alone", (GOOD, set_up(Return_Delay_Time=254)), PLAIN),
}


@pytest.mark.one_in(5)
@pytest.mark.slow
@pytest.mark.parametrize("what", REFUSED)
def test_a_servo_is_refused_by_name_and_stays_as_it_is(what: str) -> None:
    name, truths, line = REFUSED[what]
    with servo_on_a_wire(*truths, line=line) as wire:
        before_rad = wire.angle_rad
        with pytest.raises(Refused) as refused, Servo(wire.port, MODEL, clock=wire.clock) as servo:
            servo.take_control(BOARD)
        assert refused.value.name == name
        assert wire.angle_rad == before_rad


@pytest.mark.slow
@pytest.mark.parametrize("level", [0, 1])
def test_a_servo_that_acknowledges_nothing_is_made_to(level: int) -> None:
    with servo_on_a_wire() as wire:
        wire.do("put", "Status Return Level", level)
        with Servo(wire.port, MODEL, watchdog_s=2.0, clock=wire.clock) as servo:
            servo.take_control(BOARD)
        assert wire.do("register", "Status Return Level") == 2


@pytest.mark.slow
def test_an_adapter_that_echoes_is_none_of_a_second_servo() -> None:
    with (
        servo_on_a_wire(line=LineTruth(echo=True)) as wire,
        Servo(wire.port, MODEL, watchdog_s=2.0, clock=wire.clock) as servo,
    ):
        servo.take_control(BOARD)


def test_a_port_that_is_not_there_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(Refused) as refused, Servo(str(tmp_path / "ttyUSB0"), MODEL):
        pass
    assert refused.value.name == "no_servo_port"


@pytest.mark.slow
def test_a_board_too_far_from_the_shaft_is_refused() -> None:
    with servo_on_a_wire() as wire, Servo(wire.port, MODEL, clock=wire.clock) as servo:
        report = servo.report()
    heavy = FlangeLoad(1.0, (0.1, 0.0, 0.0))
    assert [problem.name for problem in servo_problems(report, MODEL, heavy, 0.1)] == ["servo_load"]
    assert servo_problems(report, MODEL, replace(heavy, centre_m=(0.0, 0.0, 0.1)), 0.1) == []
    held_fast = replace(report, torque_on=True, operating_mode=3)
    assert [problem.name for problem in servo_problems(held_fast, MODEL, BOARD, 0.1)] == ["servo_torque_on"]


def test_of_a_run_that_goes_on_the_movements_behind_it_are_judged_too_and_nothing_is_told_twice() -> None:
    """They are made again in the verification that follows."""
    section = ServoSection(port="/dev/ttyUSB0", model=MODEL, payload_kg=0.1)
    fast = Transfer("ahead", (0.0,), (6.0,), speed_rad_s=50.0, acceleration_rad_s2=500.0, duration_s=0.22)
    nowhere = Transfer("nowhere", (6.0,), (6.0,), speed_rad_s=1.0, acceleration_rad_s2=1.0, duration_s=0.0)
    whole = Plan((fast, nowhere), start_q_rad=(0.0,), home_q_rad=(0.0,))
    for rest in (whole, replace(whole, steps=(nowhere,))):
        told = [problem.name for problem in SERVO.problems([whole, rest], section, None)]
        assert sorted(told) == ["no_duration", "no_travel", "servo_too_fast"]


@pytest.mark.slow
def test_the_latency_timer_of_an_ftdi_adapter_is_set_or_refused_by_name(tmp_path: Path) -> None:
    with servo_on_a_wire(pty=True) as wire:
        timer = tmp_path / Path(wire.port).name / "latency_timer"
        timer.parent.mkdir()
        timer.write_text("16\n")
        with serial.Serial(wire.port) as port:
            lower_latency(port, wire.port, tmp_path)
            assert timer.read_text() == "1"
            timer.unlink()
            timer.symlink_to("/proc/sys/kernel/random/poolsize")  # a number that nobody can write
            with pytest.raises(Refused) as refused:
                lower_latency(port, wire.port, tmp_path)
    assert refused.value.name == "servo_adapter_slow"
