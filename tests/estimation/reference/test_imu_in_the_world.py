"""The estimator against the world's own reckoning of what a body on the flange feels, which shares nothing with it."""

import numpy as np
import pytest

from rig.config.procedures.attitude_sets import OPTIMAL_ATTITUDES
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import DELAY, Dwells
from rig.estimation.reference.imu import solve_imu
from rig.motion.geometry import flange_pose
from rig.world.site import SiteTruth
from rig.world.ur10e.motion.flange_motion import find_motion, transfer_force
from rig.world.ur10e.motion.links import links
from support.motions.arm_attitudes import joints_rad
from support.motions.arm_sweeps import MICRO_G, find_signed_speed, joints_at, make_sweeps, plan_sweeps

pytestmark = pytest.mark.slow

NORM = 9.80665
UP = NORM * np.array([0.02, -0.01, 1.0]) / np.linalg.norm([0.02, -0.01, 1.0])
SITE = SiteTruth((0.0, 0.0, 0.0), (UP[0], UP[1], UP[2]))
MATRIX = np.array([[1.013, 0.004, -0.011], [-0.006, 0.985, 0.008], [0.009, -0.012, 1.021]])
BIAS_M_S2 = np.array([0.31, -0.22, 0.12])
LEVER_M = np.array([0.025, 0.01, 0.03])
DELAY_S = 0.004
ANGLES = np.arange(360) * 2 * np.pi / 360


def read(joints: Array, speeds: Array) -> Array:
    """(n, 3) of a sensor `LEVER_M` from the flange, at joint angles (n, 6) with constant speeds (6,)."""
    drawing = links()
    angles = [q + link.theta_rad for q, link in zip(joints.T, drawing, strict=True)]
    turns = [(np.cos(angle), np.sin(angle)) for angle in angles]
    felt = find_motion(turns, list(speeds), [0.0] * 6, drawing, SITE)
    force = transfer_force(felt.rate_rad_s, felt.change_rad_s2, felt.force_m_s2, list(LEVER_M))
    whole = np.array([component * np.ones(len(joints)) for component in force]).T
    return np.asarray(whole @ MATRIX.T + BIAS_M_S2, dtype=np.float64)


def test_what_the_world_lets_a_sensor_feel_gives_the_truth_back() -> None:
    harmonics = []
    for sweep in plan_sweeps(6):
        speed = find_signed_speed(sweep)
        m = read(joints_at(sweep, ANGLES - speed * DELAY_S), speed * np.eye(6)[sweep.joint])
        harmonics.append([m.mean(axis=0), 2 * np.cos(ANGLES) @ m / len(m), 2 * np.sin(ANGLES) @ m / len(m)])
    quiet = MICRO_G**2
    sweeps = make_sweeps(np.array(harmonics), np.tile(quiet * np.eye(9), (12, 1, 1)), plan_sweeps(6))
    joints = joints_rad(OPTIMAL_ATTITUDES)
    readings = read(joints, np.zeros(6))
    dwells = Dwells(readings, np.full_like(readings, quiet), flange_pose(joints)[:, :3, :3])
    found = solve_imu(dwells, sweeps, gravity_m_s2=NORM)
    assert found.lever_arm_m is not None and found.delay_s is not None
    np.testing.assert_allclose(found.matrix, MATRIX, atol=1e-9)
    np.testing.assert_allclose(found.bias_m_s2, BIAS_M_S2, atol=1e-8)
    np.testing.assert_allclose(found.reference_m_s2, UP, atol=1e-8)
    np.testing.assert_allclose(found.lever_arm_m, LEVER_M, atol=1e-8)
    assert abs(found.delay_s - DELAY_S) < 1e-9
    assert found.attitude_error.std_rad == 0.0 and found.covariance[DELAY, DELAY] > 0
