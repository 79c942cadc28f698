"""Static attitudes of a UR10e, and an arm with geometric errors."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rig.config.procedures.attitude_sets import WristAngles
from rig.estimation.arrays import Array
from rig.motion.geometry import NOMINAL, flange_attitude, flange_pose


def joints_rad(wrists_deg: tuple[WristAngles, ...]) -> Array:
    """Return joint angles (N, 6), with base, shoulder and elbow at home."""
    return np.radians([(0.0, -90.0, 90.0, *wrists) for wrists in wrists_deg])


def attitudes_of(joints: Array) -> Array:
    """Return attitudes (N, 3, 3) from the flange into the base, as the arm reports them."""
    return np.array([flange_attitude(q).T for q in joints])


def draw_true_attitudes(joints: Array, rms_rad: float, rng: np.random.Generator) -> Array:
    """Return the true attitudes (N, 3, 3), with errors of the wrists' twists, zeros and encoder waves of `rms_rad`
    each.

    They are the same in every attitude of one arm.
    """
    return draw_true_arm(rms_rad, rng)(joints)[:, :3, :3]


def draw_true_arm(rms_rad: float, rng: np.random.Generator) -> Callable[[Array], Array]:
    """Return a function from reported joint angles (N, 6) to the true poses (N, 4, 4) of such an arm's flange."""
    alpha, theta = np.array(NOMINAL.alpha_rad), np.array(NOMINAL.theta_rad)
    alpha[3:5] += rms_rad * rng.normal(size=2)
    theta[3:] += rms_rad * rng.normal(size=3)
    arm = replace(NOMINAL, alpha_rad=tuple(alpha), theta_rad=tuple(theta))
    waves = rms_rad / 2 * rng.normal(size=(4, 3))

    def poses(joints: Array) -> Array:
        q = joints.copy()
        q[:, 3:] += sum(
            wave * shape(times * joints[:, 3:])
            for wave, (shape, times) in zip(waves, ((np.cos, 1), (np.sin, 1), (np.cos, 2), (np.sin, 2)), strict=True)
        )
        return flange_pose(q, arm)

    return poses
