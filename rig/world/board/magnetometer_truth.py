"""How a simulated magnetometer sits on the flange, what it feels there, and what is wrong with it."""

from math import radians

from firmware_host.emulator.magnetometer import MagnetometerTruth
from rig.config.sensor_sections import MagnetometerSection
from rig.config.world_models import SimulatedMagnetometerSection
from rig.world.board.sensor_truth import mounted_rows
from rig.world.magnetic_field import MagneticField
from rig.world.site import Vector
from rig.world.ur10e.forward_kinematics import Rotation

MICROTESLA_T = 1e-6


class MountedMagnetometer:
    """One of them; `truth` are its errors."""

    def __init__(self, section: MagnetometerSection, simulated: SimulatedMagnetometerSection) -> None:
        self.truth = MagnetometerTruth(
            scale=simulated.scale,
            bias_t=[MICROTESLA_T * bias for bias in simulated.bias_ut],
            noise_t=MICROTESLA_T * simulated.noise_ut,
            non_orthogonality_rad=[radians(angle) for angle in simulated.non_orthogonality_deg],
        )
        self._rows = mounted_rows(section.mounting, simulated.mounting_error_deg)

    def feels(self, field: MagneticField, flange: tuple[Rotation, Vector]) -> Vector:
        """The field in its own axes, T, where the flange has that rotation and place; it sits in its centre."""
        rotation, place_m = flange
        x, y, z = field.at(place_m)
        a, b, c = (column[0] * x + column[1] * y + column[2] * z for column in zip(*rotation, strict=True))
        u, v, w = (row[0] * a + row[1] * b + row[2] * c for row in self._rows)
        return u, v, w
