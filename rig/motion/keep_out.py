"""How near to its own forearm a plan brings what the arm carries. Pure."""

from collections.abc import Iterator
from math import radians
from typing import NamedTuple

import numpy as np

from rig.config.ur10e_limits import JOINT_LIMIT_RAD
from rig.errors import Problem
from rig.estimation.arrays import Array
from rig.motion.carried import Carried
from rig.motion.geometry import NOMINAL, DenavitHartenberg, distance_to_forearm, distance_to_upper_arm
from rig.motion.state import Joints
from rig.motion.steps import Dwell, Plan, Rest, travel

# From the flange's centre, and from that of its payload, to the line from elbow to wrist 1: how thick the forearm and
# how large the payload are is not known, and both need that room.
FOREARM_CLEARANCE_M = 0.15
# Sweeps and the ways between them cannot keep that. About the usual home a sweep of wrist 2 takes the flange to 0.133 m
# and the middle of a fixture to 0.120 m, the link that holds it off the forearm; a way between sweeps, to 0.118 m. The
# forearm reaches 0.06 to 0.07 m from its line; 0.045 m are left for half a flange or half a fixture.
SWEEP_CLEARANCE_M = 0.115
ALONG_THE_WAY_RAD = radians(2)
ALONG_THE_EXTENSION_M = 0.05
OTHER_ATTITUDES = "Bring wrist 2 nearer to -90 or 90 in procedure.attitudes, or turn wrist 1 so that it points away"
OTHER_HOME = "Set wrist 1 in arm.home_deg between -180 and 0: then wrist 2 sweeps beside the forearm"
NEARER_HOME = "Bring the arm near its home pose from the pendant"


class _Way(NamedTuple):
    """The poses (N, 6) of a step, how near the forearm they may come, and what to do about it."""

    name: str
    q_rad: Array
    least_m: float
    remedy: str


def clearance_problems(plan: Plan, carried: Carried, arm: DenavitHartenberg = NOMINAL) -> list[Problem]:
    """Dwells and motions that bring the flange, its payload's centre or its extension too near the forearm.

    An extension keeps clear of the upper arm as well. By lengths of `arm`. What begins or ends at an attitude keeps
    `FOREARM_CLEARANCE_M`, all else `SWEEP_CLEARANCE_M`. The way from where the arm stands is judged where the plan
    begins there.
    """
    extension = _along(carried)
    near = [
        Problem(
            "forearm_too_near",
            f"{way.name} brings the {what} within {distance_m:.3f} m of the forearm's line, "
            f"{way.least_m:g} m is the least",
            way.remedy,
        )
        for way in _ways(plan)
        for what, distance_m in [_nearest(way.q_rad, carried, arm)]
        if distance_m < way.least_m
    ]
    return near + [
        Problem(
            "upper_arm_too_near",
            f"{way.name} brings the extension within {distance_m:.3f} m of the middle of the upper arm, "
            f"{SWEEP_CLEARANCE_M:g} m is the least",
            "Take a shorter extension, or open the elbow in arm.home_deg",
        )
        for way in (_ways(plan) if extension else ())
        for distance_m in [min(float(distance_to_upper_arm(way.q_rad, p, arm).min()) for p in extension)]
        if distance_m < SWEEP_CLEARANCE_M
    ]


def keeps_clear(start_q_rad: Joints, target_q_rad: Joints, carried: Carried) -> bool:
    """Whether a straight way in joint space is clear enough of the forearm for sweeps and what lies between them.

    By the nominal arm, of which plans are made before an arm is there.
    Nothing is said against one beyond the joints' limits, which is refused as that.
    """
    if not _within_limits(start_q_rad, target_q_rad):
        return True
    _, distance_m = _nearest(_between(start_q_rad, target_q_rad), carried, NOMINAL)
    return distance_m >= SWEEP_CLEARANCE_M


def _nearest(q_rad: Array, carried: Carried, arm: DenavitHartenberg) -> tuple[str, float]:
    """What comes nearest to the forearm in the poses (N, 6), and how near, m."""
    points = [("flange", np.zeros(3)), ("payload", np.array(carried.centre_m))]
    points += [("extension", point) for point in _along(carried)]
    distances = [(what, float(distance_to_forearm(q_rad, point, arm).min())) for what, point in points]
    return min(distances, key=lambda each: each[1])


def _along(carried: Carried) -> list[Array]:
    """Points of an extension in the flange's frame, m, its end the last; none at the flange, nor without one."""
    end = np.array(carried.extension_m)
    count = 1 + int(np.linalg.norm(end) / ALONG_THE_EXTENSION_M)
    return [end * part / count for part in range(1, count + 1)] if end.any() else []


def _within_limits(*poses: Joints) -> bool:
    """False as well where an angle is no number."""
    return bool(np.abs(poses).max() <= JOINT_LIMIT_RAD)


def _between(start_q_rad: Joints, target_q_rad: Joints) -> Array:
    """(N, 6) poses, both ends among them."""
    way = np.array(travel(start_q_rad, target_q_rad))
    parts = np.linspace(0, 1, 2 + int(np.abs(way).max() / ALONG_THE_WAY_RAD))
    poses: Array = start_q_rad + parts[:, None] * way
    return poses


def _ways(plan: Plan) -> Iterator[_Way]:
    """The way of each dwell and each motion; what is no way, or beyond the joints' limits, has a problem of its own."""
    for before, step, after in zip((None, *plan.steps), plan.steps, (*plan.steps[1:], None), strict=False):
        if isinstance(step, Dwell):
            yield _Way(step.name, np.array([step.q_rad]), FOREARM_CLEARANCE_M, OTHER_ATTITUDES)
        elif not isinstance(step, Rest) and _within_limits(step.start_q_rad, step.target_q_rad):
            q_rad = _between(step.start_q_rad, step.target_q_rad)
            if isinstance(before, Dwell) or isinstance(after, Dwell):
                yield _Way(step.name, q_rad, FOREARM_CLEARANCE_M, OTHER_ATTITUDES)
            elif before is None and step.target_q_rad == plan.home_q_rad:
                yield _Way(step.name, q_rad, SWEEP_CLEARANCE_M, NEARER_HOME)
            else:
                yield _Way(step.name, q_rad, SWEEP_CLEARANCE_M, OTHER_HOME)
