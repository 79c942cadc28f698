"""A plan in stages: the item is mounted anew between them, and each has its sweeps after a trial of its mounting."""

import math
from itertools import pairwise

import numpy as np
import pytest
from pydantic import ValidationError

from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.config.procedures.stage_section import StageMountSection, mount_matrix
from rig.errors import Refused
from rig.motion.carried import FlangeLoad
from rig.motion.steps import Plan, Sweep, Transfer
from rig.plans.motions.six_sweeps import plan_six_observation
from support.wires.ur10e import plan_problems

ARM = ArmSection(host="127.0.0.2", payload_kg=0.35)
ONE_AXIS_EACH: list[dict[str, object]] = [
    {"instruction": "as it is", "sweeps": ["wrist_3"]},
    {"instruction": "x along wrist 3", "sweeps": ["wrist_3"], "mount": {"x": "+z", "y": "+x", "z": "+y"}},
    {"instruction": "y along wrist 3", "sweeps": ["wrist_3"], "mount": {"x": "+y", "y": "+z", "z": "+x"}},
]


def plan(stages: list[dict[str, object]], done: frozenset[int] = frozenset()) -> Plan:
    return plan_six_observation(ARM, SixObservationSection.model_validate({"stages": stages}), None, done)


def test_every_stage_begins_and_ends_at_home_and_its_sweeps_go_on_counting() -> None:
    made = plan([{"instruction": "one"}, {"instruction": "two"}])
    assert [sweep.index for sweep in made.sweeps] == list(range(12))
    assert [stage.indices for stage in made.stages] == [set(range(6)), set(range(6, 12))]
    motions = made.motions
    begins = made.stages[1].begins
    assert made.steps[begins] in motions
    first = made.steps[begins]
    assert isinstance(first, Transfer)
    assert first.start_q_rad == pytest.approx(made.home_q_rad)
    assert motions[-1].target_q_rad == pytest.approx(made.home_q_rad)
    for before, after in pairwise(motions):
        assert after.start_q_rad == pytest.approx(before.target_q_rad)
    assert plan_problems(made, FlangeLoad(0.35)) == []


def test_each_joint_that_is_swept_is_tried_first_by_a_small_turn() -> None:
    made = plan([{"instruction": "one"}])
    trials = [step for step in made.steps if isinstance(step, Transfer) and step.tries]
    assert [trial.name for trial in trials] == ["trial of wrist_3", "trial of wrist_1", "trial of wrist_2"]
    for trial in trials:
        assert max(np.abs(np.subtract(trial.target_q_rad, trial.start_q_rad))) <= math.radians(10) + 1e-9
    assert made.steps.index(trials[-1]) < min(place for place, step in enumerate(made.steps) if isinstance(step, Sweep))


def test_a_stage_that_is_done_has_no_steps() -> None:
    made = plan([{"instruction": "one"}, {"instruction": "two"}], frozenset(range(6)))
    assert [sweep.index for sweep in made.sweeps] == list(range(6, 12))
    assert made.stages[0].begins == made.stages[1].begins == 0


def test_one_axis_in_three_mountings_spans_space() -> None:
    made = plan(ONE_AXIS_EACH)
    assert [sweep.joint_name for sweep in made.sweeps] == ["wrist_3"] * 6


def test_one_axis_in_one_mounting_does_not() -> None:
    with pytest.raises(Refused, match="axes_do_not_span"):
        plan([ONE_AXIS_EACH[0], ONE_AXIS_EACH[0]])


def test_without_stages_nothing_is_tried() -> None:
    made = plan([])
    assert made.stages == ()
    assert not any(step.tries for step in made.motions if isinstance(step, Transfer))


def test_a_mount_is_turned_in_the_item_s_own_axes() -> None:
    """A quarter about z: the item's x axis points where the flange's y axis does, as +y says."""
    turned = mount_matrix(StageMountSection(rotation_deg=(0.0, 0.0, 90.0)))
    assert turned == pytest.approx(mount_matrix(StageMountSection(x="+y", y="-x", z="+z")), abs=1e-12)


def test_a_stage_names_each_wrist_once() -> None:
    with pytest.raises(ValidationError, match="each wrist once"):
        SixObservationSection.model_validate({"stages": [{"instruction": "x", "sweeps": ["wrist_1", "wrist_1"]}]})
