"""What the joints must bear and the flange feels: weights and accelerations of the links and of the payload.

Each link's mass is thought of as sitting in its centre (maker's article 45257, "Dynamics"): what else it resists a turn
with is left out, and so is friction. The base stands upright and still, as the controller takes it to.
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
    """The links' masses, kg, and their centres, m, in the frame of what each link carries."""

    masses_kg: tuple[float, ...]
    centres_m: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True)
class Load:
    """`moments_nm` of the six joints; `wrench`, N and N m, of the payload's weight on the flange, in its axes;
    `momentum_kg_m_s`, the size of it all together.
    """

    moments_nm: tuple[float, ...]
    wrench: tuple[float, ...]
    momentum_kg_m_s: float


@lru_cache(maxsize=4)  # several outputs and several clients ask for the same
def load(
    joints: tuple[Joints, Joints, Joints],
    payload_kg: float,
    payload_centre_m: tuple[float, ...],
    links: Links,
    bodies: Bodies,
) -> Load:
    """Load of joints at angles (rad), speeds (rad/s), accelerations (rad/s²), with a payload in the flange's axes."""
    q, qd, qdd = (np.array(each) for each in joints)
    masses, own = np.array([*bodies.masses_kg, payload_kg]), np.array([*bodies.centres_m, payload_centre_m])
    rotations, places = _frames(q, links)
    here = _centres(rotations, places, own)
    before, after = (_centres(*_frames(q + sign * STEP_S * qd + STEP_S**2 / 2 * qdd, links), own) for sign in (-1, 1))
    forces = masses[:, None] * ((after - 2 * here + before) / STEP_S**2 + GRAVITY)
    turns = _cross(here - places[:-1, None], forces)  # (6, 7, 3): about each joint, of each mass
    axes = rotations[:-1, :, 2]
    moments = [float(axes[joint] @ turns[joint, joint:].sum(axis=0)) for joint in range(len(axes))]
    weight = -rotations[-1].T @ forces[-1]
    turning = _cross(np.array(payload_centre_m), weight)
    momentum = masses @ (after - before) / (2 * STEP_S)
    return Load(tuple(moments), (*weight.tolist(), *turning.tolist()), float(np.linalg.norm(momentum)))


def _cross(a: Array, b: Array) -> Array:
    """The vector product along the last axis: NumPy's own takes several times as long for so few."""
    product: Array = a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]
    return product


def _frames(q: Array, links: Links) -> tuple[Array, Array]:
    """Rotations (7, 3, 3) and places (7, 3) of the base and of what each link carries."""
    rotations, places = zip(*frames(q.tolist(), links), strict=True)
    return np.array(rotations), np.array(places)


def _centres(rotations: Array, places: Array, own: Array) -> Array:
    """(7, 3) centres of mass of the links and of the payload, m, from those in each one's `own` frame."""
    carried = [*range(1, len(places)), len(places) - 1]  # the payload sits where the last link does
    centres: Array = places[carried] + np.einsum("nij,nj->ni", rotations[carried], own)
    return centres
