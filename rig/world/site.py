"""Where the laboratory stands: what the base of the arm feels of the Earth, in the base's own axes."""

from dataclasses import dataclass
from math import cos, radians, sin

from rig.config.world.laboratory import SiteSection

EARTH_RATE_RAD_S = 7.292115e-5  # WGS 84: against the stars, not the sun

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Site:
    """`earth_rate_rad_s`: of the ground; `specific_force_m_s2`: of a body at rest, which is gravity turned upwards."""

    earth_rate_rad_s: Vector
    specific_force_m_s2: Vector


def site_of(section: SiteSection) -> Site:
    """The site as its section has it."""
    rate = EARTH_RATE_RAD_S if section.latitude_deg is not None else 0.0
    latitude = radians(section.latitude_deg or 0.0)
    return Site(
        in_base(section, north=rate * cos(latitude), up=rate * sin(latitude)),
        in_base(section, up=section.gravity_m_s2),
    )


def in_base(section: SiteSection, *, north: float = 0.0, west: float = 0.0, up: float = 0.0) -> Vector:
    """A vector turned clockwise by the heading, then tilted about the base's x axis and its new y axis."""
    heading = radians(section.heading_deg)
    about_x, about_y = (radians(angle) for angle in section.base_tilt_deg)
    x, y, z = north * cos(heading) - west * sin(heading), north * sin(heading) + west * cos(heading), up
    y, z = cos(about_x) * y + sin(about_x) * z, cos(about_x) * z - sin(about_x) * y
    x, z = cos(about_y) * x - sin(about_y) * z, cos(about_y) * z + sin(about_y) * x
    return x, y, z
