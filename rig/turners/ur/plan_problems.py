"""Problems of a plan for an arm of Universal Robots: with its model, and with its controller's limits."""

from rig.errors import Problem
from rig.motion.carried import FlangeLoad
from rig.motion.chain import DenavitHartenberg
from rig.motion.keep_out import find_clearance_problems
from rig.motion.model import TurnerModel
from rig.motion.preflight import find_step_problems, travels
from rig.motion.steps import Plan
from rig.motion.turner_state import JointLimits
from rig.turners.ur.joint_limits import motion_problems


def plan_problems(
    plan: Plan,
    carried: FlangeLoad,
    model: TurnerModel,
    *,
    arm: DenavitHartenberg | None = None,
    controller: JointLimits | None = None,
) -> list[Problem]:
    """Return a plan's problems: invalid steps, and excess of position, speed, acceleration, payload or clearance.

    Clearance is the distance of the flange and its payload from the arm. The narrower of the `controller`'s and the
    `model`'s limits is used. Lengths are those of `arm` if given, otherwise nominal.
    """
    problems = find_step_problems(plan)
    moving = [motion for motion in plan.motions if travels(motion)]
    problems += [problem for motion in moving for problem in motion_problems(motion, model.limits, controller)]
    problems += find_clearance_problems(plan, carried, model, arm)
    if not 0 <= carried.payload_kg <= model.payload_kg:
        problems.append(
            Problem(
                "payload_too_heavy",
                f"the payload of {carried.payload_kg:g} kg is outside 0 to {model.payload_kg:g} kg, which a "
                f"{model.name} carries",
                "Weigh the fixture and correct arm.payload_kg",
            )
        )
    return list(dict.fromkeys(problems))
