"""Inertial motion of a body on the flange: angular rate, its derivative and specific force, propagated joint by joint.

Luh, Walker, Paul, On-line computational scheme for mechanical manipulators, 1980, the outward recursion, for standard
Denavit–Hartenberg frames. The recursion begins with the base, which has the Earth's rate and the reaction to gravity,
so the results include gravity, Earth rate and Coriolis terms. A component may be a float or an array of shape (n,), the
same for all components.
"""

from collections.abc import Sequence
from math import cos, sin
from typing import Any, NamedTuple

from rig.world.site import SiteTruth
from rig.world.ur10e.motion.links import ArmLink, Links

Components = tuple[Any, Any, Any]  # x, y, z: floats, or arrays of one shape
CosineAndSine = Sequence[tuple[Any, Any]]  # of every joint: cosine and sine of its angle


class BodyMotion(NamedTuple):
    """A body's angular rate (rad/s), the rate's derivative (rad/s²) and the specific force (m/s²), in the body's axes.

    The rate is relative to inertial space.
    """

    rate_rad_s: Components
    change_rad_s2: Components
    force_m_s2: Components


def find_flange_motion(
    q_rad: Sequence[float], qd_rad_s: Sequence[float], qdd_rad_s2: Sequence[float], links: Links, site: SiteTruth
) -> BodyMotion:
    """Return the flange's motion for angles, speeds and accelerations of the six joints."""
    return find_motion(find_cosines(q_rad, links), qd_rad_s, qdd_rad_s2, links, site)


def find_cosines(q_rad: Sequence[float], links: Sequence[ArmLink]) -> list[tuple[float, float]]:
    """Return cosine and sine of each joint's Denavit–Hartenberg angle."""
    angles = [angle + link.theta_rad for angle, link in zip(q_rad, links, strict=True)]
    return [(cos(angle), sin(angle)) for angle in angles]


def find_motion(
    cosines: CosineAndSine, qd_rad_s: Sequence[Any], qdd_rad_s2: Sequence[Any], links: Links, site: SiteTruth
) -> BodyMotion:
    """Return the flange's motion; `cosines`: cosine and sine of each joint's Denavit–Hartenberg angle."""
    return propagate(find_base_motion(site), cosines, qd_rad_s, qdd_rad_s2, links)


def find_base_motion(site: SiteTruth) -> BodyMotion:
    """Return the motion of the arm's base."""
    return BodyMotion(site.earth_rate_rad_s, (0.0, 0.0, 0.0), site.specific_force_m_s2)


def propagate(
    inner: BodyMotion,
    cosines: CosineAndSine,
    qd_rad_s: Sequence[Any],
    qdd_rad_s2: Sequence[Any],
    links: Sequence[ArmLink],
) -> BodyMotion:
    """Return the motion of the last of `links`, if the body before the first has the motion `inner`."""
    # Rate, its derivative and the specific force, in the axes of the link that has been reached so far.
    (x, y, z), (u, v, w), (f, g, h) = inner
    for (cosine, sine), speed, acceleration, link in zip(cosines, qd_rad_s, qdd_rad_s2, links, strict=True):
        u, v, w = u + y * speed, v - x * speed, w + acceleration
        z = z + speed
        x, y = cosine * x + sine * y, cosine * y - sine * x
        u, v = cosine * u + sine * v, cosine * v - sine * u
        f, g = cosine * f + sine * g, cosine * g - sine * f
        c, s = link.cos_alpha, link.sin_alpha
        y, z = c * y + s * z, c * z - s * y
        v, w = c * v + s * w, c * w - s * v
        g, h = c * g + s * h, c * h - s * g
        f, g, h = transfer_force((x, y, z), (u, v, w), (f, g, h), (link.a_m, link.d_m * s, link.d_m * c))
    return BodyMotion((x, y, z), (u, v, w), (f, g, h))


def transfer_force(rate: Components, change: Components, force: Components, lever_arm_m: Sequence[float]) -> Components:
    """Return the specific force at a point of the body that is `lever_arm_m` from the point with the force `force`.

    `rate` is the body's angular rate and `change` its angular acceleration. All vectors are in the body's axes.
    """
    x, y, z = rate
    u, v, w = change
    a, b, c = lever_arm_m
    # f + dω/dt × r + ω × (ω × r)
    projection = a * x + b * y + c * z
    square = x * x + y * y + z * z
    return (
        force[0] + v * c - w * b + projection * x - square * a,
        force[1] + w * a - u * c + projection * y - square * b,
        force[2] + u * b - v * a + projection * z - square * c,
    )
