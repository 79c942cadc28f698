"""A vibration of the wrists that nothing is locked to: the same at every speed, and where they stand."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin, sqrt

from rig.world.ur10e.trajectory import Joints

WRISTS = (3, 4, 5)


@dataclass(frozen=True, slots=True)
class Vibration:
    """`rms_rad_s` of each wrist's rate, `turn_rad_s` its angular frequency, `phases_rad` those of the three wrists."""

    rms_rad_s: float
    turn_rad_s: float
    phases_rad: Sequence[float]

    def added(
        self, time_s: float, q_rad: Sequence[float], qd_rad_s: Sequence[float], qdd_rad_s2: Sequence[float]
    ) -> tuple[Joints, Joints, Joints]:
        """Angles, speeds and accelerations of joints that vibrate, of such that do not."""
        angles, speeds, accelerations = list(q_rad), list(qd_rad_s), list(qdd_rad_s2)
        turn, size = self.turn_rad_s, sqrt(2.0) * self.rms_rad_s / self.turn_rad_s
        for joint, phase in zip(WRISTS, self.phases_rad, strict=True):
            swing = size * sin(turn * time_s + phase)
            angles[joint] += swing
            speeds[joint] += turn * size * cos(turn * time_s + phase)
            accelerations[joint] -= turn * turn * swing
        return tuple(angles), tuple(speeds), tuple(accelerations)
