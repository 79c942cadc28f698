"""A board's orientation in its vehicle, by its number in MAVLink, MAV_SENSOR_ORIENTATION. Pure."""

from functools import cache

import numpy as np

from rig.estimation.arrays import Array

# Roll, pitch, yaw in degrees of the orientations with right angles, by the numbers of MAV_SENSOR_ORIENTATION, which
# ArduPilot (AP_Math/rotations.h) and PX4 (lib/conversion/rotation.h) share.
RIGHT_ANGLES = {
    0: (0, 0, 0), 2: (0, 0, 90), 4: (0, 0, 180), 6: (0, 0, 270), 8: (180, 0, 0), 10: (180, 0, 90), 12: (0, 180, 0),
    14: (180, 0, 270), 16: (90, 0, 0), 18: (90, 0, 90), 20: (270, 0, 0), 22: (270, 0, 90), 24: (0, 90, 0),
    25: (0, 270, 0), 26: (0, 180, 90), 27: (0, 180, 270), 28: (90, 90, 0), 29: (180, 90, 0), 30: (270, 90, 0),
    31: (90, 180, 0), 32: (270, 180, 0), 33: (90, 270, 0), 34: (180, 270, 0), 35: (270, 270, 0), 36: (90, 180, 90),
    37: (90, 0, 270),
}  # fmt: skip


@cache
def board_rotation(number: float) -> Array | None:
    """Return the rotation (3, 3) from the board's axes to the vehicle's, for the orientation with this number.

    Return None if the orientation does not consist of right angles.
    """
    angles = RIGHT_ANGLES.get(int(number)) if number == int(number) else None
    if angles is None:
        return None
    roll, pitch, yaw = np.radians(angles)
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(angle_rad), np.sin(angle_rad)) for angle_rad in (roll, pitch, yaw))
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    matrix: Array = np.rint(about_z @ about_y @ about_x)
    return matrix
