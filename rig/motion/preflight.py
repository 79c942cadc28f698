"""Pre-flight of a plan: what is wrong with it by itself, whoever is to drive it. Pure: a plan in, problems out."""

import math

from rig.errors import Problem
from rig.motion.carried import Carried
from rig.motion.geometry import DenavitHartenberg
from rig.motion.keep_out import clearance_problems
from rig.motion.limits import motion_problems
from rig.motion.model import TurnerModel
from rig.motion.state import JointLimits, Joints
from rig.motion.steps import SAME_PLACE_RAD, Motion, Plan, travel


def plan_problems(
    plan: Plan,
    carried: Carried,
    model: TurnerModel,
    *,
    arm: DenavitHartenberg | None = None,
    told: JointLimits | None = None,
) -> list[Problem]:
    """What is wrong with the plan itself: steps that are none, limits of position, speed, acceleration and payload.

    And what brings the flange or what it carries too near the arm. All as the `model` can do it. `told` are the
    controller's own limits, which count where they are narrower; the lengths are those of `arm`, or else the drawing's.
    """
    problems = step_problems(plan)
    travels = [motion for motion in plan.motions if _travels(motion)]
    problems += [problem for motion in travels for problem in motion_problems(motion, model.limits, told)]
    problems += clearance_problems(plan, carried, model, arm)
    if not 0 <= carried.payload_kg <= model.payload_kg:
        problems.append(
            Problem(
                "payload_too_heavy",
                f"the payload of {carried.payload_kg:g} kg is outside 0 to {model.payload_kg:g} kg, what a "
                f"{model.name} can carry",
                "Weigh the fixture and correct arm.payload_kg",
            )
        )
    return list(dict.fromkeys(problems))


def step_problems(plan: Plan) -> list[Problem]:
    """Steps that cannot be made: every one must take time, and every motion must lead somewhere, at some speed."""
    problems = [
        Problem(
            "no_duration",
            f"{step.name} is planned to take {step.duration_s:g} s",
            "Leave it out of the plan, or give it a duration above 0",
        )
        for step in plan.steps
        if not 0 < step.duration_s < math.inf
    ]
    problems += [
        Problem(
            "no_travel", f"{motion.name} does not move anything", "Leave it out of the plan, or let it move a joint"
        )
        for motion in plan.motions
        if not _travels(motion)
    ]
    problems += [
        Problem(
            "no_speed",
            f"{motion.name} is planned with {motion.speed_rad_s:g} rad/s and {motion.acceleration_rad_s2:g} rad/s²",
            "Give it a speed and an acceleration above 0",
        )
        for motion in plan.motions
        if not (0 < motion.speed_rad_s < math.inf and 0 < motion.acceleration_rad_s2 < math.inf)
    ]
    return problems


def way_to_home(plan: Plan, q_rad: Joints) -> Joints:
    """(6,) rad: how far each joint will turn in the first motion, from where the arm stands to the plan's home pose."""
    return travel(q_rad, plan.home_q_rad)


def _travels(motion: Motion) -> bool:
    way = travel(motion.start_q_rad, motion.target_q_rad)
    return all(map(math.isfinite, way)) and max(map(abs, way)) > SAME_PLACE_RAD
