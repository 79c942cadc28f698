"""A planned sweep is foretold as the motion that a plan makes shows it."""

import numpy as np
import pytest

from rig.analysis.design.planned_motion import (
    plan_run,
    predict_attitude,
    predict_motion,
    predict_revolution,
    time_steps,
    time_steps_of,
)
from rig.config.load import load
from rig.motion.geometry import NOMINAL
from rig.motion.steps import Rest, Sweep
from rig.observation.windows import Window
from rig.plans.procedure_registry import load_procedures, sections
from rig.plans.shortest_run import plan_of
from rig.turners import turner_registry as turners
from support.paths import CONFIGS

AS_THE_FLANGE = np.eye(3)


@pytest.mark.parametrize("said", [(), ("procedure.arc_deg=90", "uncertainty.angle_std_deg=0.01")])
def test_a_planned_turn_is_what_the_motion_shows(said: tuple[str, ...]) -> None:
    config = load(CONFIGS / "demo.yaml", said, sections(load_procedures()), turners.sections()).config
    run = plan_run(config, plan_of(config, config.procedure), NOMINAL)
    motion = predict_motion(run.plan, run.arm)
    for each in time_steps_of(run.plan, Sweep):
        will = predict_revolution(each, run.arm, AS_THE_FLANGE)
        found = motion.turn(each.step, Window(each.start_s, each.end_s), run.settings.observation)
        for what in ("start_s", "end_s", "axis_flange", "attitude", "axis_errors", "arm_m", "station", "angle_rad"):
            assert getattr(will, what) == pytest.approx(getattr(found, what), abs=1e-5), what
        attitude = motion.attitude(found.start_s, found.end_s)
        assert predict_attitude(each, run.arm, AS_THE_FLANGE) == pytest.approx(attitude, abs=1e-5)


def test_a_planned_rest_is_where_the_last_motion_ends() -> None:
    config = load(CONFIGS / "demo.yaml", (), sections(load_procedures()), turners.sections()).config
    plan = plan_of(config, config.procedure)
    motion = predict_motion(plan, NOMINAL)
    rests = [step for step in time_steps(plan) if isinstance(step.step, Rest)]
    assert rests
    for rest in rests:
        attitude = motion.attitude(rest.start_s, rest.end_s)
        assert predict_attitude(rest, NOMINAL, AS_THE_FLANGE) == pytest.approx(attitude, abs=1e-5)
