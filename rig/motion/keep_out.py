"""The distance between the load and the arm itself during a plan. Pure functions."""

from collections.abc import Iterator, Sequence
from math import radians
from typing import NamedTuple

import numpy as np

from rig.errors import Problem
from rig.estimation.arrays import Array
from rig.motion.carried import FlangeLoad
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import distance_to_forearm, distance_to_upper_arm
from rig.motion.model import TurnerModel
from rig.motion.steps import Dwell, Plan, Rest, travel
from rig.motion.turner_state import JointLimits, Joints

# A plan keeps the centres of flange and payload away from the middle of a link by its radius (`Tube`) and a clearance,
# because the payload's size is unknown. Attitudes have the clearance `dwell_room_m`. Sweeps and transfers cannot: near
# a UR10e's usual home a sweep of wrist 2 takes the flange within 0.133 m and a fixture's middle within 0.120 m of the
# forearm, and a transfer within 0.118 m. They have `sweep_room_m`, half a flange or half a fixture.
POSE_STEP_RAD = radians(2)
EXTENSION_STEP_M = 0.05
OTHER_ATTITUDES = "Bring wrist 2 nearer to -90 or 90 in procedure.attitudes, or turn wrist 1 so that it points away"
OTHER_HOME = "Set wrist 1 in arm.home_deg between -180 and 0: then wrist 2 sweeps next to the forearm"
NEARER_HOME = "Bring the arm near its home pose from the pendant"
OTHER_EXTENSION = "Take a shorter extension, or open the elbow in arm.home_deg"
OTHER_ELBOW = "Bring wrist 2 in arm.home_deg, or in procedure.attitudes, farther from the upper arm: -60 instead of -90"


class _Path(NamedTuple):
    """The poses (N, 6) of a step, the clearance required from the forearm, and the remedy."""

    name: str
    q_rad: Array
    room_m: float
    remedy: str


def find_clearance_problems(
    plan: Plan, carried: FlangeLoad, model: TurnerModel, arm: DenavitHartenberg | None = None
) -> list[Problem]:
    """Return the problems of steps that bring flange, payload's centre or extension too near to forearm or upper arm.

    Lengths are those of `arm` if given, otherwise nominal. A dwell, and each motion from or to the dwell's attitude,
    must keep `dwell_room_m` away from the forearm; all other motions must keep `sweep_room_m`.
    """
    problems = []
    for path in _list_paths(plan, model):
        what, distance_m = _measure_to_forearm(path.q_rad, carried, model, arm)
        if distance_m < (least_m := _clearance_m(model.forearm.radius_m, path.room_m)):
            problems.append(
                Problem(
                    "forearm_too_near",
                    f"{path.name} brings the {what} within {distance_m:.3f} m of the forearm's "
                    f"{'middle' if model.forearm.offset_m else 'line'}; at least {least_m:g} m is required",
                    path.remedy,
                )
            )
    for path in _list_paths(plan, model):
        what, distance_m = _measure_to_upper_arm(path.q_rad, carried, model, arm)
        if distance_m < (least_m := _clearance_m(model.upper_arm.radius_m, model.sweep_room_m)):
            problems.append(
                Problem(
                    "upper_arm_too_near",
                    f"{path.name} brings the {what} within {distance_m:.3f} m of the middle of the upper arm; at least "
                    f"{least_m:g} m is required",
                    OTHER_EXTENSION if what == "extension" else OTHER_ELBOW,
                )
            )
    return problems


def keeps_clear(start_q_rad: Joints, target_q_rad: Joints, carried: FlangeLoad, model: TurnerModel) -> bool:
    """Return whether the load stays far enough from the arm on a straight path in joint space, sweep or transfer.

    Lengths are nominal, because plans are made before an arm is connected. Paths beyond the joints' limits count as
    clear; other checks refuse them.
    """
    if not _is_within(model.limits, start_q_rad, target_q_rad):
        return True
    q_rad = _interpolate(start_q_rad, target_q_rad)
    return _measure_to_forearm(q_rad, carried, model)[1] >= _clearance_m(
        model.forearm.radius_m, model.sweep_room_m
    ) and _measure_to_upper_arm(q_rad, carried, model)[1] >= _clearance_m(model.upper_arm.radius_m, model.sweep_room_m)


