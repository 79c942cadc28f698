"""The simulated magnetometer on the flange: its mounting, the field at its position, its errors."""

from collections.abc import Sequence
from math import radians

import numpy as np

from firmware_host.emulator.parts.magnetometer import MagnetometerTruth
from rig.config.sensors.sensor_sections import MountingSection
from rig.config.world.magnetism import SimulatedFieldSection
from rig.world.board.sensor_truth import build_sensor_rotation
from rig.world.magnetic_field import MICROTESLA_T, Frames, MagneticField
from rig.world.site import Vector


class MountedMagnetometer:
    """A magnetometer mounted on the flange; `truth` holds its errors.

    The magnetometer is mounted as `mounting` states and then rotated by the vector `mounting_error_deg`; its position
    from the flange's centre is `offset_mm`.
    """

    def __init__(
        self,
        mounting: MountingSection,
        simulated: SimulatedFieldSection,
        mounting_error_deg: Sequence[float] = (0.0, 0.0, 0.0),
        offset_mm: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        self.truth = MagnetometerTruth(
            scale=simulated.scale,
            bias_t=[MICROTESLA_T * bias for bias in simulated.bias_ut],
            noise_t=MICROTESLA_T * simulated.noise_ut,
            non_orthogonality_rad=[radians(angle) for angle in simulated.non_orthogonality_deg],
        )
        self._item_rotation = np.array(build_sensor_rotation(mounting, mounting_error_deg))
        self._item_position_m = 1e-3 * np.array(offset_mm)
        self.remount(np.eye(3))

    def remount(self, mount: np.ndarray) -> None:
        """Mount the item with the sensor: `mount` (3, 3) transforms the flange's frame to the item's."""
        self._rows: list[list[float]] = (self._item_rotation @ mount).tolist()
        self._offset_m: list[float] = (mount.T @ self._item_position_m).tolist()

    def sense(self, field: MagneticField, frames: Frames, time_s: float) -> Vector:
        """Return the flux density in the sensor's axes, T, with the arm's links at `frames`, the flange last."""
        rotation, (x, y, z) = frames[-1]
        p, q, r = self._offset_m
        a, b, c = (row[0] * p + row[1] * q + row[2] * r for row in rotation)
        x, y, z = field.flux_density_at((x + a, y + b, z + c), frames, time_s)
        a, b, c = (column[0] * x + column[1] * y + column[2] * z for column in zip(*rotation, strict=True))
        u, v, w = (row[0] * a + row[1] * b + row[2] * c for row in self._rows)
        return u, v, w
