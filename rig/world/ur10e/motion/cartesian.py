"""Moves in tool space: the joints for a pose, and the joints along a straight line."""

from collections.abc import Generator, Sequence
from math import hypot, inf, sqrt

import numpy as np
from numpy.typing import NDArray

from rig.world.ur10e.controller_messages import OutOfReach, ProgramError
from rig.world.ur10e.motion.forward_kinematics import flange_frame, frames, rotation_from_vector, rotation_vector
from rig.world.ur10e.motion.joint_motion import JOINT_SPEED_LIMIT_RAD_S
from rig.world.ur10e.motion.links import NOMINAL, Links
from rig.world.ur10e.motion.trajectory import Joints, MotionSegment, Trajectory, build_rest

Array = NDArray[np.float64]

KNOT_S = 0.01  # the joints follow the line exactly this often, with constant acceleration in between
LEVER_M = 0.3  # a rotation by one radian counts as so long a way
ACCURACY = 1e-9
SLOWEST = 0.1  # of the speed asked for
KNOTS_A_TICK = 5  # are planned


def _twist(q: Sequence[float] | Array, rotation: Array, position: Array, links: Links) -> Array:
    """(6,) way from the flange at `q` to a frame: translation (m) and rotation vector (rad), in the base frame."""
    here, origin = flange_frame(list(q), links)
    turn = rotation @ np.array(here).T
    return np.array([*(position - np.array(origin)), *rotation_vector(turn.tolist())])


def _length(twist: Array) -> float:
    """The length of a way, m."""
    return max(hypot(*twist[:3]), LEVER_M * hypot(*twist[3:]))


def _jacobian(q: Sequence[float] | Array, links: Links) -> Array:
    """(6, 6) twist of the flange per joint speed."""
    *inner, (_, flange) = frames(list(q), links)
    axes = np.array([[row[2] for row in rotation] for rotation, _ in inner])
    levers = np.array(flange) - np.array([position for _, position in inner])
    return np.hstack([np.cross(axes, levers), axes]).T


def solve_inverse_kinematics(pose: Sequence[float], near: Joints, links: Links = NOMINAL) -> Joints:
    """The joints that put the flange at `pose` (m, rotation vector rad), by Newton's method from `near`.

    Raises `ProgramError` when it does not get there: out of reach, or singular on the way.
    """
    rotation, position = np.array(rotation_from_vector(pose[3:])), np.array(pose[:3])
    q = np.array(near)
    for _ in range(100):
        error = _twist(q, rotation, position, links)
        if np.abs(error).max() < ACCURACY:
            return tuple(q.tolist())
        matrix = _jacobian(q, links)
        step = matrix.T @ np.linalg.solve(matrix @ matrix.T + 1e-9 * np.eye(6), error)
        q = q + step * min(1.0, 0.3 / float(np.abs(step).max()))
    raise ProgramError("no inverse kinematics solution was found")


def solve_joint_speeds(q: Joints, tool: Sequence[float], links: Links = NOMINAL) -> Joints:
    """The joint speeds that move the flange by `tool` (m/s, rad/s, in the base's frame), all slower if one is too fast.

    Raises `ProgramError` where the arm is singular.
    """
    try:
        speeds = np.linalg.solve(_jacobian(q, links), np.array(tool))
    except np.linalg.LinAlgError:
        raise ProgramError("the arm is singular on the way of speedl") from None
    excess = max(1.0, float(np.max(np.abs(speeds) / np.array(JOINT_SPEED_LIMIT_RAD_S))))
    return tuple((speeds / excess).tolist())


def approach_speed(tool: Sequence[float], wanted: Sequence[float], step: float) -> Sequence[float]:
    """The speed of the tool after it has changed by `step` (m/s) towards the one that is wanted."""
    change = np.array(wanted) - np.array(tool)
    size = _length(change)
    return wanted if size <= step else tuple((np.array(tool) + change * (step / size)).tolist())


def plan_straight_line(
    start: Joints, pose: Sequence[float], speed_m_s: float, acceleration_m_s2: float, links: Links = NOMINAL
) -> Generator[None, None, Trajectory]:
    """A moveL from rest to rest, planned in small parts, so that the world goes on meanwhile.

    Where a joint would be too fast the whole line is made so much slower. Raises `OutOfReach` when that would be
    slower than `SLOWEST`, because the line leads through a singularity, and when the pose is out of reach.
    """
    rotation, position = np.array(rotation_from_vector(pose[3:])), np.array(pose[:3])
    twist = _twist(start, rotation, position, links)
    length = _length(twist)
    if length < ACCURACY:
        return build_rest(start)
    try:
        solve_inverse_kinematics(pose, start, links)
    except ProgramError as error:  # that pose is not planned for
        raise OutOfReach(str(error)) from None
    top = min(speed_m_s, sqrt(length * acceleration_m_s2))
    slowest = SLOWEST * top
    while top > slowest:
        pieces, excess = yield from _sample_line(start, twist, top, acceleration_m_s2, links)
        if excess <= 1.0:
            end_rad, _, _ = pieces[-1].at(pieces[-1].duration_s)
            return Trajectory(pieces, solve_inverse_kinematics(pose, end_rad, links))
        top /= 1.001 * excess
    raise OutOfReach("joint speed limit exceeded on the way of movel")


def _sample_line(
    start: Joints, twist: Array, top: float, acceleration: float, links: Links
) -> Generator[None, None, tuple[list[MotionSegment], float]]:
    """The pieces of a way at the speed `top`, and by how many times its fastest joint is too fast."""
    length = _length(twist)
    ramp_s = top / acceleration
    duration_s = ramp_s + length / top
    knots = max(2, round(duration_s / KNOT_S))
    step_s = duration_s / knots
    limits = np.array(JOINT_SPEED_LIMIT_RAD_S)
    q: Array = np.array(start)
    qd: Array = np.zeros(6)
    pieces: list[MotionSegment] = []
    excess = 0.0
    for knot in range(1, knots + 1):
        if knot % KNOTS_A_TICK == 0:
            yield
        along = top * min(1.0, knot * step_s / ramp_s, max(0.0, duration_s - knot * step_s) / ramp_s)
        try:
            next_qd: Array = np.asarray(
                np.linalg.solve(_jacobian(q + qd * step_s, links), twist * (along / length)), dtype=np.float64
            )
        except np.linalg.LinAlgError:
            return pieces, inf
        excess = max(excess, float(np.max(np.abs(next_qd) / limits)))
        pieces.append(
            MotionSegment(step_s, tuple(q.tolist()), tuple(qd.tolist()), tuple(((next_qd - qd) / step_s).tolist()))
        )
        q, qd = q + (qd + next_qd) * (step_s / 2.0), next_qd
    return pieces, excess
