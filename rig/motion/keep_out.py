"""How near to the arm itself a plan brings what it carries. Pure."""

from collections.abc import Iterator, Sequence
from math import radians
from typing import NamedTuple

import numpy as np

from rig.errors import Problem
from rig.estimation.arrays import Array
from rig.motion.carried import Carried
from rig.motion.geometry import DenavitHartenberg, distance_to_forearm, distance_to_upper_arm
from rig.motion.model import TurnerModel
from rig.motion.state import JointLimits, Joints
from rig.motion.steps import Dwell, Plan, Rest, travel

# From the flange's centre, and from that of its payload, to the middle of a link a plan keeps its radius (`Tube`) and a
# room beyond: how large the payload is is not known. Attitudes keep `dwell_room_m`. Sweeps and the ways between them
# cannot: about a UR10e's usual home a sweep of wrist 2 takes the flange to 0.133 m and the middle of a fixture to
# 0.120 m, the link that holds it off the forearm; a way between sweeps, to 0.118 m. They keep `sweep_room_m`: half a
# flange or half a fixture.
ALONG_THE_WAY_RAD = radians(2)
ALONG_THE_EXTENSION_M = 0.05
OTHER_ATTITUDES = "Bring wrist 2 nearer to -90 or 90 in procedure.attitudes, or turn wrist 1 so that it points away"
OTHER_HOME = "Set wrist 1 in arm.home_deg between -180 and 0: then wrist 2 sweeps beside the forearm"
NEARER_HOME = "Bring the arm near its home pose from the pendant"
OTHER_EXTENSION = "Take a shorter extension, or open the elbow in arm.home_deg"
OTHER_ELBOW = "Bring wrist 2 in arm.home_deg, or in procedure.attitudes, farther from the upper arm: -60 instead of -90"


class _Way(NamedTuple):
    """The poses (N, 6) of a step, the room they leave beyond the forearm, and what to do about it."""

    name: str
    q_rad: Array
    room_m: float
    remedy: str


def clearance_problems(
    plan: Plan, carried: Carried, model: TurnerModel, arm: DenavitHartenberg | None = None
) -> list[Problem]:
    """Dwells and motions that bring the flange, its payload's centre or its extension too near forearm or upper arm.

    By lengths of `arm`, or else the model's drawing. What begins or ends at an attitude leaves `dwell_room_m` beside
    the forearm, all else `sweep_room_m`. The way from where the arm stands is judged where the plan begins there.
    """
    problems = []
    for way in _ways(plan, model):
        what, distance_m = _nearest_to_forearm(way.q_rad, carried, model, arm)
        if distance_m < (least_m := _least_m(model.forearm.radius_m, way.room_m)):
            problems.append(
                Problem(
                    "forearm_too_near",
                    f"{way.name} brings the {what} within {distance_m:.3f} m of the forearm's "
                    f"{'middle' if model.forearm.beside_m else 'line'}, {least_m:g} m is the least",
                    way.remedy,
                )
            )
    for way in _ways(plan, model):
        what, distance_m = _nearest_to_upper_arm(way.q_rad, carried, model, arm)
        if distance_m < (least_m := _least_m(model.upper_arm.radius_m, model.sweep_room_m)):
            problems.append(
                Problem(
                    "upper_arm_too_near",
                    f"{way.name} brings the {what} within {distance_m:.3f} m of the middle of the upper arm, "
                    f"{least_m:g} m is the least",
                    OTHER_EXTENSION if what == "extension" else OTHER_ELBOW,
                )
            )
    return problems


def keeps_clear(start_q_rad: Joints, target_q_rad: Joints, carried: Carried, model: TurnerModel) -> bool:
    """Whether a straight way in joint space is clear enough of the arm for sweeps and what lies between them.

    By the model's drawing, of which plans are made before an arm is there.
    Nothing is said against one beyond the joints' limits, which is refused as that.
    """
    if not _within(model.limits, start_q_rad, target_q_rad):
        return True
    q_rad = _between(start_q_rad, target_q_rad)
    return _nearest_to_forearm(q_rad, carried, model)[1] >= _least_m(
        model.forearm.radius_m, model.sweep_room_m
    ) and _nearest_to_upper_arm(q_rad, carried, model)[1] >= _least_m(model.upper_arm.radius_m, model.sweep_room_m)


