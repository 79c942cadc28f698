"""Which arm answers: the configured one is moved, by its own lengths and limits; any other is refused by its name."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.commands.configured import load_configured
from rig.config.models import ArmSection
from rig.config.ranges import ModelName
from rig.errors import Problem, Refused
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import NOMINAL, distance_to_forearm, distance_to_upper_arm, lengths_m
from rig.motion.turner_state import JointLimits
from rig.turners.ur.arm_driver import look
from rig.turners.ur.arm_preflight import preflight_problems
from rig.turners.ur.arm_report import ArmReport, ArmSetup
from rig.turners.ur.identity import identify_model, identity_problems
from rig.world.ur10e.motion.arm_models import MODELS
from support.laboratories.commands import rig
from support.laboratories.worlds import World, WorldHandle, hardware, worlds
from support.page.scripted_runs import report

ARM = ArmSection(host="10.0.0.2", payload_kg=0.3)
BY_NOMINAL = ArmSection(host="10.0.0.2", payload_kg=0.3, kinematics="nominal")
X = {"polyscope": "10.8.0.0"}


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> ArmReport:
    """A look at the simulated UR10e."""
    with worlds(tmp_path_factory.mktemp("ur10e")) as world:
        return look(world().host)


def names(arm: ArmSection, told: ArmReport) -> list[str]:
    return [problem.name for problem in identity_problems(arm, told)]


def untouched(laboratory: WorldHandle) -> bool:
    """Nobody has sent it a program, and no joint has moved."""
    state = laboratory.state()
    return not state["messages"] and state["still_since_s"] == 0 and state["claims"] == []


@pytest.mark.slow
def test_a_ur10e_is_what_was_meant_and_says_what_it_can_do(seen: ArmReport) -> None:
    assert identity_problems(ARM, seen) == []
    assert seen.version == (5, 14, 0, 0) and seen.called == "UR10"
    assert seen.words.startswith("Universal Robots UR10e or UR12e, serial number 20265500123, PolyScope ")
    assert seen.setup is not None
    limits = seen.setup.limits
    np.testing.assert_allclose(np.degrees(limits.speed_rad_s), [120, 120, 180, 180, 180, 180])
    np.testing.assert_allclose(np.degrees([limits.least_rad, limits.greatest_rad]).T, [[-360, 360]] * 6)
    np.testing.assert_allclose(lengths_m(seen.setup.nominal), lengths_m(NOMINAL), atol=1e-12)


@pytest.mark.one_in(2)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("arm", "name", "words"),
    [
        ({"model": "ur5e"}, "other_arm", "is a UR5e or UR7e; configured is ur10e (by its type, 1)"),
        (X, "polyscope_x", "PolyScope X 10.8.0"),
    ],
    ids=["UR5e", "PolyScope X"],
)
def test_check_and_run_refuse_another_arm_by_name_and_touch_it_not(
    world: World, tmp_path: Path, arm: Mapping[str, Any], name: str, words: str
) -> None:
    laboratory = world({"world": {"arm": arm}})
    config = hardware(laboratory.config_path, tmp_path)
    for done in (rig("check", config), rig("run", config, "--out", tmp_path / "run", "--yes")):
        assert done.returncode == 2
        assert f"{name}: " in done.stderr and words in done.stderr, done.stderr
    assert untouched(laboratory)
    assert not (tmp_path / "run" / "run.h5").exists()


def refusal(host: str) -> Problem:
    """Why the arm there is not moved, found by looking."""
    try:
        (problem,) = identity_problems(ARM, look(host))
    except Refused as refused:
        return refused.problem
    return problem


@pytest.mark.thorough
@pytest.mark.one_in(5)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("arm", "name", "words"),
    [
        ({"model": "ur20"}, "other_arm", "is a UR20; configured is ur10e"),
        (
            {"model": "ur10_cb3", "polyscope": "5.14.0.0"},
            "other_arm",
            "its height of the shoulder is 0.127 m, a UR10e's 0.181 m",
        ),
        ({"model": "ur10_cb3"}, "cb3_not_supported", "one of the CB3 series (software 3.15.8)"),
        (
            {"polyscope": "10.9.9.0"},
            "polyscope_x",
            "PolyScope X 10.9.9, and the rig can stop an arm there only since version 10.10",
        ),
        ({"polyscope": "10.10.0.0", "primary": False}, "no_primary_interface", "stops a PolyScope X there"),
        ({"polyscope": "10.9.9.0", "primary": False}, "polyscope_x", "PolyScope X 10.9.9"),
        ({"dashboard": False}, "no_dashboard", "does not answer"),
    ],
    ids=["UR20", "lengths", "CB3", "PolyScope X 10.9", "closed primary", "both", "closed dashboard"],
)
def test_a_look_tells_any_other_arm_by_name(world: World, arm: Mapping[str, Any], name: str, words: str) -> None:
    problem = refusal(world({"world": {"arm": arm}}).host)
    assert problem.name == name and words in problem.what, problem


@pytest.mark.thorough
@pytest.mark.slow
def test_a_plan_is_held_against_the_controllers_limits_where_they_are_narrower(world: World, tmp_path: Path) -> None:
    narrow = {
        "joint_speed_limits_deg_s": [120, 120, 180, 180, 180, 30],
        "joint_limits_deg": [360, 360, 360, 360, 175, 360],
    }
    laboratory = world({"world": {"arm": narrow}})
    config = hardware(laboratory.config_path, tmp_path)
    done = rig("run", config, "--out", tmp_path / "run", "--yes")
    assert done.returncode == 2 and "rig: joint_speed: " in done.stderr, done.stderr
    assert "turns wrist_3 at 60.0°/s; the controller's limit is 30.0°/s" in done.stderr
    assert "sweep wrist_2 cw takes wrist_2 from" in done.stderr and "sweep wrist_1 cw takes" not in done.stderr
    assert "beyond -175.0° to 175.0°, the controller's limits" in done.stderr and "safety settings" in done.stderr
    assert untouched(laboratory)


@pytest.mark.slow
def test_an_arm_that_cannot_be_told_is_not_moved(world: World, seen: ArmReport) -> None:
    closed = look(world({"world": {"arm": {"primary": False}}}).host)
    assert closed.setup is None and closed.kinematics is None
    assert names(BY_NOMINAL, closed) == []  # its dashboard says UR10, its software e-Series: that is a UR10e or UR12e
    assert identify_model(closed) == "UR10e or UR12e"
    assert names(BY_NOMINAL, replace(closed, called="UR5")) == ["other_arm"]
    assert names(BY_NOMINAL, replace(closed, called="could not understand: 'get robot model'")) == [
        "arm_not_identified"
    ]
    assert names(ARM, replace(closed, called=None, kinematics=seen.kinematics)) == []  # made as a UR10e is


@pytest.mark.slow
@pytest.mark.parametrize(("robot_type", "model"), [(3, "UR3e"), (4, "UR16e"), (9, "UR15"), (12, "arm of type 12")])
def test_the_maker_has_other_sizes_which_are_refused_by_type(seen: ArmReport, robot_type: int, model: str) -> None:
    assert seen.setup is not None
    told = replace(seen, setup=replace(seen.setup, robot_type=robot_type))
    assert names(ARM, told) == names(BY_NOMINAL, told) == ["other_arm"]
    assert identify_model(told) == model


@pytest.mark.slow
def test_lengths_decide_where_the_type_is_right(seen: ArmReport) -> None:
    assert seen.kinematics is not None
    shorter = replace(seen.kinematics, a_m=(0.0, -0.4784, -0.36, 0.0, 0.0, 0.0))
    assert names(ARM, replace(seen, kinematics=shorter)) == ["other_arm"]
    assert names(BY_NOMINAL, replace(seen, kinematics=shorter)) == []  # what is reckoned with is the drawing's


@pytest.mark.slow
def test_a_factorys_calibration_is_still_a_ur10e_wherever_its_axes_meet(seen: ArmReport) -> None:
    """A UR10e whose axes are off by half a millimetre and a milliradian, in the parameters of its own axes.

    Those of shoulder, elbow and wrist 1 are almost parallel: their common normals lie hundreds of metres away, and the
    lengths between them are those there.
    """
    measured = DenavitHartenberg(
        (-9.00793955e-05, 0.466253311, 0.704677615, -1.17060973, -0.000409390551, -0.000320450916),
        (5.24741848e-05, -0.547003746, -0.222657572, -0.000439441089, 0.000758133281, 0.00036612413),
        (0.180880875, 367.120797, -1001.16758, 634.221071, 0.119919, 0.116363535),
        (1.57108444, 0.000748225005, -0.00083241646, 1.5695189, -1.5708579, 0.000706724569),
    )
    assert names(ARM, replace(seen, kinematics=measured)) == []
    np.testing.assert_allclose(lengths_m(measured), lengths_m(NOMINAL), atol=3e-3)
    q = np.radians([[0, -90, 90, -90, angle, 0] for angle in range(-180, 180, 10)])
    np.testing.assert_allclose(distance_to_forearm(q, arm=measured), distance_to_forearm(q), atol=3e-3)
    end = (0.0, 0.0, 0.3)
    for arm in (measured, NOMINAL):
        far_m = distance_to_upper_arm(q, end, arm, offset_m=0.1762)
        np.testing.assert_allclose(far_m, distance_to_upper_arm(q, end, offset_m=0.1762), atol=3e-3)


def test_another_arms_clearance_is_by_its_own_lengths() -> None:
    short = replace(
        NOMINAL,
        a_m=(0.0, -0.425, -0.3922, 0.0, 0.0, 0.0),
        d_m=(0.1625, 0.0, 0.0, 0.1333, 0.0997, 0.0996),
    )
    q = np.radians([[0, -90, 90, -90, angle, 0] for angle in range(-180, 180)])
    assert distance_to_forearm(q).min() == pytest.approx(0.133, abs=1e-3)
    assert distance_to_forearm(q, arm=short).min() < 0.115


def test_nothing_else_is_said_of_an_arm_that_is_not_meant() -> None:
    plan = load_configured(Path("configs/demo.yaml")).phase.plan()
    told = replace(report(plan.start_q_rad), called="an arm")
    assert names(ARM, told) == ["arm_not_identified"]
    assert [p.name for p in preflight_problems([plan], ARM, told)] == ["arm_not_identified"]


ALIKE = ({"ur5e", "ur7e"}, {"ur10e", "ur12e"})  # their controllers say the same, and they are made alike


def told_by(key: ModelName, told: ArmReport) -> ArmReport:
    """What the controller of that model says, by the table of the simulated laboratory."""
    world = MODELS[key]
    a, d, quarters = zip(*world.nominal, strict=True)
    nominal = DenavitHartenberg((0.0,) * 6, a, d, tuple(quarter * pi / 2 for quarter in quarters))
    least = tuple(-limit for limit in world.limit_rad)
    limits = JointLimits(least, world.limit_rad, world.speed_rad_s, (40.0,) * 6)
    setup = ArmSetup(world.robot_type, nominal, limits)
    return replace(told, version=world.polyscope, called=world.name, setup=setup, kinematics=nominal)


@pytest.mark.slow
@pytest.mark.parametrize("kinematics", ["controller", "nominal"])
def test_no_arm_is_taken_for_another(kinematics: str) -> None:
    """Of all pairs of a configured model and an arm that answers, with and without its primary interface's account."""
    seen = report((0.0,) * 6)
    for meant, found in product(MODELS, MODELS):
        arm = ArmSection.model_validate(
            {"host": "10.0.0.2", "payload_kg": 0.3, "model": meant, "kinematics": kinematics}
        )
        same = meant == found or {meant, found} in ALIKE
        whole = told_by(found, seen)
        for told in (whole, replace(whole, setup=None), replace(whole, setup=None, kinematics=None)):
            said = names(arm, told)
            assert (said == []) == same, (meant, found, said)
            assert same or said[0] in ("other_arm", "cb3_not_supported")


def test_the_refusal_names_both_arms() -> None:
    (problem,) = identity_problems(ARM, told_by("ur5e", report((0.0,) * 6)))
    assert problem.what == "the controller at 127.0.0.2 is a UR5e or UR7e; configured is ur10e (by its type, 1)"
    assert "arm.model" in problem.remedy


@pytest.mark.slow
def test_no_arm_is_still_no_arm() -> None:
    with pytest.raises(Refused, match="no arm answers"):
        look("127.0.3.249")
