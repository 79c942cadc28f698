"""Kinematics of the UR10e: where the flange is and how it turns, from joint angles and speeds.

Every function takes arrays whose last axis holds the six joints, base to wrist 3, and broadcasts over the others.
"""

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array

# Denavit–Hartenberg parameters (maker's article 45257): (a in m, d in m, cos α, sin α); every α is a multiple of 90°.
DH = (
    (0.0, 0.1807, 0.0, 1.0),
    (-0.6127, 0.0, 1.0, 0.0),
    (-0.57155, 0.0, 1.0, 0.0),
    (0.0, 0.17415, 0.0, 1.0),
    (0.0, 0.11985, 0.0, -1.0),
    (0.0, 0.11655, 1.0, 0.0),
)


def _link(angle_rad: Array, a_m: float, d_m: float, cos_alpha: float, sin_alpha: float) -> Array:
    """(…, 4, 4) transform across one joint: turn about z, along z, along x, turn about x."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    link = np.zeros((*angle_rad.shape, 4, 4))
    link[..., 0, 0], link[..., 0, 1], link[..., 0, 2], link[..., 0, 3] = (
        cos,
        -sin * cos_alpha,
        sin * sin_alpha,
        a_m * cos,
    )
    link[..., 1, 0], link[..., 1, 1], link[..., 1, 2], link[..., 1, 3] = (
        sin,
        cos * cos_alpha,
        -cos * sin_alpha,
        a_m * sin,
    )
    link[..., 2, 1], link[..., 2, 2], link[..., 2, 3] = sin_alpha, cos_alpha, d_m
    link[..., 3, 3] = 1.0
    return link


def _frames(q_rad: ArrayLike) -> list[Array]:
    """Seven (…, 4, 4) transforms in the base frame: the base itself, then the frame after each joint."""
    q = np.asarray(q_rad, dtype=np.float64)
    frames = [np.broadcast_to(np.eye(4), (*q.shape[:-1], 4, 4))]
    for joint, parameters in enumerate(DH):
        frames.append(frames[-1] @ _link(q[..., joint], *parameters))
    return frames


def flange_pose(q_rad: ArrayLike) -> Array:
    """(…, 4, 4) pose of the flange in the base frame (metres) from joint angles `q_rad` (…, 6)."""
    return _frames(q_rad)[-1]


def flange_attitude(q_rad: ArrayLike) -> Array:
    """(…, 3, 3) rotations taking a vector of the base frame into the flange's, for joint angles `q_rad` (…, 6)."""
    rotations: Array = np.swapaxes(flange_pose(q_rad)[..., :3, :3], -1, -2)
    return rotations


def flange_axes(q_rad: ArrayLike) -> Array:
    """(…, 3, 6) unit axes of the six joints (columns) in the flange frame, for joint angles `q_rad` (…, 6).

    A joint's own angle does not move its column, so a sweep of one wrist keeps its axis.
    """
    *before, flange = _frames(q_rad)
    axes_in_base = np.stack([frame[..., :3, 2] for frame in before], axis=-1)
    return np.swapaxes(flange[..., :3, :3], -1, -2) @ axes_in_base


def flange_rate(q_rad: ArrayLike, qd_rad_s: ArrayLike) -> Array:
    """(…, 3) angular velocity of the flange in its own frame, rad/s, from joint angles and speeds (…, 6)."""
    rate: Array = np.einsum("...ij,...j->...i", flange_axes(q_rad), np.asarray(qd_rad_s, dtype=np.float64))
    return rate
