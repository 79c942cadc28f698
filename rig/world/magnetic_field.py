"""The simulated magnetic field: flux density as a function of position and time, in the axes of the arm's base.

The field of the Earth and the room is smooth. It is the sum of a uniform field, a gradient without currents in the room
(∇·B = 0 and ∇×B = 0, so five numbers determine it), and a steady drift. The arm's iron is modelled as dipoles fixed to
its links.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, radians, sin, sqrt

from rig.config.world.laboratory import WorldSiteSection
from rig.config.world.magnetism import IronSection
from rig.world.site import Vector, rotate_into_base
from rig.world.ur10e.motion.forward_kinematics import Rotation, rotate
from rig.world.ur10e.motion.links import LINKS

MU_0_OVER_4_PI = 1e-7  # T m/A
MICROTESLA_T = 1e-6

Frames = Sequence[tuple[Rotation, Vector]]  # rotation and position (m) of the base, then of each joint's link


@dataclass(frozen=True, slots=True)
class Room:
    """The field of the room: flux density at the base's origin when the world begins, its gradient, its steady drift.

    Row i of `gradient_t_m` is the gradient of component i of the flux density.
    """

    flux_density_t: Vector
    gradient_t_m: Rotation = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    drift_t_s: Vector = (0.0, 0.0, 0.0)

    def flux_density_at(self, position_m: Vector, time_s: float) -> Vector:
        """Return the flux density, T, at a position in the base frame, m, and a time, s."""
        x, y, z = position_m
        components = (
            field + row[0] * x + row[1] * y + row[2] * z + drift * time_s
            for field, row, drift in zip(self.flux_density_t, self.gradient_t_m, self.drift_t_s, strict=True)
        )
        return next(components), next(components), next(components)


@dataclass(frozen=True, slots=True)
class Dipole:
    """A magnetic moment (A m²) at a position (m) in the frame of the link of joint `carried_by`; 0 is the base."""

    carried_by: int
    position_m: Vector
    moment_a_m2: Vector

    def flux_density_at(self, position_m: Vector, frames: Frames) -> Vector:
        """Return the iron's flux density, T, at a position in the base frame, m; distances below 1 mm count as 1 mm."""
        rotation, origin = frames[self.carried_by]
        source, moment = rotate(rotation, self.position_m), rotate(rotation, self.moment_a_m2)
        x, y, z = (target - base - offset for target, base, offset in zip(position_m, origin, source, strict=True))
        distance = max(sqrt(x * x + y * y + z * z), 1e-3)
        u, v, w = moment
        # B = μ₀/4π (3 (m · r) r / r⁵ − m / r³)
        parallel = 3.0 * (u * x + v * y + w * z) / distance**5
        across = 1.0 / distance**3
        return (
            MU_0_OVER_4_PI * (parallel * x - across * u),
            MU_0_OVER_4_PI * (parallel * y - across * v),
            MU_0_OVER_4_PI * (parallel * z - across * w),
        )


@dataclass(frozen=True, slots=True)
class MagneticField:
    """The field of the room and of the arm's iron."""

    room: Room
    iron: tuple[Dipole, ...] = ()

    def flux_density_at(self, position_m: Vector, frames: Frames, time_s: float) -> Vector:
        """Return the flux density, T, at a position in the base frame, m, with the arm's links at `frames`."""
        x, y, z = self.room.flux_density_at(position_m, time_s)
        for dipole in self.iron:
            u, v, w = dipole.flux_density_at(position_m, frames)
            x, y, z = x + u, y + v, z + w
        return x, y, z


def build_magnetic_field(section: WorldSiteSection, iron: Sequence[IronSection] = ()) -> MagneticField:
    """Return the field of the Earth (magnitude, dip, declination), of the room and of the arm's iron."""
    size_t = MICROTESLA_T * section.magnetic_field_ut
    dip, declination = radians(section.magnetic_dip_deg), radians(section.magnetic_declination_deg)
    north_t, west_t = size_t * cos(dip) * cos(declination), -(size_t * cos(dip)) * sin(declination)
    xx, xy, xz, yy, yz = (MICROTESLA_T * gradient for gradient in section.magnetic_gradient_ut_m)
    a, b, c = (MICROTESLA_T * drift / 60.0 for drift in section.magnetic_drift_ut_min)
    room = Room(
        rotate_into_base(section, north=north_t, west=west_t, up=-size_t * sin(dip)),
        ((xx, xy, xz), (xy, yy, yz), (xz, yz, -xx - yy)),
        (a, b, c),
    )
    return MagneticField(room, tuple(map(_build_dipole, iron)))


def _build_dipole(section: IronSection) -> Dipole:
    x, y, z = (1e-3 * coordinate for coordinate in section.position_mm)
    return Dipole(LINKS.index(section.carried_by), (x, y, z), section.moment_a_m2)
