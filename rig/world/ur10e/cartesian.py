"""Moves in tool space: the joints for a pose, and the joints along a straight line."""

from collections.abc import Sequence
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from rig.world.ur10e.controller_messages import ProgramError
from rig.world.ur10e.forward_kinematics import flange_frame, rotation_from_vector, rotation_vector
from rig.world.ur10e.joint_motion import JOINT_SPEED_LIMIT_RAD_S
from rig.world.ur10e.links import NOMINAL, Links
from rig.world.ur10e.trajectory import Joints, Piece, Trajectory, rest

Array = NDArray[np.float64]

KNOT_S = 0.01  # the joints follow the line exactly this often, with constant acceleration in between
LEVER_M = 0.3  # a rotation by one radian counts as so long a way
ACCURACY = 1e-9
DIFFERENCE_RAD = 1e-6


def _twist(q: Sequence[float] | Array, rotation: Array, position: Array, links: Links) -> Array:
    """(6,) way from the flange at `q` to a frame: translation (m) and rotation vector (rad), in the base frame."""
    here, origin = flange_frame(list(q), links)
    turn = rotation @ np.array(here).T
    return np.array([*(position - np.array(origin)), *rotation_vector(turn.tolist())])


def _jacobian(q: Sequence[float] | Array, links: Links) -> Array:
    """(6, 6) twist of the flange per joint speed."""
    columns = []
    for joint in range(6):
        nudged = [angle + DIFFERENCE_RAD * (i == joint) for i, angle in enumerate(q)]
        rotation, position = flange_frame(nudged, links)
        columns.append(_twist(q, np.array(rotation), np.array(position), links) / DIFFERENCE_RAD)
    return np.array(columns).T


def joints_for(pose: Sequence[float], near: Joints, links: Links = NOMINAL) -> Joints:
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


def straight_line(
    start: Joints, pose: Sequence[float], speed_m_s: float, acceleration_m_s2: float, links: Links = NOMINAL
) -> Trajectory:
    """A moveL from rest to rest. Raises `ProgramError` when a joint would exceed its speed."""
    rotation, position = np.array(rotation_from_vector(pose[3:])), np.array(pose[:3])
    twist = _twist(start, rotation, position, links)
    length = max(hypot(*twist[:3]), LEVER_M * hypot(*twist[3:]))
    if length < ACCURACY:
        return rest(start)
    top = min(speed_m_s, sqrt(length * acceleration_m_s2))
    ramp_s = top / acceleration_m_s2
    duration_s = ramp_s + length / top
    knots = max(2, round(duration_s / KNOT_S))
    step_s = duration_s / knots

    def rate(time_s: float, q: Array) -> Array:
        along = top * min(1.0, time_s / ramp_s, max(0.0, duration_s - time_s) / ramp_s)
        return np.asarray(np.linalg.solve(_jacobian(q, links), twist * (along / length)), dtype=np.float64)

    q, qd, pieces = np.array(start), np.zeros(6), []
    for knot in range(knots):
        next_qd = rate((knot + 1) * step_s, q + qd * step_s)
        if np.any(np.abs(next_qd) > JOINT_SPEED_LIMIT_RAD_S):
            raise ProgramError("joint speed limit exceeded on the way of movel")
        pieces.append(Piece(step_s, tuple(q.tolist()), tuple(qd.tolist()), tuple(((next_qd - qd) / step_s).tolist())))
        q, qd = q + (qd + next_qd) * (step_s / 2.0), next_qd
    return Trajectory(pieces, joints_for(pose, tuple(q.tolist()), links))
