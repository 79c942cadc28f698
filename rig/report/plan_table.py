"""The dry run: every motion the plan holds, with its time and its margin to the limits."""

import json
import math
from dataclasses import asdict
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from rig.arm.motion import SAME_PLACE_RAD, Plan, Rest, Step, Sweep
from rig.arm.state import JOINT_NAMES


def plan_document(plan: Plan, *, repeated: bool) -> dict[str, Any]:
    """The plan for machines: SI units, every field of every step; `repeated` if it is done once more, to verify."""
    steps = [{"kind": type(step).__name__.lower(), **asdict(step)} for step in plan.steps]
    return {"schema": "rig.plan/1", "duration_s": plan.duration_s, "repeated": repeated, "steps": steps}


def print_plan(plan: Plan, *, repeated: bool, as_json: bool) -> None:
    """The plan on stdout: a table in degrees for people, JSON in SI units for machines."""
    if as_json:
        print(json.dumps(plan_document(plan, repeated=repeated), indent=2))
        return
    console = Console(highlight=False)
    table = Table(title="plan, from the home pose", title_justify="left", box=SIMPLE)
    for heading in ("at s", "step", "for s", "joints °", "°/s", "°/s²"):
        table.add_column(heading, justify="left" if heading in ("step", "joints °") else "right", no_wrap=True)
    at_s = 0.0
    for step in plan.steps:
        name = step.name if isinstance(step, Sweep) else type(step).__name__.lower()
        table.add_row(f"{at_s:.1f}", name, f"{step.duration_s:.2f}", *_motion(step))
        at_s += step.duration_s
    console.print(table)
    console.print(f"{len(plan.sweeps)} sweeps, {len(plan.motions)} motions, {plan.duration_s:.1f} s; all within limits")
    if repeated:
        console.print(f"If the calibration passes, the same once more to verify it: {2 * plan.duration_s:.1f} s in all")


def _motion(step: Step) -> tuple[str, str, str]:
    if isinstance(step, Rest):
        return "", "", ""
    turns = [
        f"{name} {math.degrees(start):+.1f} → {math.degrees(target):+.1f}"
        for name, start, target in zip(JOINT_NAMES, step.start_q_rad, step.target_q_rad, strict=True)
        if abs(target - start) > SAME_PLACE_RAD
    ]
    return "\n".join(turns), f"{math.degrees(step.speed_rad_s):g}", f"{math.degrees(step.acceleration_rad_s2):g}"
