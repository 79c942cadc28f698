"""Joint moments and flange wrench from weight and acceleration of the links and of the payload.

Each link is a point mass in its centre (maker's article 45257, "Dynamics"); rotational inertia and friction are
neglected. The base is upright and at rest, as the controller assumes.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rig.world.ur10e.motion.forward_kinematics import frames
from rig.world.ur10e.motion.links import Links
from rig.world.ur10e.motion.tcp_motion import GRAVITY
from rig.world.ur10e.motion.trajectory import Joints

Array = NDArray[np.float64]

STEP_S = 1e-3


@dataclass(frozen=True, slots=True)
class Bodies:
    """The links' masses, kg, and their centres, m, each in its link's frame."""

    masses_kg: tuple[float, ...]
    centres_m: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True)
class Load:
    """The moments of the six joints, the payload's `wrench` (N, N m) in the flange's axes, and the total momentum."""

    moments_nm: tuple[float, ...]
    wrench: tuple[float, ...]
    momentum_kg_m_s: float


@lru_cache(maxsize=4)  # several outputs and clients need the same
def find_load(
    joints: tuple[Joints, Joints, Joints],
    payload_kg: float,
    payload_centre_m: tuple[float, ...],
    links: Links,
    bodies: Bodies,
) -> Load:
    """Return, by inverse dynamics, joint torques, the payload's wrench in the flange's frame and the arm's momentum.

    The inputs are joint angles, speeds and accelerations (rad, s), and a payload in the flange's axes.
    """
    q, qd, qdd = (np.array(values) for values in joints)
    masses, centres_m = np.array([*bodies.masses_kg, payload_kg]), np.array([*bodies.centres_m, payload_centre_m])
    rotations, positions = _frames(q, links)
    now = _centres(rotations, positions, centres_m)
    angles = [q + sign * STEP_S * qd + STEP_S**2 / 2 * qdd for sign in (-1, 1)]
    before, after = (_centres(*_frames(q, links), centres_m) for q in angles)
    forces = masses[:, None] * ((after - 2 * now + before) / STEP_S**2 + GRAVITY)
    moments_of_force = _cross(now - positions[:-1, None], forces)  # (6, 7, 3): about each joint, of each mass
    axes = rotations[:-1, :, 2]
    moments = [float(axes[joint] @ moments_of_force[joint, joint:].sum(axis=0)) for joint in range(len(axes))]
    weight = -rotations[-1].T @ forces[-1]
    torque = _cross(np.array(payload_centre_m), weight)
    momentum = masses @ (after - before) / (2 * STEP_S)
    return Load(tuple(moments), (*weight.tolist(), *torque.tolist()), float(np.linalg.norm(momentum)))


def _cross(a: Array, b: Array) -> Array:
    """Return the vector product along the last axis, several times faster than NumPy's for small arrays."""
    product: Array = a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]
    return product


def _frames(q: Array, links: Links) -> tuple[Array, Array]:
    """Return rotations (7, 3, 3) and positions (7, 3) of the base and of each link."""
    rotations, positions = zip(*frames(q.tolist(), links), strict=True)
    return np.array(rotations), np.array(positions)


def _centres(rotations: Array, positions: Array, centres_m: Array) -> Array:
    """Return the centres of mass (7, 3) of links and payload, m; `centres_m` has each in its body's own frame."""
    frame_index = [*range(1, len(positions)), len(positions) - 1]  # the payload is fixed to the last link
    centres: Array = positions[frame_index] + np.einsum("nij,nj->ni", rotations[frame_index], centres_m)
    return centres
