"""The log of a controller's poses as another program writes it: few rows a second, with a delay that varies."""

from collections.abc import Sequence
from math import cos, hypot, sin
from random import Random

from rig.config.world.arm_clients import SimulatedPoseLogSection
from rig.errors import Refused

HEADER = "start_s,end_s,qw,qx,qy,qz\n"
ROW_S = 0.001  # duration stated in a row
MIN_STEP_S = 2 * ROW_S  # of rows, so that no two have the same time


class PoseLog:
    """The logger, which writes the arm's pose at a fixed rate, by the world's time."""

    def __init__(self, section: SimulatedPoseLogSection, seed: int) -> None:
        """Create the file. Raise Refused `arm_log_file` if it cannot be written."""
        try:
            section.path.write_text(HEADER, encoding="utf-8")
        except OSError as error:
            raise Refused(
                "arm_log_file",
                f"world.arm.log.path {section.path}: {error.strerror}",
                "Name a file that can be written",
            ) from error
        self._section = section
        self._random = Random(f"pose log {seed}")
        self._rows = 0
        self._last_s = float("-inf")

    def is_due(self, time_s: float) -> bool:
        """Return whether a row is due at the world's time `time_s`."""
        return time_s * self._section.rate_hz >= self._rows

    def write(self, time_s: float, pose: Sequence[float]) -> None:
        """Write a row of a pose (6,): position, and rotation vector in rad from the tool's frame to the base's."""
        late_s = 1e-3 * (self._section.latency_ms + self._random.gauss(0.0, self._section.jitter_ms))
        stamp_s = self._last_s = max(time_s + late_s, self._last_s + MIN_STEP_S)
        quaternion = ",".join(f"{component:.9f}" for component in _quaternion(pose[3:]))
        with self._section.path.open("a", encoding="utf-8") as file:
            file.write(f"{stamp_s - ROW_S / 2:.6f},{stamp_s + ROW_S / 2:.6f},{quaternion}\n")
        self._rows = int(time_s * self._section.rate_hz) + 1


def _quaternion(rotation_vector: Sequence[float]) -> tuple[float, ...]:
    """Return the unit quaternion w, x, y, z of a rotation vector (3,), rad."""
    angle = hypot(*rotation_vector)
    factor = sin(angle / 2) / angle if angle else 0.5
    return (cos(angle / 2), *(factor * component for component in rotation_vector))