def _clearance_m(radius_m: float, room_m: float) -> float:
    """Return the least permitted distance, m, to the middle of a link: radius plus room."""
    return round(radius_m + room_m, 6)


def _measure_to_forearm(
    q_rad: Array, carried: FlangeLoad, model: TurnerModel, arm: DenavitHartenberg | None = None
) -> tuple[str, float]:
    """Return the part of the load that is nearest to the forearm in any of the poses (N, 6), and its distance, m."""
    names, points = _list_load_points(carried)
    offset_m, lengths = model.forearm.offset_m, arm or model.nominal
    return _find_nearest(names, distance_to_forearm(q_rad, points, lengths, offset_m=offset_m))


def _measure_to_upper_arm(
    q_rad: Array, carried: FlangeLoad, model: TurnerModel, arm: DenavitHartenberg | None = None
) -> tuple[str, float]:
    """Return the part of the load that is nearest to the upper arm in any of the poses (N, 6), and its distance, m."""
    names, points = _list_load_points(carried)
    offset_m, lengths = model.upper_arm.offset_m, arm or model.nominal
    return _find_nearest(names, distance_to_upper_arm(q_rad, points, lengths, offset_m=offset_m))


def _find_nearest(names: Sequence[str], distances_m: Array) -> tuple[str, float]:
    """Return the name, among k `names`, of the part with the smallest of the distances (k, N), and this distance, m."""
    least_m = distances_m.min(axis=1)
    return names[int(least_m.argmin())], float(least_m.min())


def _list_load_points(carried: FlangeLoad) -> tuple[list[str], Array]:
    """Return names and points (k, 1, 3), m, of the load in the flange's frame."""
    extension = _list_extension_points(carried)
    points = np.array([np.zeros(3), carried.centre_m, *extension])
    return ["flange", "payload", *["extension"] * len(extension)], points[:, None]


def _list_extension_points(carried: FlangeLoad) -> list[Array]:
    """Return points along an extension in the flange's frame, m, the last at its end; empty without an extension."""
    end = np.array(carried.extension_m)
    count = 1 + int(np.linalg.norm(end) / EXTENSION_STEP_M)
    return [end * part / count for part in range(1, count + 1)] if end.any() else []


def _is_within(limits: JointLimits, *poses: Joints) -> bool:
    """Return whether all joint angles are finite and within the limits."""
    angles = np.array(poses)
    inside = np.isfinite(angles) & (angles >= limits.least_rad) & (angles <= limits.greatest_rad)
    return bool(inside.all())


def _interpolate(start_q_rad: Joints, target_q_rad: Joints) -> Array:
    """Return poses (N, 6) from start to target, both included."""
    path = np.array(travel(start_q_rad, target_q_rad))
    parts = np.linspace(0, 1, 2 + int(np.abs(path).max() / POSE_STEP_RAD))
    poses: Array = start_q_rad + parts[:, None] * path
    return poses


def _list_paths(plan: Plan, model: TurnerModel) -> Iterator[_Path]:
    """Yield the path of each dwell and each motion, without steps that other checks refuse."""
    for before, step, after in zip((None, *plan.steps), plan.steps, (*plan.steps[1:], None), strict=False):
        if isinstance(step, Dwell):
            yield _Path(step.name, np.array([step.q_rad]), model.dwell_room_m, OTHER_ATTITUDES)
        elif not isinstance(step, Rest) and _is_within(model.limits, step.start_q_rad, step.target_q_rad):
            q_rad = _interpolate(step.start_q_rad, step.target_q_rad)
            if isinstance(before, Dwell) or isinstance(after, Dwell):
                yield _Path(step.name, q_rad, model.dwell_room_m, OTHER_ATTITUDES)
            elif before is None and step.target_q_rad == plan.home_q_rad:
                yield _Path(step.name, q_rad, model.sweep_room_m, NEARER_HOME)
            else:
                yield _Path(step.name, q_rad, model.sweep_room_m, OTHER_HOME)
