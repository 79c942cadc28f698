"""What the sensor's cable must allow is said from where the joints stand, to each side."""

from math import ceil, degrees, radians

from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.motion.steps import Plan
from rig.motion.turner_state import JOINT_NAMES
from rig.motion.winding import cable_words, windings_rad
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.runner.announcement import announcement
from rig.turners.ur.ur_kind import UR
from support.page.scripted_runs import report

ARM = ArmSection(host="10.0.0.2", payload_kg=0.3)
TURN = radians(360)


def plan() -> Plan:
    return plan_six_observation(ARM, SixObservationSection())


def test_at_home_a_wrist_needs_as_much_to_one_side_as_to_the_other() -> None:
    low, high = windings_rad(plan(), plan().home_q_rad)[5]
    assert radians(180) < high < radians(240) and abs(low + high) < 1e-9
    assert windings_rad(plan(), plan().home_q_rad)[1] == (0.0, 0.0)


def test_a_wrist_that_stands_a_whole_turn_away_unwinds_to_one_side() -> None:
    home = plan().home_q_rad
    away = (*home[:5], home[5] + TURN)
    (low, high), (low_home, _) = windings_rad(plan(), away)[5], windings_rad(plan(), home)[5]
    assert high == 0.0 and abs(low - (low_home - TURN)) < 1e-9
    words = cable_words(plan(), away, JOINT_NAMES)
    assert f"wrist_3 by {ceil(degrees(-low))}° one way (-) and 0° the other (+)" in words[0]
    assert words[1].startswith("wrist_3 is +360° from home")
    assert not [word for word in cable_words(plan(), home, JOINT_NAMES) if "from home" in word]


def test_it_is_said_before_the_operator_agrees() -> None:
    home = plan().home_q_rad
    for turns, told in ((0, False), (-1, True)):
        seen = report((*home[:5], home[5] + turns * TURN))
        lines = announcement(plan(), seen, UR.words, None, []).announcement
        assert any("one way (-)" in line for line in lines)
        assert any("wrist_3 is -360° from home" in line for line in lines) == told
