"""The controller's estimate of the tool centre point's motion from the joints: speeds, accelerations, accelerometer.

The estimate uses the controller's links, and a base that is upright and at rest. Linear parts come first, then angular
ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from rig.world.site import SiteTruth
from rig.world.ur10e.motion.flange_motion import find_flange_motion
from rig.world.ur10e.motion.forward_kinematics import Vector, flange_frame, flange_rate
from rig.world.ur10e.motion.links import Links
from rig.world.ur10e.motion.trajectory import ZERO, Joints

GRAVITY: Vector = (0.0, 0.0, 9.82)  # m/s², the controller's value, opposite to gravity
UPRIGHT = SiteTruth((0.0, 0.0, 0.0), GRAVITY)
STEP_S = 1e-4


@dataclass(frozen=True, slots=True)
class TcpMotion:
    """Speed and acceleration (m, rad, s) in the base's axes, and the accelerometer's reading (m/s²) in the flange's."""

    speed: tuple[float, ...]
    acceleration: tuple[float, ...]
    accelerometer: Vector


@lru_cache(maxsize=4)  # several outputs and clients need the same
def find_tcp_motion(q_rad: Joints, qd_rad_s: Joints, qdd_rad_s2: Joints, links: Links) -> TcpMotion:
    """Return the tool's motion for joint angles, speeds and accelerations."""
    _, change, force = find_flange_motion(q_rad, qd_rad_s, qdd_rad_s2, links, UPRIGHT)
    if not any(qd_rad_s) and not any(qdd_rad_s2):
        return TcpMotion(ZERO, ZERO, force)
    rotation, _ = flange_frame(q_rad, links)

    def rotate_to_base(vector: Sequence[float]) -> list[float]:
        return [sum(r * v for r, v in zip(row, vector, strict=True)) for row in rotation]

    linear = [push - rest for push, rest in zip(rotate_to_base(force), GRAVITY, strict=True)]
    speed = (*_velocity(q_rad, qd_rad_s, links), *rotate_to_base(flange_rate(q_rad, qd_rad_s, links)))
    return TcpMotion(speed, (*linear, *rotate_to_base(change)), force)


@lru_cache(maxsize=4)
def find_elbow(q_rad: Joints, qd_rad_s: Joints, links: Links) -> tuple[Vector, Vector]:
    """Return position (m) and velocity (m/s) of the elbow, the end of the upper arm, in the base's axes."""
    _, position = flange_frame(q_rad[:2], links[:2])
    velocity = _velocity(q_rad[:2], qd_rad_s[:2], links[:2])
    return position, velocity


def _velocity(q_rad: Joints, qd_rad_s: Joints, links: Links) -> Vector:
    """Return the velocity of the last link's origin, m/s, from its positions a moment before and after."""
    before, after = (
        flange_frame([a + sign * v * STEP_S for a, v in zip(q_rad, qd_rad_s, strict=True)], links)[1]
        for sign in (-1, 1)
    )
    x, y, z = ((b - a) / (2.0 * STEP_S) for a, b in zip(before, after, strict=True))
    return x, y, z
