"""Joint limits of position, speed and acceleration, of the arm's model and of its controller. Pure."""

import math
from collections.abc import Iterator

import numpy as np

from rig.errors import Problem
from rig.estimation.arrays import Array
from rig.motion.steps import Motion, Sweep, travel
from rig.motion.turner_state import JOINT_NAMES, JointLimits, Joints

RIG_LIMIT, CONTROLLER_LIMIT = "the limit", "the controller's limit"
REMEDY = ", or widen that limit in the arm's safety settings"
LIMIT_TOLERANCE = 1e-6  # relative


def motion_problems(motion: Motion, ours: JointLimits, theirs: JointLimits | None) -> list[Problem]:
    """Return the problems of a motion beyond the narrower of the limits `ours` (model) and `theirs` (controller)."""
    return [
        *_position_problems(motion, ours, theirs),
        *_speed_problems(motion, ours.speed_rad_s, None if theirs is None else theirs.speed_rad_s),
        *_ramp_problems(motion, ours.acceleration_rad_s2, None if theirs is None else theirs.acceleration_rad_s2),
    ]


def _position_problems(motion: Motion, ours: JointLimits, theirs: JointLimits | None) -> list[Problem]:
    """Return the problem of each joint that the motion takes beyond the narrower limits."""
    problems = []
    for joint, name in enumerate(JOINT_NAMES):
        most = ours.greatest_rad[joint]
        least, _ = _narrower(-ours.least_rad[joint], None if theirs is None else -theirs.least_rad[joint])
        greatest, _ = _narrower(most, None if theirs is None else theirs.greatest_rad[joint])
        low, high = sorted((motion.start_q_rad[joint], motion.target_q_rad[joint]))
        if low < -least or high > greatest:
            narrow = min(least, greatest) < most
            beyond = f"{math.degrees(-least):.1f}° to {math.degrees(greatest):.1f}°, the controller's limits"
            problems.append(
                Problem(
                    "joint_limit",
                    f"{motion.name} takes {name} from {math.degrees(low):.1f}° to {math.degrees(high):.1f}°, beyond "
                    f"{beyond if narrow else f'±{math.degrees(most):g}°'}",
                    f"{_describe_remedy(motion, joint, (-least, greatest))}{REMEDY if narrow else ''}",
                )
            )
    return problems


def _describe_remedy(motion: Motion, joint: int, within_rad: tuple[float, float]) -> str:
    """Return the remedy for a motion beyond a joint's range, which depends on the motion's start and kind."""
    name, (low, high) = JOINT_NAMES[joint], within_rad
    if not low <= motion.start_q_rad[joint] <= high and not isinstance(motion, Sweep):
        return f"Bring {name} back inside its range from the pendant, or correct arm.home_deg"
    if isinstance(motion, Sweep) and motion.joint == joint:
        if motion.angle_rad >= high - low:
            return f"Lower procedure.arc_deg: {name} has less room than a sweep turns through"
        return (
            f"Bring {name} in arm.home_deg nearer to the middle of its range, or shorten the run-up: raise "
            "procedure.acceleration_deg_s2 or lower procedure.speed_deg_s"
        )
    return (
        f"Bring {name} in arm.home_deg nearer to the middle of its range, leave out the attitudes that need it there, "
        "or shorten the sweeps' run-up"
    )


def _speed_problems(motion: Motion, ours_rad_s: Joints, theirs_rad_s: Joints | None) -> list[Problem]:
    return [
        Problem(
            "joint_speed",
            f"{motion.name} turns {name} at {math.degrees(speed):.1f}°/s; {whose} is {math.degrees(limit):.1f}°/s",
            f"Lower procedure.speed_deg_s or arm.transfer_speed_deg_s{REMEDY if whose == CONTROLLER_LIMIT else ''}",
        )
        for name, speed, limit, whose in _find_excess(motion.speed_rad_s * _fractions(motion), ours_rad_s, theirs_rad_s)
    ]


def _ramp_problems(motion: Motion, ours_rad_s2: Joints, theirs_rad_s2: Joints | None) -> list[Problem]:
    return [
        Problem(
            "joint_acceleration",
            f"{motion.name} accelerates {name} with {math.degrees(acceleration):.0f}°/s²; {whose} is "
            f"{math.degrees(limit):.0f}°/s²",
            "Lower procedure.acceleration_deg_s2",
        )
        for name, acceleration, limit, whose in _find_excess(
            motion.acceleration_rad_s2 * _fractions(motion), ours_rad_s2, theirs_rad_s2
        )
    ]


def _find_excess(values: Array, ours: Joints, theirs: Joints | None) -> Iterator[tuple[str, float, float, str]]:
    """Yield the joints whose `values` (6,) exceed the narrower limit: name, value, limit, and the limit's owner."""
    for joint, name in enumerate(JOINT_NAMES):
        limit, whose = _narrower(ours[joint], None if theirs is None else theirs[joint])
        if values[joint] > limit:
            yield name, values[joint], limit, whose


def _fractions(motion: Motion) -> Array:
    """Return each joint's travel divided by the longest travel, (6,); the joints' speeds have the same ratios."""
    travel_rad = np.abs(travel(motion.start_q_rad, motion.target_q_rad))
    fractions: Array = travel_rad / travel_rad.max()
    return fractions


def _narrower(ours: float, theirs: float | None) -> tuple[float, str]:
    """Return the narrower of two limits, and whether it is the model's (`ours`) or the controller's (`theirs`).

    If both nearly agree, or the controller states none, the model's is returned.
    """
    return (ours, RIG_LIMIT) if theirs is None or theirs >= ours * (1 - LIMIT_TOLERANCE) else (theirs, CONTROLLER_LIMIT)
