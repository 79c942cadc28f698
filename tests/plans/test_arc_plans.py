"""Sweeps that are no whole turns: what is planned, what is refused, and what is said before the arm moves."""

import math

import numpy as np
import pytest

from rig.config.load import ConfigurationRefused, parse
from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.data.recording.settings import settings_of
from rig.errors import Refused
from rig.motion.carried import FlangeLoad
from rig.motion.steps import Plan, closes
from rig.plans.motions.six_sweeps import plan_six_observation
from support.laboratories.commands import rig_here
from support.paths import CONFIGS
from support.wires.ur10e import plan_problems

ARM = ArmSection(host="127.0.0.2", payload_kg=0.35)
DEMO = (CONFIGS / "demo.yaml").read_text(encoding="utf-8")
KNOWN = "uncertainty.angle_std_deg=0.02"


def plan(**settings: object) -> Plan:
    return plan_six_observation(ARM, SixObservationSection.model_validate(settings))


def problems_of(*overrides: str) -> str:
    with pytest.raises(ConfigurationRefused) as caught:
        parse(DEMO, overrides=overrides)
    return "\n".join(caught.value.problems)


@pytest.mark.parametrize("arc_deg", [90.0, 180.0, 270.0])
def test_an_arc_is_centred_on_the_home_pose_with_its_ramps_outside(arc_deg: float) -> None:
    made = plan(arc_deg=arc_deg)
    for sweep in made.sweeps:
        home = made.home_q_rad[sweep.joint]
        assert np.degrees(np.array(sweep.revolution_rad) - home) == pytest.approx([-arc_deg / 2, arc_deg / 2])
        assert math.degrees(sweep.angle_rad) == pytest.approx(arc_deg)
        travelled = math.degrees(abs(sweep.end_q_rad[sweep.joint] - sweep.start_q_rad[sweep.joint]))
        assert arc_deg + 2 * 2.0 < travelled < arc_deg + 25
    assert plan_problems(made, FlangeLoad(0.35)) == []


def test_a_whole_turn_is_what_it_always_was() -> None:
    """2π to the last bit: the speed of a recording that was made before is divided out of it."""
    made = plan()
    assert made == plan(arc_deg=360)
    assert {sweep.angle_rad for sweep in made.sweeps} == {2 * math.pi}


def test_two_turns_are_closed_and_too_many_for_an_arm() -> None:
    """Its joints go 360° either way: who turns without end may."""
    made = plan(arc_deg=720)
    assert {sweep.angle_rad for sweep in made.sweeps} == {4 * math.pi}
    assert {problem.name for problem in plan_problems(made, FlangeLoad(0.35))} == {"joint_limit"}


@pytest.mark.parametrize(
    ("angle_deg", "closed"), [(360, True), (1080, True), (180, False), (450, False), (359.9, False)]
)
def test_whole_turns_are_told_from_arcs(angle_deg: float, *, closed: bool) -> None:
    assert closes(math.radians(angle_deg)) is closed


def test_an_arc_needs_to_be_told_how_well_the_encoders_know_it() -> None:
    assert "uncertainty.angle_std_deg" in problems_of("procedure.arc_deg=180")
    assert parse(DEMO, overrides=["procedure.arc_deg=180", KNOWN]).config.uncertainty.angle_std_deg == 0.02
    assert parse(DEMO, overrides=["procedure.arc_deg=720"]).config.uncertainty.angle_std_deg is None


def test_a_plan_of_one_s_own_needs_that_too() -> None:
    """It may make arcs that no key of its section speaks of."""
    with pytest.raises(Refused, match="encoders") as caught:
        settings_of(parse(DEMO).config, plan(arc_deg=180))
    assert caught.value.name == "angle_std_not_stated"


def test_what_needs_whole_turns_refuses_arcs() -> None:
    assert "wave" in problems_of("procedure={name: imu, arc_deg: 180}", KNOWN, "site.latitude_deg=48")
    assert "needs whole turns" in problems_of(
        "procedure={arc_deg: 180, earth_rate: find}", KNOWN, "site.latitude_deg=48"
    )


def test_an_arc_takes_no_longer_than_a_board_keeps_its_readings() -> None:
    assert "keeps the readings" in problems_of("procedure={arc_deg: 3600, speed_deg_s: 3}")


def test_a_steady_drift_is_weighed_by_the_arc_s_own_attitudes() -> None:
    """Every order is possible; the one that is chosen does not depend on what a whole turn averages out."""
    made = plan(arc_deg=180)
    assert sorted((sweep.joint_name, sweep.direction) for sweep in made.sweeps) == sorted(
        (sweep.joint_name, sweep.direction) for sweep in plan().sweeps
    )


@pytest.mark.slow
def test_the_dry_run_says_over_what_angle_sweeps_are_averaged() -> None:
    done = rig_here("plan", CONFIGS / "demo.yaml", "--set", "procedure.arc_deg=180", "--set", KNOWN)
    assert done.returncode == 0, done.stderr
    assert "Sweeps are averaged over 180°, the angle of the encoders" in done.stdout
