"""A run that ends after the repeat which reaches the uncertainty that is wanted, in the simulated laboratory."""

import json
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.analysis.reached import reached_so_far
from rig.analysis.shortest import Reached, Wanted
from rig.config.load import parse
from rig.data.run_file import RunData
from rig.motion.steps import Motion, Plan, Sweep
from rig.plans.six_sweeps import plan_six_observation
from rig.runner.ending_early import EndingEarly
from support.commands import configuration, rig
from support.synthetic_run import CONFIG, Setup, synthetic_run

REPEATS = 4


def planned(**keys: object) -> Plan:
    said = [f"procedure.{key}={json.dumps(value)}" for key, value in keys.items()]
    text = CONFIG.format(speed_deg_s=60, rest_s=3, repeats=REPEATS, part="lsm9ds1", procedure="", uncertainty="")
    config = parse(text, overrides=said).config
    return plan_six_observation(config.arm, config.procedure)  # type: ignore[arg-type]


def made_of(plan: Plan, enough: int) -> list[Motion]:
    """The motions that are made, where so many repeats are enough."""
    early = EndingEarly(Wanted(scale=1.0), plan, len(plan.sweeps), REPEATS, Path(), (), "vector")
    made, looked = list[Motion](), 0
    for motion in plan.motions:
        if early.due():
            looked += 1
            so_far = Future[Reached | None]()
            so_far.set_result(Reached(0.5 if looked >= enough else 2.0, 0.0))
            assert (early.found(so_far) is not None) == (looked >= enough)
        if not early.passes_over(motion):
            made.append(motion)
            if isinstance(motion, Sweep):
                early.swept(motion)
    return made


def test_after_the_end_only_the_last_way_home_is_made() -> None:
    plan = planned(order=["wrist_3", "wrist_1", "wrist_2"], directions=["cw", "ccw"])
    last = max(place for place, each in enumerate(plan.motions) if isinstance(each, Sweep))
    for enough in range(1, REPEATS):
        made = made_of(plan, enough)
        assert sum(isinstance(each, Sweep) for each in made) == enough * 6
        home = plan.motions[last + 1 :]
        assert home and made[-len(home) :] == [*home]


@pytest.mark.parametrize("keys", [{}, {"order": ["wrist_2", "wrist_1", "wrist_3"]}, {"axes": 6}])
def test_no_motion_begins_where_the_arm_does_not_stand(keys: dict[str, object]) -> None:
    """Whatever the order of directions, which may change from repeat to repeat."""
    plan = planned(**keys)
    for enough in range(1, REPEATS):
        here = plan.start_q_rad
        for motion in made_of(plan, enough):
            assert np.allclose(motion.start_q_rad, here, atol=1e-4)
            here = motion.target_q_rad
        assert np.allclose(here, plan.home_q_rad)


@pytest.mark.slow
def test_what_is_recorded_so_far_says_what_is_reached() -> None:
    whole = synthetic_run(Setup(noise_rad_s=0.002, repeats=2))
    found = reached_so_far([whole], "vector")
    assert found is not None and found.scale < 2e-4
    nothing = synthetic_run(Setup(noise_rad_s=0.002))
    assert reached_so_far([without_sweeps(nothing)], "vector") is None


def without_sweeps(run: RunData) -> RunData:
    return replace(run, events=())


@pytest.mark.thorough
@pytest.mark.slow
def test_a_run_ends_when_what_is_wanted_is_reached(tmp_path: Path) -> None:
    changes = {"procedure": {"repeats": REPEATS, "wanted_scale_u": 0.05, "wanted_bias_u_rad_s": 0.5}}
    done = rig("run", configuration(tmp_path, changes), "--out", tmp_path / "run")
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    assert len(result["sensors"]["gyro"]["observations"]) == 6
    assert "as wanted: 3 more repeats are left out" in (tmp_path / "run" / "log.txt").read_text(encoding="utf-8")
