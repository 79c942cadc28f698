"""`rig plan`: the dry run. Connects to nothing."""

from collections.abc import Sequence
from pathlib import Path

from rig.arm.preflight import plan_problems, refuse
from rig.commands.configured import configured
from rig.report.plan_table import print_plan


def plan(config_path: Path, overrides: Sequence[str], script: Path | None, *, as_json: bool) -> int:
    """Print the plan from the home pose; returns 0. Raises `Refused` when a motion breaks a limit."""
    found = configured(config_path, overrides, script)
    steps = found.phase.plan()
    refuse(plan_problems(steps, found.loaded.config.arm.payload_kg))
    print_plan(steps, repeated=found.phase.follows is not None, as_json=as_json)
    return 0
