"""The transfers between measurements, and the approach to home from any pose. Pure functions."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from rig.motion.steps import POSE_TOLERANCE_RAD, Plan, Step, Transfer, trapezoid_duration, travel
from rig.motion.turner_state import Joints


@dataclass(frozen=True, slots=True)
class Pace:
    """The speed and acceleration of the joint that travels farthest in a motion."""

    speed_rad_s: float
    acceleration_rad_s2: float


def pace_of(speed_deg_s: float, acceleration_deg_s2: float) -> Pace:
    """Return the pace for a speed and an acceleration that a file states in degrees."""
    return Pace(math.radians(speed_deg_s), math.radians(acceleration_deg_s2))


# The first motion is slow, because it may move the large joints from any pose.
FIRST_PACE = pace_of(30, 60)


def approach(start_q_rad: Joints | None, home: Joints, pace: Pace) -> Plan:
    """Return the slow motion home from the turner's pose; empty if the pose is unknown, or is home."""
    start = home if start_q_rad is None else start_q_rad
    speed_rad_s = min(pace.speed_rad_s, FIRST_PACE.speed_rad_s)
    acceleration_rad_s2 = min(pace.acceleration_rad_s2, FIRST_PACE.acceleration_rad_s2)
    steps = tuple(transfer("approach home", start, home, Pace(speed_rad_s, acceleration_rad_s2)))
    return Plan(steps, start_q_rad=start, home_q_rad=home)


def append_steps(plan: Plan, steps: Iterable[Step]) -> Plan:
    """Return the plan with more steps at its end."""
    return replace(plan, steps=(*plan.steps, *steps))


def transfer(name: str, start: Joints, target: Joints, pace: Pace) -> Iterable[Transfer]:
    """Yield the transfer from `start` to `target`; nothing if both are the same pose."""
    distance_rad = max(map(abs, travel(start, target)))
    if distance_rad > POSE_TOLERANCE_RAD:
        speed_rad_s, acceleration_rad_s2 = pace.speed_rad_s, pace.acceleration_rad_s2
        duration_s = trapezoid_duration(distance_rad, speed_rad_s, acceleration_rad_s2)
        yield Transfer(name, start, target, speed_rad_s, acceleration_rad_s2, duration_s)


def convert_to_radians(degrees: Iterable[float]) -> Joints:
    """Return joint angles of a file, in rad."""
    return tuple(math.radians(angle) for angle in degrees)
