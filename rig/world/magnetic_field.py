"""The laboratory's magnetic field: flux density as a function of place and time, in the axes of the arm's base.

What the Earth and the room make of it is smooth: uniform, a gradient that no current within the room causes (∇·B = 0
and ∇×B = 0, so five numbers), and a steady drift. The arm's iron is dipoles that go with the links they are fixed to.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, radians, sin, sqrt

from rig.config.world.laboratory import SiteSection
from rig.config.world.magnetism import IronSection
from rig.world.site import Vector, in_base
from rig.world.ur10e.motion.forward_kinematics import Rotation, turned
from rig.world.ur10e.motion.links import LINKS

MU_0_OVER_4_PI = 1e-7  # T m/A
MICROTESLA_T = 1e-6

Frames = Sequence[tuple[Rotation, Vector]]  # rotation and place of the base, then of what each joint carries


@dataclass(frozen=True, slots=True)
class Room:
    """Flux density at the base's origin as the world begins, its gradient (rows, T/m) and its change in time (T/s)."""

    flux_density_t: Vector
    gradient_t_m: Rotation = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    drift_t_s: Vector = (0.0, 0.0, 0.0)

    def at(self, place_m: Vector, time_s: float) -> Vector:
        """Flux density in tesla."""
        x, y, z = place_m
        found = (
            field + row[0] * x + row[1] * y + row[2] * z + drift * time_s
            for field, row, drift in zip(self.flux_density_t, self.gradient_t_m, self.drift_t_s, strict=True)
        )
        return next(found), next(found), next(found)


@dataclass(frozen=True, slots=True)
class Dipole:
    """A moment (A m²) at a place (m) of what joint number `carried_by` carries, in its frame; 0 is the base."""

    carried_by: int
    place_m: Vector
    moment_a_m2: Vector

    def at(self, place_m: Vector, frames: Frames) -> Vector:
        """The iron's flux density in tesla at a place in the base frame; inside it that at its surface, 1 mm off."""
        rotation, origin = frames[self.carried_by]
        source, moment = turned(rotation, self.place_m), turned(rotation, self.moment_a_m2)
        x, y, z = (here - from_base - there for here, from_base, there in zip(place_m, origin, source, strict=True))
        distance = max(sqrt(x * x + y * y + z * z), 1e-3)
        u, v, w = moment
        along = 3.0 * (u * x + v * y + w * z) / distance**5
        across = 1.0 / distance**3
        return (
            MU_0_OVER_4_PI * (along * x - across * u),
            MU_0_OVER_4_PI * (along * y - across * v),
            MU_0_OVER_4_PI * (along * z - across * w),
        )


@dataclass(frozen=True, slots=True)
class MagneticField:
    """What there is between the walls, the arm in it."""

    room: Room
    iron: tuple[Dipole, ...] = ()

    def at(self, place_m: Vector, frames: Frames, time_s: float) -> Vector:
        """Flux density in tesla at a place in the base frame, with the arm as its `frames` say."""
        x, y, z = self.room.at(place_m, time_s)
        for dipole in self.iron:
            u, v, w = dipole.at(place_m, frames)
            x, y, z = x + u, y + v, z + w
        return x, y, z


def magnetic_field_of(section: SiteSection, iron: Sequence[IronSection] = ()) -> MagneticField:
    """The Earth's of a size, dipping below the horizon, turned from north by the declination; the room's; the arm's."""
    size_t = MICROTESLA_T * section.magnetic_field_ut
    dip, declination = radians(section.magnetic_dip_deg), radians(section.magnetic_declination_deg)
    level_t = size_t * cos(dip)
    xx, xy, xz, yy, yz = (MICROTESLA_T * each for each in section.magnetic_gradient_ut_m)
    a, b, c = (MICROTESLA_T * each / 60.0 for each in section.magnetic_drift_ut_min)
    room = Room(
        in_base(section, north=level_t * cos(declination), west=-level_t * sin(declination), up=-size_t * sin(dip)),
        ((xx, xy, xz), (xy, yy, yz), (xz, yz, -xx - yy)),
        (a, b, c),
    )
    return MagneticField(room, tuple(map(_dipole, iron)))


def _dipole(section: IronSection) -> Dipole:
    x, y, z = (1e-3 * each for each in section.position_mm)
    return Dipole(LINKS.index(section.carried_by), (x, y, z), section.moment_a_m2)
