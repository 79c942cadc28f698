"""The pre-flight of a UR10e, the arm of most tests."""

from rig.errors import Problem
from rig.motion.carried import FlangeLoad
from rig.motion.model import load_turner_model
from rig.motion.steps import Plan
from rig.turners.ur import plan_problems as judged

UR10E = load_turner_model("ur10e")


def plan_problems(plan: Plan, carried: FlangeLoad) -> list[Problem]:
    """Return the problems of a plan for a UR10e."""
    return judged.plan_problems(plan, carried, UR10E)
