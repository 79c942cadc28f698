"""Moves in tool space: joint angles for a pose, and joint motion along a straight line."""

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

KNOT_S = 0.01  # interval at which the joints follow the line exactly, with constant acceleration in between
ROTATION_RADIUS_M = 0.3  # the length that a rotation by one radian counts as
FIT_TOLERANCE = 1e-9
MIN_SPEED_FRACTION = 0.1  # of the requested speed, that is tried
KNOTS_PER_TICK = 5  # knots that are computed in one tick: a long line must not stop the world


def _twist(q: Sequence[float] | Array, rotation: Array, position: Array, links: Links) -> Array:
    """Return the displacement (6,) that moves the flange from its frame at `q` to the frame `rotation`, `position`.

    The displacement is a translation, m, and a rotation vector, rad, in the base's axes.
    """
    current, origin = flange_frame(list(q), links)
    turn = rotation @ np.array(current).T
    return np.array([*(position - np.array(origin)), *rotation_vector(turn.tolist())])


def _length(twist: Array) -> float:
    """Return the length of a displacement (6,), m; a rotation counts as its arc at the radius `ROTATION_RADIUS_M`."""
    return max(hypot(*twist[:3]), ROTATION_RADIUS_M * hypot(*twist[3:]))


def _jacobian(q: Sequence[float] | Array, links: Links) -> Array:
    """Return the Jacobian (6, 6): twist of the flange per joint speed."""
    *inner, (_, flange) = frames(list(q), links)
    axes = np.array([[row[2] for row in rotation] for rotation, _ in inner])
    levers = np.array(flange) - np.array([position for _, position in inner])
    return np.hstack([np.cross(axes, levers), axes]).T


def solve_inverse_kinematics(pose: Sequence[float], start_rad: Joints, links: Links = NOMINAL) -> Joints:
    """Return the joint angles for the flange's `pose` (m, rotation vector rad), by Newton's method from `start_rad`.

    Raise `ProgramError` if the method does not converge, because the pose is out of reach or the arm becomes singular.
    """
    rotation, position = np.array(rotation_from_vector(pose[3:])), np.array(pose[:3])
    q = np.array(start_rad)
    for _ in range(100):
        error = _twist(q, rotation, position, links)
        if np.abs(error).max() < FIT_TOLERANCE:
            return tuple(q.tolist())
        matrix = _jacobian(q, links)
        step = matrix.T @ np.linalg.solve(matrix @ matrix.T + 1e-9 * np.eye(6), error)
        q = q + step * min(1.0, 0.3 / float(np.abs(step).max()))
    raise ProgramError("no inverse kinematics solution was found")


def solve_joint_speeds(q: Joints, tool_speed: Sequence[float], links: Links = NOMINAL) -> Joints:
    """Return the joint speeds, rad/s, for a flange twist (m/s, rad/s, base frame), within the joint limits.

    A twist that would exceed a joint's limit is scaled down. Raise `ProgramError` if the arm is singular.
    """
    try:
        speeds = np.linalg.solve(_jacobian(q, links), np.array(tool_speed))
    except np.linalg.LinAlgError:
        raise ProgramError("the arm is singular on the way of speedl") from None
    excess = max(1.0, float(np.max(np.abs(speeds) / np.array(JOINT_SPEED_LIMIT_RAD_S))))
    return tuple((speeds / excess).tolist())


def approach_speed(tool_speed: Sequence[float], target: Sequence[float], step: float) -> Sequence[float]:
    """Return the tool's velocity (6,), m/s and rad/s, after a change by at most `step`, m/s, towards `target`."""
    change = np.array(target) - np.array(tool_speed)
    size = _length(change)
    return target if size <= step else tuple((np.array(tool_speed) + change * (step / size)).tolist())


def plan_straight_line(
    start: Joints, pose: Sequence[float], speed_m_s: float, acceleration_m_s2: float, links: Links = NOMINAL
) -> Generator[None, None, Trajectory]:
    """Return a moveL from rest to rest, after planning a few knots per tick, so that the world continues meanwhile.

    If a joint would be too fast, the whole line is slowed down. Raise `OutOfReach` if the pose is out of reach, or if
    the line would be slowed down below the fraction `MIN_SPEED_FRACTION` of its speed, as near a singularity.
    """
    rotation, position = np.array(rotation_from_vector(pose[3:])), np.array(pose[:3])
    twist = _twist(start, rotation, position, links)
    length = _length(twist)
    if length < FIT_TOLERANCE:
        return build_rest(start)
    try:
        solve_inverse_kinematics(pose, start, links)
    except ProgramError as error:  # the pose is out of reach
        raise OutOfReach(str(error)) from None
    top_m_s = min(speed_m_s, sqrt(length * acceleration_m_s2))
    slowest = MIN_SPEED_FRACTION * top_m_s
    while top_m_s > slowest:
        segments, excess = yield from _sample_line(start, twist, top_m_s, acceleration_m_s2, links)
        if excess <= 1.0:
            end_rad, _, _ = segments[-1].state_at(segments[-1].duration_s)
            return Trajectory(segments, solve_inverse_kinematics(pose, end_rad, links))
        top_m_s /= 1.001 * excess
    raise OutOfReach("joint speed limit exceeded on the way of movel")


def _sample_line(
    start: Joints, twist: Array, top_m_s: float, acceleration: float, links: Links
) -> Generator[None, None, tuple[list[MotionSegment], float]]:
    """Sample a straight line at `top_m_s`, some knots per tick; return its segments and the largest speed ratio.

    The speed ratio of a joint is its speed divided by its limit.
    """
    length = _length(twist)
    ramp_s = top_m_s / acceleration
    duration_s = ramp_s + length / top_m_s
    knots = max(2, round(duration_s / KNOT_S))
    step_s = duration_s / knots
    limits = np.array(JOINT_SPEED_LIMIT_RAD_S)
    q: Array = np.array(start)
    qd: Array = np.zeros(6)
    segments: list[MotionSegment] = []
    excess = 0.0
    for knot in range(1, knots + 1):
        if knot % KNOTS_PER_TICK == 0:
            yield
        speed_m_s = top_m_s * min(1.0, knot * step_s / ramp_s, max(0.0, duration_s - knot * step_s) / ramp_s)
        try:
            # The joint speeds that move the flange along the line at the knot, at angles predicted for it.
            next_qd: Array = np.asarray(
                np.linalg.solve(_jacobian(q + qd * step_s, links), twist * (speed_m_s / length)), dtype=np.float64
            )
        except np.linalg.LinAlgError:
            return segments, inf
        excess = max(excess, float(np.max(np.abs(next_qd) / limits)))
        qdd = (next_qd - qd) / step_s
        segments.append(MotionSegment(step_s, tuple(q.tolist()), tuple(qd.tolist()), tuple(qdd.tolist())))
        q, qd = q + (qd + next_qd) * (step_s / 2.0), next_qd
    return segments, excess
