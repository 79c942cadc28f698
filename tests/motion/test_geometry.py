"""The kinematics of the UR10e against the maker's figures, the wrist formulae and a numeric derivative."""

import numpy as np
import pytest

from rig.motion.geometry import flange_arm, flange_axes, flange_pose, flange_rate

HOME = np.radians([0, -90, 90, -90, -90, 0])


def random_joints(count: int) -> np.ndarray:
    return np.random.default_rng(7).uniform(-2 * np.pi, 2 * np.pi, (count, 6))


def test_stretched_arm_reaches_as_far_as_by_the_maker_s_dimensions() -> None:
    position = flange_pose(np.zeros(6))[:3, 3]
    np.testing.assert_allclose(position, [-0.6127 - 0.57155, -0.17415 - 0.11655, 0.1807 - 0.11985], atol=1e-12)


def test_home_points_the_flange_straight_down() -> None:
    np.testing.assert_allclose(flange_pose(HOME)[:3, 2], [0, 0, -1], atol=1e-12)


def test_poses_are_rigid_for_any_joints() -> None:
    rotation = flange_pose(random_joints(50))[:, :3, :3]
    np.testing.assert_allclose(
        rotation @ rotation.transpose(0, 2, 1), np.broadcast_to(np.eye(3), (50, 3, 3)), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(rotation), 1, atol=1e-12)


def test_wrist_axes_follow_the_closed_formulae() -> None:
    q = random_joints(50)
    q5, q6 = q[:, 4], q[:, 5]
    axes = flange_axes(q)[..., 3:]
    wrist_1 = np.stack([np.sin(q5) * np.cos(q6), -np.sin(q5) * np.sin(q6), np.cos(q5)], axis=-1)
    wrist_2 = np.stack([-np.sin(q6), -np.cos(q6), np.zeros(50)], axis=-1)
    np.testing.assert_allclose(axes[..., 0], wrist_1, atol=1e-12)
    np.testing.assert_allclose(axes[..., 1], wrist_2, atol=1e-12)
    np.testing.assert_allclose(axes[..., 2], np.broadcast_to([0, 0, 1], (50, 3)), atol=1e-12)


def test_wrist_axes_at_home_are_the_flange_s_own_axes() -> None:
    np.testing.assert_allclose(flange_axes(HOME)[:, 3:], [[-1, 0, 0], [0, -1, 0], [0, 0, 1]], atol=1e-12)


@pytest.mark.parametrize(("joint", "distance_m"), [(3, 0.167), (4, 0.117), (5, 0.0)])
def test_flange_origin_lies_at_the_known_distance_from_each_wrist_axis(joint: int, distance_m: float) -> None:
    turned = HOME + np.eye(6)[joint] * np.pi
    moved = flange_pose(turned)[:3, 3] - flange_pose(HOME)[:3, 3]
    assert np.linalg.norm(moved) / 2 == pytest.approx(distance_m, abs=1e-3)


def test_flange_rate_is_the_derivative_of_the_attitude() -> None:
    q = random_joints(50)
    qd = np.random.default_rng(8).normal(size=(50, 6))
    step_s = 1e-6
    before = flange_pose(q - qd * step_s / 2)[:, :3, :3]
    after = flange_pose(q + qd * step_s / 2)[:, :3, :3]
    turn = (before.transpose(0, 2, 1) @ after - np.eye(3)) / step_s
    numeric = np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]], axis=-1)
    np.testing.assert_allclose(flange_rate(q, qd), numeric, atol=1e-4)


def test_a_sweep_of_one_wrist_keeps_its_own_axis() -> None:
    angles = np.linspace(-6, 6, 25)
    for joint in (3, 4, 5):
        q = np.repeat(HOME[np.newaxis], len(angles), axis=0)
        q[:, joint] = angles
        axes = flange_axes(q)[:, :, joint]
        np.testing.assert_allclose(axes, np.broadcast_to(axes[0], axes.shape), atol=1e-12)


@pytest.mark.parametrize("joint", range(6))
def test_half_a_turn_of_a_joint_shows_on_what_the_flange_swings(joint: int) -> None:
    """The way between both places is twice what lies across the axis."""
    q = random_joints(20)
    turned = q + np.pi * np.eye(6)[joint]
    here, there, axis = flange_pose(q), flange_pose(turned), flange_axes(q)[..., joint]
    way = np.einsum("nji,nj->ni", here[:, :3, :3], here[:, :3, 3] - there[:, :3, 3])
    swung = flange_arm(q, joint)
    across = swung - np.sum(swung * axis, axis=1, keepdims=True) * axis
    np.testing.assert_allclose(2 * across, way, atol=1e-12)
