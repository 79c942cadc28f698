"""The simulated laboratory's location: Earth rate and specific force at rest, in the axes of the arm's base."""

from dataclasses import dataclass
from math import cos, radians, sin

from rig.config.world.laboratory import WorldSiteSection

EARTH_RATE_RAD_S = 7.292115e-5  # WGS 84; sidereal

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class SiteTruth:
    """The ground's angular rate (rad/s), and the specific force of a body at rest (m/s²), which is minus gravity."""

    earth_rate_rad_s: Vector
    specific_force_m_s2: Vector


def build_site(section: WorldSiteSection) -> SiteTruth:
    """Return the site that a section describes."""
    rate = EARTH_RATE_RAD_S if section.latitude_deg is not None else 0.0
    latitude = radians(section.latitude_deg or 0.0)
    return SiteTruth(
        rotate_into_base(section, north=rate * cos(latitude), up=rate * sin(latitude)),
        rotate_into_base(section, up=section.gravity_m_s2),
    )


def rotate_into_base(section: WorldSiteSection, *, north: float = 0.0, west: float = 0.0, up: float = 0.0) -> Vector:
    """Return the vector with components `north`, `west` and `up` in the axes of the arm's base.

    The base has a heading, clockwise from north, and is tilted about x, then about the new y axis.
    """
    heading = radians(section.heading_deg)
    about_x, about_y = (radians(angle) for angle in section.base_tilt_deg)
    x, y, z = north * cos(heading) - west * sin(heading), north * sin(heading) + west * cos(heading), up
    y, z = cos(about_x) * y + sin(about_x) * z, cos(about_x) * z - sin(about_x) * y
    x, z = cos(about_y) * x - sin(about_y) * z, cos(about_y) * z + sin(about_y) * x
    return x, y, z
