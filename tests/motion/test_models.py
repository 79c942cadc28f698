"""Every model of arm: its figures against those of the simulated laboratory, and the plans that it can make."""

import math
from typing import Any, get_args

import numpy as np
import pytest

from rig.config import ranges
from rig.config.models import HOME_POSES, ArmSection
from rig.config.procedures.attitude_sets import ATTITUDE_SETS, OPTIMAL_ATTITUDES
from rig.config.procedures.procedure_sections import SixObservationSection, StaticAttitudesSection
from rig.config.ranges import ModelName
from rig.motion.carried import read_load
from rig.motion.geometry import NOMINAL, flange_axes, lengths_m
from rig.motion.keep_out import find_clearance_problems
from rig.motion.model import CLIENT_SPEED_RAD_S, find_home, load_turner_model, model_of
from rig.motion.steps import Plan, Transfer
from rig.motion.turner_state import JOINT_NAMES
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.plans.motions.static_attitudes import plan_static_attitudes
from rig.turners.ur.plan_problems import plan_problems
from rig.world.ur10e.motion.arm_models import MODELS

NAMES: tuple[ModelName, ...] = get_args(ModelName)
TWO_HOMES: tuple[ModelName, ...] = ("ur3e", "ur10e")
FIXTURES_MM = [(0.0, 0.0, 0.0), (0.0, 0.0, 25.0), (0.0, 0.0, 60.0)]


def arm(model: ModelName, **changes: Any) -> ArmSection:
    return ArmSection.model_validate({"host": "10.0.0.2", "payload_kg": 0.35, "model": model, **changes})


def problems(section: ArmSection, plan: Plan) -> list[str]:
    return [str(problem) for problem in plan_problems(plan, read_load(section), model_of(section))]


@pytest.mark.parametrize("name", NAMES)
def test_two_tables_made_apart_say_the_same_of_an_arm(name: ModelName) -> None:
    ours, theirs = load_turner_model(name), MODELS[name]
    a, d, quarters = np.array(theirs.nominal).T
    np.testing.assert_array_equal([ours.nominal.a_m, ours.nominal.d_m], [a, d])
    np.testing.assert_array_equal(ours.nominal.alpha_rad, quarters * math.pi / 2)
    np.testing.assert_allclose(ours.limits.greatest_rad, theirs.limit_rad)
    np.testing.assert_allclose(ours.limits.least_rad, [-limit for limit in theirs.limit_rad])
    np.testing.assert_allclose(ours.limits.speed_rad_s, np.minimum(theirs.speed_rad_s, CLIENT_SPEED_RAD_S))
    np.testing.assert_allclose(ours.home_rad, np.radians(theirs.home_deg))
    assert (ours.robot_type, ours.payload_kg) == (theirs.robot_type, theirs.payload_kg)
    assert (ours.series == "CB3") == (theirs.polyscope[0] == 3)
    assert ours.name.removesuffix("e") in (theirs.name, "UR7", "UR12")  # these two say that they are a UR5, a UR10
    assert ours.joints == JOINT_NAMES


@pytest.mark.parametrize("name", NAMES)
def test_the_mass_of_a_link_is_no_further_from_its_joint_than_the_link_is_long(name: ModelName) -> None:
    sizes_m = np.abs(np.array(MODELS[name].nominal)[:, :2])
    centres_m = np.array(MODELS[name].bodies.centres_m)
    assert (np.linalg.norm(centres_m, axis=1) <= np.maximum(np.linalg.norm(sizes_m, axis=1), 0.05)).all()


@pytest.mark.parametrize("name", NAMES)
def test_every_row_says_where_its_figures_are_from(name: ModelName) -> None:
    row = load_turner_model(name)
    wanted = {"drawing", "limits", "acceleration", "payload", "room", "state_rate", "home"}
    assert row.sources.keys() == wanted and all(len(source) > 10 for source in row.sources.values())
    height, upper_arm, forearm, *_ = lengths_m(row.nominal)
    assert 0.1 < height < 0.3 and 0.2 < forearm < upper_arm < 0.9
    assert 0.03 <= row.forearm.radius_m <= row.upper_arm.radius_m <= 0.1
    assert 0 <= row.forearm.offset_m < row.upper_arm.offset_m and 0.045 <= row.sweep_room_m <= row.dwell_room_m


def test_a_configuration_ranges_as_far_as_any_of_them() -> None:
    rows = [load_turner_model(name) for name in NAMES]
    assert max(row.payload_kg for row in rows) == ranges.PAYLOAD_RANGE_KG
    fastest = max(max(row.limits.speed_rad_s) for row in rows)
    assert math.degrees(fastest) < ranges.SPEED_RANGE_DEG_S < math.degrees(fastest) + 0.1
    assert {load_turner_model(name).home_rad for name in NAMES} == {
        load_turner_model(name).home_rad for name in TWO_HOMES
    }
    for name in TWO_HOMES:
        home_deg = np.degrees(load_turner_model(name).home_rad).round(9)
        assert str([int(angle) for angle in home_deg]) in HOME_POSES


