"""Static attitudes of a UR10e, and an arm whose geometry is not quite what it says."""

from dataclasses import replace

import numpy as np

from rig.arm.kinematics import NOMINAL, flange_attitude
from rig.estimation.arrays import Array

# Wrist 1 and wrist 3 in degrees, wrist 2 at −90°: D-optimal on a 45° grid for attitudes known to 1 mrad.
EIGHTEEN = (
    *((-180, q6) for q6 in (-135, -90, -45, 90, 135)),
    *((-135, 45), (-90, -135)),
    *((-45, q6) for q6 in (-45, 45, 135)),
    *((0, q6) for q6 in (-180, -135, 0)),
    *((45, q6) for q6 in (-90, 90)),
    *((90, 45), (135, -180), (135, 0)),
)
# Each face of the flange up twice, with opposite headings.
FACES = (
    *((q4, q6) for q4 in (-90, 90) for q6 in (-180, -90, 0, 90)),
    *((q4, q6) for q4 in (-180, 0) for q6 in (0, -180)),
)


def joints_rad(wrists_deg: tuple[tuple[float, float], ...]) -> Array:
    """(N, 6) joint angles, base, shoulder and elbow at home."""
    joints = [(-90.0, -90.0, -90.0, q4, -90.0, q6) for q4, q6 in wrists_deg]
    return np.radians(joints)


def attitudes_of(joints: Array) -> Array:
    """(N, 3, 3) from the flange into the base, by the arm's own account."""
    return np.array([flange_attitude(q).T for q in joints])


def crooked(joints: Array, rms_rad: float, rng: np.random.Generator) -> Array:
    """(N, 3, 3) as they are, with the wrists' twists, zeros and encoder waves off by `rms_rad` each.

    They are the same in every attitude of one arm.
    """
    alpha, theta = np.array(NOMINAL.alpha_rad), np.array(NOMINAL.theta_rad)
    alpha[3:5] += rms_rad * rng.normal(size=2)
    theta[3:] += rms_rad * rng.normal(size=3)
    arm = replace(NOMINAL, alpha_rad=tuple(alpha), theta_rad=tuple(theta))
    waves = rms_rad / 2 * rng.normal(size=(4, 3))
    q = joints.copy()
    q[:, 3:] += sum(
        wave * shape(times * joints[:, 3:])
        for wave, (shape, times) in zip(waves, ((np.cos, 1), (np.sin, 1), (np.cos, 2), (np.sin, 2)), strict=True)
    )
    return np.array([flange_attitude(each, arm).T for each in q])
