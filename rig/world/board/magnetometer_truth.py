"""How a simulated magnetometer sits on the flange, what it feels there, and what is wrong with it."""

from collections.abc import Sequence
from math import radians

import numpy as np

from firmware_host.emulator.parts.magnetometer import MagnetometerTruth
from rig.config.sensors.sensor_sections import MountingSection
from rig.config.world.magnetism import SimulatedFieldSection
from rig.world.board.sensor_truth import mounted_rows
from rig.world.magnetic_field import MICROTESLA_T, Frames, MagneticField
from rig.world.site import Vector


class MountedMagnetometer:
    """A magnetometer mounted on the flange; `truth` are its errors.

    It sits as `mounting` says, off by the rotation vector `mounting_error_deg`, `offset_mm` from the flange's centre.
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
        self._sits = np.array(mounted_rows(mounting, mounting_error_deg))
        self._place_m = 1e-3 * np.array(offset_mm)
        self.mount_anew(np.eye(3))

    def mount_anew(self, mount: np.ndarray) -> None:
        """Mount the item it sits on: `mount` (3, 3) takes the flange's frame into the item's."""
        self._rows: list[list[float]] = (self._sits @ mount).tolist()
        self._offset_m: list[float] = (mount.T @ self._place_m).tolist()

    def feels(self, field: MagneticField, frames: Frames, time_s: float) -> Vector:
        """The field in its own axes, T, with the arm as its `frames` say, the flange's last."""
        rotation, (x, y, z) = frames[-1]
        p, q, r = self._offset_m
        a, b, c = (row[0] * p + row[1] * q + row[2] * r for row in rotation)
        x, y, z = field.at((x + a, y + b, z + c), frames, time_s)
        a, b, c = (column[0] * x + column[1] * y + column[2] * z for column in zip(*rotation, strict=True))
        u, v, w = (row[0] * a + row[1] * b + row[2] * c for row in self._rows)
        return u, v, w
