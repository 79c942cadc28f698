"""The plan of the six observations on one shaft, and the configuration it is made of."""

from math import degrees, pi

import pytest

from rig.config.load import ConfigurationRefused
from rig.config.procedures.servo_procedure import ServoSixObservationSection
from rig.config.procedures.servo_section import ServoSection
from rig.motion.steps import Plan, Rest, Transfer
from rig.plans.motions.servo_sweeps import plan_servo_six_observation
from rig.turners.servo.servo_kind import SERVO
from support.motions.drawn_servo import load_servo


def planned(*overrides: str, start_rad: float | None = None, done: tuple[int, ...] = ()) -> Plan:
    config = load_servo(overrides).config
    assert isinstance(config.turner, ServoSection) and isinstance(config.procedure, ServoSixObservationSection)
    start = None if start_rad is None else (start_rad,)
    return plan_servo_six_observation(config.turner, config.procedure, start, done)


def of_stage(plan: Plan, number: int) -> list[str]:
    begins = [*(stage.begins for stage in plan.stages), len(plan.steps)]
    return [type(step).__name__ for step in plan.steps[begins[number] : begins[number + 1]]]


def test_each_mounting_is_tried_then_turned_once_each_way_between_rests() -> None:
    plan = planned()
    one = ["Transfer", "Transfer", "Transfer", "Rest", "Sweep", "Rest", "Sweep", "Rest", "Transfer"]
    assert [of_stage(plan, stage) for stage in range(3)] == [one] * 3
    assert [step.tries for step in plan.steps if isinstance(step, Transfer)][:3] == [True, False, False]
    assert [sorted(stage.indices) for stage in plan.stages] == [[0, 1], [2, 3], [4, 5]]
    assert [[row[2] for row in stage.mount] for stage in plan.stages] == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]


def test_a_turn_is_a_revolution_and_a_quarter_at_constant_speed() -> None:
    for sweep in planned().sweeps:
        ramp_rad = sweep.speed_rad_s**2 / (2 * sweep.acceleration_rad_s2)
        even_deg = degrees(abs(sweep.end_q_rad[0] - sweep.start_q_rad[0]) - 2 * ramp_rad)
        assert even_deg == pytest.approx(456) and sweep.angle_rad == 2 * pi


def test_every_motion_begins_where_the_last_one_ended_and_all_end_at_home() -> None:
    plan = planned("procedure.repeats=2", start_rad=0.3)
    here: tuple[float, ...] = (0.3,)
    for motion in plan.motions:
        assert motion.start_q_rad == here
        here = motion.target_q_rad
    assert here == plan.home_q_rad and len(plan.sweeps) == 12


def test_what_is_done_is_left_out() -> None:
    plan = planned(done=(0, 1, 2))
    assert [sweep.index for sweep in plan.sweeps] == [3, 4, 5]
    assert of_stage(plan, 0) == [] and of_stage(plan, 1).count("Sweep") == 1
    assert any(isinstance(step, Rest) for step in plan.steps)


def test_the_pace_leaves_little_beside_turning_and_resting() -> None:
    """All that is no sweep, rest or way to a sweep: the trials."""
    plan = planned()
    trials_s = sum(step.duration_s for step in plan.steps if "trial" in getattr(step, "name", ""))
    assert trials_s < 0.1 * plan.duration_s


@pytest.mark.parametrize(
    ("override", "what"),
    [
        ("procedure.directions=[cw, cw]", "both cw and ccw"),
        ("procedure.stages=[{instruction: as it is}]", "three independent directions"),
        ("procedure.speed_deg_s=200", "must be at least 1.5 times the speed"),
        ("turner.model=mx28", "turner.model"),
        ("turner.port=/dev/ttyUSB0", "socket://host:port"),
        ("turner.port=socket://192.0.2.1:7", "turner.port: '192.0.2.1' must be a loopback address"),
        ("world.time_scale=8", "must be 1 with a servo"),
        ("world.arm={speed_slider: 0.5}", "world.arm: there is none"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_connected(override: str, what: str) -> None:
    with pytest.raises(ConfigurationRefused) as refused:
        load_servo((override,))
    assert any(what in problem for problem in refused.value.problems), refused.value.problems


def test_a_plan_that_no_such_servo_can_drive_is_refused_by_name() -> None:
    plan = planned("procedure.speed_deg_s=10", "procedure.overtravel_deg=360")
    servo = load_servo().config.turner
    assert isinstance(servo, ServoSection)
    assert {problem.name for problem in SERVO.problems([plan], servo, None)} == {"servo_move_too_long"}
    assert SERVO.problems([planned()], servo, None) == []