def test_what_was_recorded_without_a_model_was_a_ur10e() -> None:
    assert load_turner_model("ur10e").nominal == NOMINAL
    assert arm("ur10e") == ArmSection(host="10.0.0.2", payload_kg=0.35)


@pytest.mark.one_in(4)
@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("centre_mm", FIXTURES_MM)
def test_every_model_can_make_the_six_sweeps_about_its_home(name: ModelName, centre_mm: tuple[float, ...]) -> None:
    section = arm(name, payload_centre_mm=centre_mm)
    for axes in (3, 6):
        assert problems(section, plan_six_observation(section, SixObservationSection(axes=axes))) == []
    wrists = flange_axes(find_home(section))[:, 3:]
    assert np.linalg.svd(wrists, compute_uv=False)[2] > 0.7


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("attitudes", ATTITUDE_SETS)
def test_attitudes_are_possible_or_refused_with_the_distance(name: ModelName, attitudes: str) -> None:
    """A UR3e's flange would come to 0.09 m of its upper arm: its forearm is no longer than that takes."""
    section = arm(name)
    procedure = StaticAttitudesSection.model_validate({"attitudes": attitudes})
    found = problems(section, plan_static_attitudes(section, procedure))
    if name != "ur3e":
        assert found == []
    else:
        assert found and all("m of the middle of the upper arm; at least 0.095 m is required" in each for each in found)


def test_a_ur3e_can_stand_in_attitudes_with_wrist_2_away_from_its_arm() -> None:
    section = arm("ur3e")
    away = StaticAttitudesSection.model_validate(
        {"attitudes": [(one, -60, three) for one, _, three in OPTIMAL_ATTITUDES]}
    )
    assert problems(section, plan_static_attitudes(section, away)) == []


@pytest.mark.slow
def test_a_ur3es_home_is_where_it_must_be() -> None:
    """With wrist 2 at -90° the sweep of wrist 1 comes near the upper arm, however the elbow is bent."""
    for elbow_deg in (30, 60, 90, 120):
        section = arm("ur3e", home_deg=(0, -90, elbow_deg, -90, -90, 0))
        found = problems(section, plan_six_observation(section, SixObservationSection()))
        assert any(each.startswith("upper_arm_too_near: sweep wrist_1") for each in found), elbow_deg


def turned(model: ModelName, joint: int, speed_deg_s: float, by_deg: float = 40.0) -> list[str]:
    home = load_turner_model(model).home_rad
    target = tuple(angle + (math.radians(by_deg) if at == joint else 0.0) for at, angle in enumerate(home))
    way = Transfer("a way", home, target, math.radians(speed_deg_s), 2.0, 3.0)
    return problems(arm(model), Plan((way,), home, target))


@pytest.mark.parametrize(
    ("model", "joint", "most_deg_s"),
    [("ur20", 2, 150), ("ur30", 2, 150), ("ur20", 1, 120), ("ur10e", 0, 120), ("ur5e", 0, 179.9), ("ur3e", 5, 179.9)],
)
def test_each_arm_has_its_own_speeds(model: ModelName, joint: int, most_deg_s: float) -> None:
    assert not [each for each in turned(model, joint, most_deg_s - 0.1) if each.startswith("joint_speed")]
    (found,) = [each for each in turned(model, joint, most_deg_s + 0.1) if each.startswith("joint_speed")]
    assert f"the limit is {most_deg_s:.1f}°/s" in found


def test_wrist_3_of_a_ur3e_turns_without_end() -> None:
    assert not [each for each in turned("ur3e", 5, 60, by_deg=800) if each.startswith("joint_limit")]
    assert [each for each in turned("ur3e", 4, 60, by_deg=800) if each.startswith("joint_limit")]
    assert [each for each in turned("ur5e", 5, 60, by_deg=800) if each.startswith("joint_limit")]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "most_kg"), [("ur3e", 3), ("ur5e", 5), ("ur7e", 7.5), ("ur10_cb3", 10), ("ur30", 30)]
)
def test_each_arm_carries_what_it_can(model: ModelName, most_kg: float) -> None:
    for payload_kg, heavy in ((most_kg, False), (min(most_kg + 0.1, 30), most_kg < 30)):
        section = arm(model, payload_kg=payload_kg)
        found = problems(section, plan_six_observation(section, SixObservationSection()))
        assert [each.split(":")[0] for each in found] == ["payload_too_heavy"] * heavy


def test_a_ur5es_plan_is_no_ur10es() -> None:
    """What keeps clear on one arm need not on another: an attitude ten degrees towards the forearm."""
    towards = StaticAttitudesSection.model_validate({"attitudes": [(45, -98, 0)]})
    for section, clear in ((arm("ur10e"), True), (arm("ur5e"), False)):
        made = plan_static_attitudes(section, towards)
        assert (find_clearance_problems(made, read_load(section), model_of(section)) == []) == clear
