"""What no pre-flight has judged is not done: a script makes the plan's motions, in their order."""

from pathlib import Path

import pytest

from support.laboratories.commands import configuration, rig

pytestmark = pytest.mark.slow

SCRIPT = """
from rig.procedure import Procedure, SixObservationSection, plan_six_observation


def own(rig):
    {before}
    rig.start_sampling()
    motions = rig.plan.motions
    rig.move(motions[0])
    rig.sweep(motions[3])


PROCEDURE = Procedure(name="six_observation", section=SixObservationSection, plan=plan_six_observation, script=own)
"""


@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("before", "status", "said"),
    [
        ("rig.preflight()", 3, "comes next"),
        ("pass", 2, "before pre-flight"),
    ],
)
def test_a_motion_that_is_not_the_plans_next_is_not_made(tmp_path: Path, before: str, status: int, said: str) -> None:
    script = tmp_path / "own.py"
    script.write_text(SCRIPT.format(before=before), encoding="utf-8")
    out = tmp_path / "run"
    ended = rig("run", configuration(tmp_path), "--script", script, "--out", out)
    assert ended.returncode == status and "rig: unplanned_motion: " in ended.stderr and said in ended.stderr
    assert not (out / "result.json").exists()
