"""What a body on the flange feels: rate, its change, and specific force, carried outwards joint by joint.

Luh, Walker, Paul, On-line computational scheme for mechanical manipulators, 1980, the outward half, for Denavit and
Hartenberg's standard frames. The base brings the Earth's rate and the push that holds it up, so that gravity, Earth
rate and Coriolis come of themselves. A component may be a float or an array of shape (n,), all alike.
"""

from collections.abc import Sequence
from math import cos, sin
from typing import Any, NamedTuple

from rig.world.site import SiteTruth
from rig.world.ur10e.motion.links import ArmLink, Links

Components = tuple[Any, Any, Any]  # x, y, z: floats, or arrays of one shape


class InertialMotion(NamedTuple):
    """What the flange feels at its origin, in its axes: rate (rad/s) and its change (rad/s²) against the stars, force
    (m/s²)."""

    rate_rad_s: Components
    change_rad_s2: Components
    force_m_s2: Components


def find_flange_motion(
    q_rad: Sequence[float], qd_rad_s: Sequence[float], qdd_rad_s2: Sequence[float], links: Links, site: SiteTruth
) -> InertialMotion:
    """What the flange feels at one instant, from angles, speeds and accelerations of the six joints."""
    return find_motion_from_cosines(find_cosines(q_rad, links), qd_rad_s, qdd_rad_s2, links, site)


def find_cosines(q_rad: Sequence[float], links: Sequence[ArmLink]) -> list[tuple[float, float]]:
    """Cosine and sine of each joint's whole angle."""
    turned = [angle + link.theta_rad for angle, link in zip(q_rad, links, strict=True)]
    return [(cos(angle), sin(angle)) for angle in turned]


def find_motion_from_cosines(
    turns: Sequence[tuple[Any, Any]], qd_rad_s: Sequence[Any], qdd_rad_s2: Sequence[Any], links: Links, site: SiteTruth
) -> InertialMotion:
    """What the flange feels, from cosine and sine of each joint's whole angle, its `theta_rad` included."""
    return propagate_motion(find_base_motion(site), turns, qd_rad_s, qdd_rad_s2, links)


def find_base_motion(site: SiteTruth) -> InertialMotion:
    """What the arm's base feels."""
    return InertialMotion(site.earth_rate_rad_s, (0.0, 0.0, 0.0), site.specific_force_m_s2)


def propagate_motion(
    inner: InertialMotion,
    turns: Sequence[tuple[Any, Any]],
    qd_rad_s: Sequence[Any],
    qdd_rad_s2: Sequence[Any],
    links: Sequence[ArmLink],
) -> InertialMotion:
    """What the last of these links feels, when the one before the first feels `inner`."""
    (x, y, z), (u, v, w), (f, g, h) = inner
    for (cosine, sine), speed, acceleration, link in zip(turns, qd_rad_s, qdd_rad_s2, links, strict=True):
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
    return InertialMotion((x, y, z), (u, v, w), (f, g, h))


def transfer_force(rate: Components, change: Components, force: Components, way_m: Sequence[float]) -> Components:
    """Specific force at another point of the same body, `way_m` away, all in the body's axes."""
    x, y, z = rate
    u, v, w = change
    a, b, c = way_m
    along = a * x + b * y + c * z
    square = x * x + y * y + z * z
    return (
        force[0] + v * c - w * b + along * x - square * a,
        force[1] + w * a - u * c + along * y - square * b,
        force[2] + u * b - v * a + along * z - square * c,
    )
