"""The simulated arm's moveL: along a line, never faster than a joint can, planned while the world goes on."""

import math
from collections.abc import Generator

import numpy as np
import pytest

from rig.world.ur10e.controller_messages import ProgramError
from rig.world.ur10e.motion import forward_kinematics
from rig.world.ur10e.motion.cartesian import plan_straight_line
from rig.world.ur10e.motion.joint_motion import JOINT_SPEED_LIMIT_RAD_S
from rig.world.ur10e.motion.trajectory import Joints, Trajectory

HOME: Joints = (0.0, -math.pi / 2, math.pi / 2, -math.pi / 2, -math.pi / 2, 0.0)


def planned(plan: Generator[None, None, Trajectory]) -> tuple[Trajectory, int]:
    """The trajectory, and in how many parts it was planned."""
    parts = 1
    while True:
        try:
            next(plan)
        except StopIteration as end:
            return end.value, parts
        parts += 1


def pose_by(way_m: tuple[float, float, float]) -> list[float]:
    """Home, so far away in the base's frame."""
    pose = list(forward_kinematics.flange_pose(HOME))
    return [*(np.array(pose[:3]) + way_m), *pose[3:]]


def played(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """(n, 6) joint angles and speeds, 500 a second."""
    times_s = np.arange(0.0, trajectory.duration_s, 0.002)
    q, qd, _ = zip(*(trajectory.state_at(time_s) for time_s in times_s.tolist()), strict=True)
    return np.array(q), np.array(qd)


def test_the_flange_keeps_to_the_line_and_to_its_attitude() -> None:
    trajectory, _ = planned(plan_straight_line(HOME, pose_by((0.1, 0.05, -0.2)), 0.25, 0.5))
    poses = np.array([forward_kinematics.flange_pose(q) for q in played(trajectory)[0].tolist()])
    way = poses[:, :3] - poses[0, :3]
    along = np.array([0.1, 0.05, -0.2]) / np.linalg.norm([0.1, 0.05, -0.2])
    assert np.abs(way - np.outer(way @ along, along)).max() < 1e-4
    assert np.ptp(poses[:, 3:], axis=0).max() < 1e-3
    assert np.allclose(forward_kinematics.flange_pose(trajectory.end_rad), pose_by((0.1, 0.05, -0.2)), atol=1e-7)


def test_a_long_line_is_planned_in_many_small_parts() -> None:
    """4 s of motion: planned at once, every stream of the world would stand still meanwhile."""
    trajectory, parts = planned(plan_straight_line(HOME, pose_by((0.0, 0.0, -0.2)), 0.05, 1.2))
    assert trajectory.duration_s > 4
    assert parts >= 20 * trajectory.duration_s


def test_where_a_joint_would_be_too_fast_the_line_is_slower() -> None:
    fast, _ = planned(plan_straight_line(HOME, pose_by((0.2, 0.0, 0.1)), 4.0, 100.0))
    _, speeds = played(fast)
    share = np.abs(speeds).max(axis=0) / JOINT_SPEED_LIMIT_RAD_S
    assert 0.9 < share.max() <= 1.0


def test_a_line_out_of_reach_is_refused() -> None:
    with pytest.raises(ProgramError):
        planned(plan_straight_line(HOME, pose_by((2.0, 0.0, 0.0)), 0.25, 0.5))
