"""What the controller reckons of the tool centre point from the joints: speeds, accelerations, its accelerometer.

With its own links, on a base that it takes to stand upright and still. Linear parts come first, then angular ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from rig.world.site import SiteTruth
from rig.world.ur10e.motion.flange_motion import find_flange_motion
from rig.world.ur10e.motion.forward_kinematics import Vector, flange_frame, flange_rate
from rig.world.ur10e.motion.links import Links
from rig.world.ur10e.motion.trajectory import ZERO, Joints

GRAVITY: Vector = (0.0, 0.0, 9.82)  # m/s², what an arm says of gravity, against its direction
UPRIGHT = SiteTruth((0.0, 0.0, 0.0), GRAVITY)
STEP_S = 1e-4


@dataclass(frozen=True, slots=True)
class TcpMotion:
    """Speed and acceleration (m/s, rad/s; m/s², rad/s²) in the base's axes; `accelerometer`, m/s², in the flange's,
    where it sits."""

    speed: tuple[float, ...]
    acceleration: tuple[float, ...]
    accelerometer: Vector


@lru_cache(maxsize=4)  # several outputs and several clients ask for the same
def tcp_motion(q_rad: Joints, qd_rad_s: Joints, qdd_rad_s2: Joints, links: Links) -> TcpMotion:
    """The tool's motion with joints at these angles, speeds and accelerations."""
    _, change, force = find_flange_motion(q_rad, qd_rad_s, qdd_rad_s2, links, UPRIGHT)
    if not any(qd_rad_s) and not any(qdd_rad_s2):
        return TcpMotion(ZERO, ZERO, force)
    rotation, _ = flange_frame(q_rad, links)

    def in_base(vector: Sequence[float]) -> list[float]:
        return [sum(r * v for r, v in zip(row, vector, strict=True)) for row in rotation]

    linear = [push - rest for push, rest in zip(in_base(force), GRAVITY, strict=True)]
    speed = (*_velocity(q_rad, qd_rad_s, links), *in_base(flange_rate(q_rad, qd_rad_s, links)))
    return TcpMotion(speed, (*linear, *in_base(change)), force)


@lru_cache(maxsize=4)
def elbow(q_rad: Joints, qd_rad_s: Joints, links: Links) -> tuple[Vector, Vector]:
    """Position (m) and velocity (m/s) of the elbow, where the upper arm ends, in the base's axes."""
    _, position = flange_frame(q_rad[:2], links[:2])
    velocity = _velocity(q_rad[:2], qd_rad_s[:2], links[:2])
    return position, velocity


def _velocity(q_rad: Joints, qd_rad_s: Joints, links: Links) -> Vector:
    """The velocity of the origin behind the last link, from the places a moment before and after."""
    before, after = (
        flange_frame([a + sign * v * STEP_S for a, v in zip(q_rad, qd_rad_s, strict=True)], links)[1]
        for sign in (-1, 1)
    )
    x, y, z = ((b - a) / (2.0 * STEP_S) for a, b in zip(before, after, strict=True))
    return x, y, z