def _least_m(radius_m: float, room_m: float) -> float:
    """How near to the middle of a link something may come."""
    return round(radius_m + room_m, 6)


def _nearest_to_forearm(
    q_rad: Array, carried: Carried, model: TurnerModel, arm: DenavitHartenberg | None = None
) -> tuple[str, float]:
    """What comes nearest to the forearm in the poses (N, 6), and how near, m."""
    names, points = _carried(carried)
    beside_m, lengths = model.forearm.beside_m, arm or model.drawing
    return _least(names, distance_to_forearm(q_rad, points, lengths, beside_m=beside_m))


def _nearest_to_upper_arm(
    q_rad: Array, carried: Carried, model: TurnerModel, arm: DenavitHartenberg | None = None
) -> tuple[str, float]:
    """What comes nearest to the upper arm, as above."""
    names, points = _carried(carried)
    beside_m, lengths = model.upper_arm.beside_m, arm or model.drawing
    return _least(names, distance_to_upper_arm(q_rad, points, lengths, beside_m=beside_m))


def _least(names: Sequence[str], distances_m: Array) -> tuple[str, float]:
    """The least of the distances (k, N) of what is called so."""
    least_m = distances_m.min(axis=1)
    return names[int(least_m.argmin())], float(least_m.min())


def _carried(carried: Carried) -> tuple[list[str], Array]:
    """What the flange carries, point by point: names, and points (k, 1, 3) in its frame, m."""
    along = _along(carried)
    points = np.array([np.zeros(3), carried.centre_m, *along])
    return ["flange", "payload", *["extension"] * len(along)], points[:, None]


def _along(carried: Carried) -> list[Array]:
    """Points of an extension in the flange's frame, m, its end the last; none at the flange, nor without one."""
    end = np.array(carried.extension_m)
    count = 1 + int(np.linalg.norm(end) / ALONG_THE_EXTENSION_M)
    return [end * part / count for part in range(1, count + 1)] if end.any() else []


def _within(limits: JointLimits, *poses: Joints) -> bool:
    """False as well where an angle is no number, or no finite one."""
    angles = np.array(poses)
    inside = np.isfinite(angles) & (angles >= limits.least_rad) & (angles <= limits.greatest_rad)
    return bool(inside.all())


def _between(start_q_rad: Joints, target_q_rad: Joints) -> Array:
    """(N, 6) poses, both ends among them."""
    way = np.array(travel(start_q_rad, target_q_rad))
    parts = np.linspace(0, 1, 2 + int(np.abs(way).max() / ALONG_THE_WAY_RAD))
    poses: Array = start_q_rad + parts[:, None] * way
    return poses


def _ways(plan: Plan, model: TurnerModel) -> Iterator[_Way]:
    """The way of each dwell and each motion; what is no way, or beyond the joints' limits, has a problem of its own."""
    for before, step, after in zip((None, *plan.steps), plan.steps, (*plan.steps[1:], None), strict=False):
        if isinstance(step, Dwell):
            yield _Way(step.name, np.array([step.q_rad]), model.dwell_room_m, OTHER_ATTITUDES)
        elif not isinstance(step, Rest) and _within(model.limits, step.start_q_rad, step.target_q_rad):
            q_rad = _between(step.start_q_rad, step.target_q_rad)
            if isinstance(before, Dwell) or isinstance(after, Dwell):
                yield _Way(step.name, q_rad, model.dwell_room_m, OTHER_ATTITUDES)
            elif before is None and step.target_q_rad == plan.home_q_rad:
                yield _Way(step.name, q_rad, model.sweep_room_m, NEARER_HOME)
            else:
                yield _Way(step.name, q_rad, model.sweep_room_m, OTHER_HOME)
