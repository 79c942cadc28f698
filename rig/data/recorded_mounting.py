"""How a sensor is mounted, from a configuration into a recording."""

from rig.config.sensor_sections import MountingSection, mounting_matrix
from rig.data.recorded_sensor import Mounting


def recorded_mounting(section: MountingSection) -> Mounting:
    """The mounting that a configuration states, as it is recorded."""
    return tuple(tuple(row) for row in mounting_matrix(section).tolist())
