"""A vibration of the wrists that nothing is locked to: the same at every speed, and where they stand."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin, sqrt

from rig.world.ur10e.motion.trajectory import Joints

WRISTS = (3, 4, 5)


@dataclass(frozen=True, slots=True)
class Vibration:
    """`rms_rad_s` of each wrist's rate, shared by all lines alike.

    `lines` are their angular frequencies in rad/s, each with the phases of the three wrists in rad.
    """

    rms_rad_s: float
    lines: Sequence[tuple[float, Sequence[float]]]

    def added(
        self, time_s: float, q_rad: Sequence[float], qd_rad_s: Sequence[float], qdd_rad_s2: Sequence[float]
    ) -> tuple[Joints, Joints, Joints]:
        """Angles, speeds and accelerations of joints that vibrate, of such that do not."""
        angles, speeds, accelerations = list(q_rad), list(qd_rad_s), list(qdd_rad_s2)
        for turn, phases_rad in self.lines:
            size = sqrt(2.0 / len(self.lines)) * self.rms_rad_s / turn
            for joint, phase in zip(WRISTS, phases_rad, strict=True):
                swing = size * sin(turn * time_s + phase)
                angles[joint] += swing
                speeds[joint] += turn * size * cos(turn * time_s + phase)
                accelerations[joint] -= turn * turn * swing
        return tuple(angles), tuple(speeds), tuple(accelerations)
