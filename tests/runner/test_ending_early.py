"""A run that ends after the repeat which reaches the uncertainty that is wanted, in the simulated laboratory."""

import json
import signal
import subprocess
import sys
from collections.abc import Collection, Sequence
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.analysis.design.candidate_search import ReachedUncertainty, TargetUncertainty
from rig.analysis.design.reached_uncertainty import assess_reached
from rig.config.load import parse
from rig.data.recording.run_data import RunData
from rig.motion.steps import Motion, Plan, Sweep
from rig.motion.turner_state import Joints
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.runner.ending_early import EndingEarly
from rig.station.events import UncertaintySoFar
from support.laboratories.commands import configuration, rig, wait_for_log
from support.recordings.synthetic_run import CONFIG, Setup, synthetic_run

REPEATS = 4


def planned(**keys: object) -> Plan:
    return resumed(None, (), **keys)


def resumed(start_q_rad: Joints | None, done: Collection[int], /, **keys: object) -> Plan:
    said = [f"procedure.{key}={json.dumps(value)}" for key, value in keys.items()]
    text = CONFIG.format(speed_deg_s=60, rest_s=3, repeats=REPEATS, part="lsm9ds1", procedure="", uncertainty="")
    config = parse(text, overrides=said).config
    return plan_six_observation(config.arm, config.procedure, start_q_rad, done)  # pyrefly: ignore[bad-argument-type]  # this file has its section


def made_of(plan: Plan, enough: int) -> list[Motion]:
    """The motions that are made, where so many repeats are enough."""
    early = EndingEarly(TargetUncertainty(scale=1.0), plan, len(plan.sweeps), REPEATS, Path(), (), "vector")
    made, looked = list[Motion](), 0
    for motion in plan.motions:
        if early.due():
            looked += 1
            so_far = Future[ReachedUncertainty | None]()
            so_far.set_result(ReachedUncertainty(0.5 if looked >= enough else 2.0, 0.0))
            said = early.conclude(so_far)
            assert said is not None and said.as_wanted == (looked >= enough)
        if not early.skips(motion):
            made.append(motion)
            if isinstance(motion, Sweep):
                early.note_sweep(motion)
    return made


def test_a_run_ends_after_an_odd_repeat_too_where_the_plan_goes_home_from_there() -> None:
    """Where directions turn about from repeat to repeat, the last way home begins elsewhere than an odd repeat ends."""
    made = made_of(planned(order=["wrist_2", "wrist_3", "wrist_1"]), 1)
    assert sum(isinstance(each, Sweep) for each in made) == 6


@pytest.mark.parametrize("away_rad", [0.0, 0.3])
@pytest.mark.parametrize(("done", "whole"), [(range(6), True), (range(7), False), ([0, 1, 2, 3, 6, 7], False)])
def test_resumed_after_whole_repeats_that_are_enough_it_only_goes_home(
    done: Sequence[int], whole: bool, away_rad: float
) -> None:
    """Else the repeat that was begun is completed first, and sweeps that do not count are made again."""
    home = planned().home_q_rad
    plan = resumed((home[0] + away_rad, *home[1:]), done)
    early = EndingEarly(
        TargetUncertainty(scale=1.0), plan, 6 * REPEATS, REPEATS, Path(), [synthetic_run(Setup())], "vector"
    )
    assert early.due() == whole
    if whole:
        so_far = Future[ReachedUncertainty | None]()
        so_far.set_result(ReachedUncertainty(0.5, 0.0))
        assert early.conclude(so_far) == UncertaintySoFar(0.5, 0.0, 3, as_wanted=True)
        made = [motion.name for motion in plan.motions if not early.skips(motion)]
        assert made == ["approach home"] * (away_rad > 0)


def test_after_the_end_only_the_last_way_home_is_made() -> None:
    plan = planned(order=["wrist_3", "wrist_1", "wrist_2"], directions=["cw", "ccw"])
    last = max(place for place, motion in enumerate(plan.motions) if isinstance(motion, Sweep))
    for enough in range(1, REPEATS):
        made = made_of(plan, enough)
        assert sum(isinstance(each, Sweep) for each in made) == enough * 6
        home = plan.motions[last + 1 :]
        assert home and made[-len(home) :] == [*home]


@pytest.mark.slow
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
    found = assess_reached([whole], "vector")
    assert found is not None and found.scale < 2e-4
    nothing = synthetic_run(Setup(noise_rad_s=0.002))
    assert assess_reached([without_sweeps(nothing)], "vector") is None


def without_sweeps(run: RunData) -> RunData:
    return replace(run, events=())


SHORTEST = {"name": "shortest", "speed_deg_s": 170, "acceleration_deg_s2": 700, "rest_s": 0.5}


@pytest.mark.thorough
@pytest.mark.slow
def test_a_run_ends_when_what_is_wanted_is_reached_and_is_resumed_after_an_interruption(tmp_path: Path) -> None:
    """Interrupted on its way home, it has all that is wanted, and measures nothing more."""
    config, run = (
        configuration(tmp_path, procedure={**SHORTEST, "target_uncertainty": {"scale": 0.05, "bias": 0.05}}),
        tmp_path / "run",
    )
    begun = subprocess.Popen([sys.executable, "-m", "rig", "run", config, "--out", run], stderr=subprocess.DEVNULL)
    wait_for_log(run, "target reached: 15 more repeats are skipped")
    begun.send_signal(signal.SIGINT)
    begun.wait()
    if begun.returncode == 130:  # else it was home already
        assert rig("resume", run).returncode == 0
    result = json.loads((run / "result.json").read_text(encoding="utf-8"))
    assert len(result["gyroscopes"]["gyro"]["observations"]) == 6
    assert {"gyro.scale_u": True, "gyro.bias_u": True}.items() <= passed(result).items()


@pytest.mark.thorough
@pytest.mark.slow
def test_a_run_that_does_not_come_to_what_is_wanted_fails_by_its_name(tmp_path: Path) -> None:
    wanted = {"scale": 1e-5, "bias": 0.05}
    done = rig(
        "run",
        configuration(tmp_path, procedure={**SHORTEST, "target_uncertainty": wanted, "repeats": 2}),
        "--out",
        tmp_path / "run",
    )
    assert done.returncode == 1, done.stderr
    assert "above the target: 1 more repeat at most" in done.stderr
    assert "FAILED gyro.scale_u" in done.stdout
    result = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    assert len(result["gyroscopes"]["gyro"]["observations"]) == 12
    assert [name for name, good in passed(result).items() if not good] == ["gyro.scale_u"]


def passed(result: dict[str, Any]) -> dict[str, bool]:
    return {check["name"]: check["passed"] for check in result["checks"]}
