"""Pre-flight names each problem and its remedy before anything moves."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rig.config.models import ArmSection
from rig.config.procedures.attitude_sets import FACE_ATTITUDES, OPTIMAL_ATTITUDES
from rig.config.procedures.procedure_sections import SixObservationSection, StaticAttitudesSection
from rig.errors import Problem, Refused, refuse
from rig.motion.carried import FlangeLoad
from rig.motion.geometry import NOMINAL, distance_to_forearm
from rig.motion.preflight import find_travel_to_home
from rig.motion.steps import Dwell, Motion, Plan, Rest, Transfer
from rig.motion.turner_state import ArmState, Joints, RobotMode, RuntimeState, SafetyMode
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.plans.motions.static_attitudes import plan_static_attitudes
from rig.turners.ur.arm_preflight import arm_problems, kinematics_problems, make_recorded, preflight_problems
from rig.turners.ur.arm_report import ArmReport
from rig.turners.ur.condition import program_interruption, readiness
from support.wires.ur10e import plan_problems

HOME_DEG = (0.0, -90.0, 90.0, -90.0, -90.0, 0.0)
ARM = ArmSection(host="10.0.0.2", payload_kg=0.3)
LIGHT = FlangeLoad(0.3)
SWEPT_BESIDE = (*HOME_DEG[:3], 0.0, *HOME_DEG[4:])
SWEPT_INTO = (*HOME_DEG[:3], 90.0, *HOME_DEG[4:])
HOME: Joints = tuple(math.radians(angle) for angle in HOME_DEG)

READY = ArmState(
    time_s=1.0,
    host_time_s=1.0,
    q_rad=HOME,
    qd_rad_s=(0.0,) * 6,
    target_speed_fraction=1.0,
    speed_scaling=1.0,
    robot_mode=RobotMode.RUNNING,
    safety_mode=SafetyMode.NORMAL,
    runtime_state=RuntimeState.STOPPED,
    robot_status_bits=1,
    safety_status_bits=1,
)
REPORT = ArmReport(
    host="10.0.0.2",
    version=(5, 14, 0, 0),
    polyscope="URSoftware 5.14.0.0",
    serial_number="20265500123",
    remote_control=True,
    program_running=False,
    state=READY,
)


def plan(home_deg: tuple[float, ...] = HOME_DEG, transfer_speed_deg_s: float = 90.0, **procedure: object) -> Plan:
    arm = ArmSection.model_validate(
        {"host": "10.0.0.2", "payload_kg": 0.3, "home_deg": home_deg, "transfer_speed_deg_s": transfer_speed_deg_s}
    )
    return plan_six_observation(arm, SixObservationSection.model_validate(procedure))


def names(problems: list[Problem]) -> list[str]:
    assert all(problem.what and problem.remedy for problem in problems)
    return sorted({problem.name for problem in problems})


def test_the_default_plan_and_a_ready_arm_have_no_problems() -> None:
    assert plan_problems(plan(), LIGHT) == []
    assert arm_problems(plan(), REPORT) == []


def test_too_slow_an_acceleration_takes_the_wrist_beyond_its_joint_limit() -> None:
    problems = plan_problems(plan(speed_deg_s=150, acceleration_deg_s2=80), LIGHT)
    assert names(problems) == ["joint_limit"]
    assert "wrist_1" in problems[0].what


FAR = (*HOME[:5], HOME[5] + math.radians(300))
BEYOND = (*HOME[:5], HOME[5] + math.radians(370))


@pytest.mark.parametrize(
    ("made", "remedy"),
    [
        (plan(speed_deg_s=150, acceleration_deg_s2=80), "shorten the run-up"),
        (plan(arc_deg=720), "Lower procedure.arc_deg"),
        (replace(plan(), steps=(Transfer("there", FAR, BEYOND, 1.0, 1.0, 2.0),)), "leave out the attitudes"),
        (replace(plan(), steps=(Transfer("back", BEYOND, HOME, 1.0, 1.0, 7.0),)), "from the pendant"),
    ],
    ids=["run-up", "two turns", "an attitude", "where it stands"],
)
def test_a_joint_beyond_its_range_gets_the_remedy_that_fits(made: Plan, remedy: str) -> None:
    assert any(remedy in problem.remedy for problem in plan_problems(made, LIGHT) if problem.name == "joint_limit")


@pytest.mark.parametrize("driven", [plan(speed_deg_s=180, acceleration_deg_s2=800), plan(SWEPT_INTO)])
def test_the_plan_that_is_driven_is_judged_as_the_one_announced(driven: Plan) -> None:
    arm, report = ARM.model_copy(update={"kinematics": "nominal"}), replace(REPORT, called="UR10")
    wrong = names(plan_problems(driven, LIGHT))
    for plans in ([driven, plan()], [plan(), driven]):
        assert names(preflight_problems(plans, arm, report)) == wrong != []


def test_wrists_stay_below_the_speed_that_the_client_accepts() -> None:
    problems = plan_problems(plan(speed_deg_s=180, acceleration_deg_s2=800), LIGHT)
    assert names(problems) == ["joint_speed"]
    assert "179.9°/s" in problems[0].what


def test_a_base_that_leads_a_motion_is_held_to_its_own_limit() -> None:
    away = (math.radians(90), *HOME[1:])
    swing = Transfer("swing", HOME, away, math.radians(150), 4.0, 1.0)
    problems = plan_problems(replace(plan(), steps=(*plan().steps, swing)), LIGHT)
    assert names(problems) == ["joint_speed"]
    assert "base" in problems[0].what


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"duration_s": 0.0}, "no_duration"),
        ({"duration_s": math.nan}, "no_duration"),
        ({"target_q_rad": HOME}, "no_travel"),
        ({"target_q_rad": (*HOME[:5], math.nan)}, "no_travel"),
        ({"speed_rad_s": 0.0}, "no_speed"),
        ({"acceleration_rad_s2": -1.0}, "no_speed"),
    ],
)
def test_a_step_that_is_none_is_refused_by_name(change: dict[str, Any], name: str) -> None:
    step = replace(Transfer("there", HOME, (*HOME[:5], 0.5), 0.5, 1.0, 2.0), **change)
    assert names(plan_problems(Plan((step,), HOME, HOME), LIGHT)) == [name]


def test_a_rest_takes_time() -> None:
    assert names(plan_problems(Plan((Rest("a rest", 0.0),), HOME, HOME), LIGHT)) == ["no_duration"]


def test_payload_beyond_the_arm_is_refused() -> None:
    assert names(plan_problems(plan(), FlangeLoad(13.0))) == ["payload_too_heavy"]


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"robot_mode": RobotMode.POWER_OFF}, "arm_not_running"),
        ({"robot_mode": 99}, "arm_not_running"),
        ({"safety_mode": SafetyMode.REDUCED}, "reduced_mode"),
        ({"safety_mode": SafetyMode.PROTECTIVE_STOP}, "protective_stop"),
        ({"safety_mode": SafetyMode.ROBOT_EMERGENCY_STOP, "robot_mode": RobotMode.POWER_OFF}, "emergency_stop"),
        ({"safety_mode": 99}, "safety_not_normal"),
        ({"safety_status_bits": 1 << 2 | 1 << 10}, "protective_stop"),
        ({"safety_status_bits": 1 << 6}, "emergency_stop"),
        ({"target_speed_fraction": 0.5}, "speed_slider"),
        ({"qd_rad_s": (0, 0, 0, 0, 0, 0.1)}, "arm_moves"),
        ({"q_rad": (math.radians(170), *HOME[1:])}, "far_from_home"),
    ],
)
def test_an_arm_that_is_not_ready_is_refused_by_name(change: dict[str, Any], name: str) -> None:
    state = replace(READY, **change)
    assert names(arm_problems(plan(), replace(REPORT, state=state))) == [name]


def test_local_control_and_a_running_program_are_refused() -> None:
    report = replace(REPORT, remote_control=False, program_running=True)
    assert names(arm_problems(plan(), report)) == ["not_in_remote_control", "program_running"]


def test_the_simulator_address_and_an_old_controller_need_no_remote_control() -> None:
    assert arm_problems(plan(), replace(REPORT, host="127.0.0.1", remote_control=False)) == []
    assert arm_problems(plan(), replace(REPORT, remote_control=None)) == []


def test_the_way_home_is_told_for_each_joint() -> None:
    start = (HOME[0] + 0.1, *HOME[1:5], HOME[5] - 0.2)
    assert find_travel_to_home(plan(), start) == pytest.approx((-0.1, 0, 0, 0, 0, 0.2))


def test_refusal_carries_every_problem_and_is_named_after_the_first() -> None:
    with pytest.raises(Refused) as refused:
        refuse(arm_problems(plan(), replace(REPORT, remote_control=False, program_running=True)))
    assert refused.value.name == "not_in_remote_control"
    assert "(not_in_remote_control)" in str(refused.value)
    assert "a program runs on the arm at 10.0.0.2" in str(refused.value)
    refuse([])


def test_paused_and_stopped_programs_are_told_apart() -> None:
    paused = program_interruption(replace(READY, runtime_state=RuntimeState.PAUSED))
    stopped = program_interruption(replace(READY, runtime_state=RuntimeState.STOPPED))
    assert paused is not None
    assert stopped is not None
    assert (paused.name, stopped.name) == ("arm_paused", "program_stopped")
    assert program_interruption(replace(READY, runtime_state=RuntimeState.PLAYING)) is None
    assert readiness(READY) is None


def test_the_controllers_account_of_its_arm_is_used_unless_the_file_wants_the_nominal_one() -> None:
    measured = replace(NOMINAL, theta_rad=(0.0, -0.7, 0.3, 0.4, 1e-3, 0.0))
    told = replace(REPORT, kinematics=measured)
    assert make_recorded(ARM, told).kinematics == measured
    nominal = ARM.model_copy(update={"kinematics": "nominal"})
    assert make_recorded(nominal, told).kinematics == make_recorded(nominal, REPORT).kinematics == NOMINAL


def test_an_arm_that_does_not_say_how_it_is_made_is_refused() -> None:
    assert names(kinematics_problems(ARM, REPORT)) == ["no_kinematics"]
    with pytest.raises(Refused, match="no_kinematics"):
        make_recorded(ARM, REPORT)


@pytest.mark.parametrize(("off_deg", "found"), [(0.9, []), (1.1, ["kinematics_disagree"])])
def test_wrists_about_other_axes_than_a_ur10es_are_refused(off_deg: float, found: list[str]) -> None:
    *others, wrist_2, wrist_3 = NOMINAL.alpha_rad
    odd = replace(NOMINAL, alpha_rad=(*others, wrist_2 + math.radians(off_deg), wrist_3))
    assert names(kinematics_problems(ARM, replace(REPORT, kinematics=odd))) == found


def attitudes(*wrists_deg: tuple[float, float, float]) -> Plan:
    return plan_static_attitudes(ARM, StaticAttitudesSection(attitudes=wrists_deg))


def test_an_attitude_that_brings_the_flange_to_the_forearm_is_refused() -> None:
    """Wrist 2 at -135° turns it towards the forearm: to 0.092 m, or a little more, by wrist 1."""
    near = [
        problem for problem in plan_problems(attitudes((45, -135, 0)), LIGHT) if problem.what.startswith("dwell at")
    ]
    assert names(near) == ["forearm_too_near"]
    assert (
        near[0].what
        == "dwell at 45 -135 0 brings the flange within 0.095 m of the forearm's line; at least 0.15 m is required"
    )
    assert plan_problems(attitudes((45, -45, 0)), LIGHT) == []  # away from it


def test_a_way_between_sound_attitudes_that_passes_the_forearm_is_refused() -> None:
    made = attitudes((45, -90, 0), (45, -270, 0))
    assert distance_to_forearm(np.array([dwell.q_rad for dwell in made.dwells])).min() > 0.17
    problems = plan_problems(made, LIGHT)
    assert names(problems) == ["forearm_too_near"]
    assert all(problem.what.startswith("transfer") for problem in problems)


def test_what_the_flange_carries_is_kept_from_the_forearm_too() -> None:
    """Ten degrees beyond -90° the flange itself is clear, at 0.154 m."""
    made = attitudes((45, -100, 0))
    assert plan_problems(made, LIGHT) == []
    said = {
        problem.what.split(" brings the ")[1].split()[0]
        for problem in plan_problems(made, FlangeLoad(0.3, (0.0, 0.0, 0.06)))
    }
    assert said == {"payload"}


@pytest.mark.slow
def test_an_extension_is_kept_from_the_forearm_and_from_the_upper_arm() -> None:
    def problems(made: Plan, extension_m: tuple[float, float, float]) -> set[str]:
        return set(names(plan_problems(made, FlangeLoad(0.3, extension_m=extension_m))))

    magnetic = plan_static_attitudes(ARM, StaticAttitudesSection.model_validate({"attitudes": "magnetic"}))
    assert problems(magnetic, (0.0, 0.0, 0.32)) == set()
    # Along the forearm, to which wrist 1 at 0 turns it, it ends near the elbow.
    assert problems(magnetic, (0.0, 0.0, 0.35)) == {"upper_arm_too_near"}
    assert problems(attitudes((0, -90, 0)), (0.12, 0.0, 0.2)) == {"forearm_too_near"}, "to the side of the flange"
    # Half of it may be nearer than its end.
    assert problems(attitudes((45, -60, 0)), (0.0, 0.0, 0.3)) == set()


def test_a_way_home_from_an_attitude_is_judged_too() -> None:
    back = Transfer("transfer home", (*HOME[:3], math.radians(45), math.radians(-200), 0.0), HOME, 1.0, 2.0, 3.0)
    dwell = Dwell(0, back.start_q_rad, 3.0, 5.0)
    problems = plan_problems(Plan((dwell, back), back.start_q_rad, HOME), LIGHT)
    assert [problem.what.split(" brings")[0] for problem in problems] == [dwell.name, "transfer home"]


@pytest.mark.parametrize(("turned_rad", "found"), [(0.9e-3, []), (1.1e-3, ["tcp_rotated"]), (math.tau - 1e-4, [])])
def test_a_turned_tool_frame_is_refused_where_attitudes_are_visited(turned_rad: float, found: list[str]) -> None:
    told = replace(REPORT, tcp_offset=(0.0, 0.0, 0.12, 0.6 * turned_rad, 0.0, -0.8 * turned_rad))
    assert names(arm_problems(attitudes((45, -90, 0)), told)) == found
    assert arm_problems(plan(), told) == []


def test_it_says_by_how_much_the_frame_is_turned() -> None:
    told = replace(REPORT, tcp_offset=(0.0, 0.0, 0.0, 0.0, 0.0, math.radians(45)))
    (problem,) = arm_problems(attitudes((45, -90, 0)), told)
    assert "turned by 45° relative to the flange's" in problem.what and "TCP to zero" in problem.remedy


@pytest.mark.parametrize("wrist_2_deg", [-110.0, -90.0, 90.0])
@pytest.mark.parametrize("changes", [{}, {"axes": 6}, {"directions": ["ccw", "cw"]}])
def test_sweeps_and_the_ways_between_them_keep_clear_of_the_forearm(
    wrist_2_deg: float, changes: dict[str, Any]
) -> None:
    """Turning together, wrists 1 and 2 would take the flange to 0.087 m with wrist 2 at 90°: they go through home."""
    made = plan((*HOME_DEG[:4], wrist_2_deg, 0.0), **changes)
    assert plan_problems(made, LIGHT) == []
    assert all(nearest_m(motion) > 0.115 for motion in made.motions)


def nearest_m(motion: Motion) -> float:
    return float(distance_to_forearm(np.linspace(motion.start_q_rad, motion.target_q_rad, 300)).min())


def test_a_home_about_which_wrist_2_sweeps_into_the_forearm_is_refused() -> None:
    assert plan_problems(plan(SWEPT_BESIDE), LIGHT) == []
    problems = plan_problems(plan(SWEPT_INTO), LIGHT)
    assert names(problems) == ["forearm_too_near"]
    assert {problem.what for problem in problems} >= {
        f"sweep wrist_2 {way} brings the flange within 0.058 m of the forearm's line; at least 0.115 m is required"
        for way in ("cw", "ccw")
    }
    assert all("wrist 1 in arm.home_deg" in problem.remedy for problem in problems)


@pytest.mark.parametrize("below_m", [0.025, 0.057, 0.12])
def test_a_fixture_below_the_flange_passes_beside_the_forearm_too(below_m: float) -> None:
    assert plan_problems(plan(), FlangeLoad(0.3, (0.0, 0.0, below_m))) == []
    assert names(plan_problems(plan(), FlangeLoad(0.3, (0.0, 0.06, below_m)))) == ["forearm_too_near"]


def test_sweeps_left_out_do_not_lead_the_rest_to_the_forearm() -> None:
    """Straight from the last sweep of wrist 1 that way, the flange would come to 0.087 m."""
    rest = plan_six_observation(ARM, SixObservationSection(), done=(0, 1, 2, 4))
    assert [sweep.index for sweep in rest.sweeps] == [3, 5]
    assert plan_problems(rest, LIGHT) == []


def test_the_way_from_where_the_arm_stands_is_judged() -> None:
    stands = (*HOME[:3], math.radians(90), math.radians(-180), 0.0)
    (problem,) = plan_problems(plan_six_observation(ARM, SixObservationSection(), start_q_rad=stands), LIGHT)
    assert problem.name == "forearm_too_near" and problem.what.startswith("approach home brings")
    assert "from the pendant" in problem.remedy


@pytest.mark.parametrize("made", [attitudes(*OPTIMAL_ATTITUDES), attitudes(*FACE_ATTITUDES)])
def test_the_stock_attitudes_keep_clear_of_the_forearm(made: Plan) -> None:
    """0.174 m, the length of the link before wrist 2, is the least there is with wrist 2 at -90°."""
    assert plan_problems(made, LIGHT) == []
    for way in made.motions:
        poses = np.linspace(way.start_q_rad, way.target_q_rad, 100)
        assert distance_to_forearm(poses).min() > 0.174


def test_a_dwell_takes_time_and_the_poses_must_be_numbers() -> None:
    nowhere = Dwell(0, (math.nan,) * 6, 0.0, 5.0)
    assert names(plan_problems(Plan((nowhere,), HOME, HOME), LIGHT)) == ["no_duration"]
