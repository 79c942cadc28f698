"""The ways between what is measured, the way home from wherever the arm was left among them. Pure."""

import math
from collections.abc import Iterable

from rig.motion.state import Joints
from rig.motion.steps import SAME_PLACE_RAD, Transfer, trapezoid_duration, travel

# The first motion may swing the large joints from wherever somebody left the arm, so it is made at leisure.
APPROACH_SPEED_RAD_S = math.radians(30)
APPROACH_ACCELERATION_RAD_S2 = math.radians(60)


def approach(start: Joints, home: Joints, speed_rad_s: float, acceleration_rad_s2: float) -> Iterable[Transfer]:
    """The first motion, home, at leisure; none if the arm is there."""
    leisure = min(speed_rad_s, APPROACH_SPEED_RAD_S), min(acceleration_rad_s2, APPROACH_ACCELERATION_RAD_S2)
    return transfer("approach home", start, home, *leisure)


def transfer(
    name: str, start: Joints, target: Joints, speed_rad_s: float, acceleration_rad_s2: float
) -> Iterable[Transfer]:
    """The way from `start` to `target`; none if they are the same place."""
    distance_rad = max(map(abs, travel(start, target)))
    if distance_rad > SAME_PLACE_RAD:
        duration_s = trapezoid_duration(distance_rad, speed_rad_s, acceleration_rad_s2)
        yield Transfer(name, start, target, speed_rad_s, acceleration_rad_s2, duration_s)


def in_radians(degrees: Iterable[float]) -> Joints:
    """Joint angles as a file gives them, in rad."""
    return tuple(math.radians(angle) for angle in degrees)
