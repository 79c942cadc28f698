"""The laboratory's magnetic field: flux density as a function of place, in the axes of the arm's base."""

from dataclasses import dataclass
from math import cos, radians, sin
from typing import Protocol

from rig.config.world_models import SiteSection
from rig.world.site import Vector, in_base


class MagneticField(Protocol):
    """What is between the walls."""

    def at(self, place_m: Vector) -> Vector:
        """Flux density in tesla at a place in the base frame."""


@dataclass(frozen=True, slots=True)
class UniformField:
    """The same everywhere."""

    flux_density_t: Vector

    def at(self, place_m: Vector) -> Vector:
        """Wherever that is."""
        return self.flux_density_t


def magnetic_field_of(section: SiteSection) -> MagneticField:
    """As the Earth's: of a size, dipping below the horizon, turned from north by the declination."""
    size_t = 1e-6 * section.magnetic_field_ut
    dip, declination = radians(section.magnetic_dip_deg), radians(section.magnetic_declination_deg)
    level_t = size_t * cos(dip)
    return UniformField(
        in_base(section, north=level_t * cos(declination), west=-level_t * sin(declination), up=-size_t * sin(dip))
    )
