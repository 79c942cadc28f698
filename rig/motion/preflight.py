"""The pre-flight check of a plan for any turner, which finds the plan's problems. Pure functions."""

import math

from rig.errors import Problem
from rig.motion.steps import POSE_TOLERANCE_RAD, Motion, Plan, travel
from rig.motion.turner_state import Joints


def find_step_problems(plan: Plan) -> list[Problem]:
    """Return the problems of a plan's steps: a step without duration, or a motion without joints or speed."""
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
        if not travels(motion)
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


def find_travel_to_home(plan: Plan, q_rad: Joints) -> Joints:
    """Return each joint's travel (n,), rad, in the first motion, from the present pose to the plan's home."""
    return travel(q_rad, plan.home_q_rad)


def travels(motion: Motion) -> bool:
    """Return whether a motion moves a joint."""
    travel_rad = travel(motion.start_q_rad, motion.target_q_rad)
    return all(map(math.isfinite, travel_rad)) and max(map(abs, travel_rad)) > POSE_TOLERANCE_RAD
