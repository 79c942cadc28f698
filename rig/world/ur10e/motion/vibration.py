"""A vibration of the wrists that is not locked to any angle: the same at every speed and at rest."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin, sqrt

from rig.world.ur10e.motion.trajectory import Joints

WRISTS = (3, 4, 5)


@dataclass(frozen=True, slots=True)
class Vibration:
    """A vibration of each wrist. Its rate has the RMS `rms_rad_s`, to which all tones contribute equally.

    `tones`: angular frequencies in rad/s, each with the phases of the three wrists in rad.
    """

    rms_rad_s: float
    tones: Sequence[tuple[float, Sequence[float]]]

    def add(
        self, time_s: float, q_rad: Sequence[float], qd_rad_s: Sequence[float], qdd_rad_s2: Sequence[float]
    ) -> tuple[Joints, Joints, Joints]:
        """Return angles, speeds and accelerations of the joints with the vibration added."""
        angles, speeds, accelerations = list(q_rad), list(qd_rad_s), list(qdd_rad_s2)
        for frequency_rad_s, phases_rad in self.tones:
            amplitude_rad = sqrt(2.0 / len(self.tones)) * self.rms_rad_s / frequency_rad_s
            for joint, phase in zip(WRISTS, phases_rad, strict=True):
                offset_rad = amplitude_rad * sin(frequency_rad_s * time_s + phase)
                angles[joint] += offset_rad
                speeds[joint] += frequency_rad_s * amplitude_rad * cos(frequency_rad_s * time_s + phase)
                accelerations[joint] -= frequency_rad_s * frequency_rad_s * offset_rad
        return tuple(angles), tuple(speeds), tuple(accelerations)
