"""The servo's profile generator: from the present angle and rate to a goal, in segments of constant acceleration.

Source: ROBOTIS e-Manual, "What is the Profile" (profile_description.md). A velocity-based profile is a trapezoid, or a
triangle, limited in speed and acceleration. In a time-based profile the register Profile Velocity has the duration of
the whole move, and Profile Acceleration that of each ramp. A goal that comes during a move is approached from the
present speed, without a stop.
"""

from math import copysign, sqrt
from typing import NamedTuple


class ProfileSegment(NamedTuple):
    """A segment of constant acceleration. `angle_rad` and `rate_rad_s` are those at `start_s`."""

    start_s: float
    end_s: float
    angle_rad: float
    rate_rad_s: float
    acceleration_rad_s2: float = 0.0

    def angle_at(self, time_s: float) -> float:
        """Return the angle at a time within the segment, rad."""
        elapsed_s = time_s - self.start_s
        return self.angle_rad + (self.rate_rad_s + 0.5 * self.acceleration_rad_s2 * elapsed_s) * elapsed_s

    def rate_at(self, time_s: float) -> float:
        """Return the rate at a time within the segment, rad/s."""
        return self.rate_rad_s + self.acceleration_rad_s2 * (time_s - self.start_s)


Profile = list[ProfileSegment]


class ProfileStart(NamedTuple):
    """The state in which a profile begins."""

    time_s: float
    angle_rad: float
    rate_rad_s: float


def plan_timed(start: ProfileStart, goal_rad: float, total_s: float, ramp_s: float, limit_rad_s: float) -> Profile:
    """Return a move of `total_s` with ramps of `ramp_s`; a move that would exceed `limit_rad_s` takes longer."""
    distance_rad = goal_rad - start.angle_rad
    ramp_s = min(ramp_s, total_s / 2)
    cruise_rad_s = (distance_rad - start.rate_rad_s * ramp_s / 2) / (total_s - ramp_s)
    if abs(cruise_rad_s) > limit_rad_s:
        cruise_rad_s = copysign(limit_rad_s, cruise_rad_s)
        total_s = (distance_rad - start.rate_rad_s * ramp_s / 2) / cruise_rad_s + ramp_s
    return _build_trapezoid(start, cruise_rad_s, ramp_s, total_s - 2 * ramp_s, ramp_s)


def plan_limited(start: ProfileStart, goal_rad: float, speed_rad_s: float, acceleration_rad_s2: float) -> Profile:
    """Return a move of at most `speed_rad_s`, with ramps of `acceleration_rad_s2`."""
    v0, a = start.rate_rad_s, acceleration_rad_s2
    distance_rad = goal_rad - start.angle_rad
    sign = copysign(1.0, distance_rad - v0 * abs(v0) / (2 * a))  # sign of the distance from its stopping point
    peak_rad_s = sign * min(speed_rad_s, sqrt(max(0.0, a * sign * distance_rad + v0 * v0 / 2)))
    up_s, down_s = abs(peak_rad_s - v0) / a, abs(peak_rad_s) / a
    remaining_rad = distance_rad - (v0 + peak_rad_s) / 2 * up_s - peak_rad_s / 2 * down_s
    cruise_s = remaining_rad / peak_rad_s if peak_rad_s else 0.0
    return _build_trapezoid(start, peak_rad_s, up_s, max(0.0, cruise_s), down_s)


def _build_trapezoid(start: ProfileStart, cruise_rad_s: float, up_s: float, cruise_s: float, down_s: float) -> Profile:
    """Return the segments, split where the rate changes sign, so that the gear's play can be followed."""
    segments: list[ProfileSegment] = []
    time_s, angle_rad, rate_rad_s = start
    for duration_s, end_rad_s in ((up_s, cruise_rad_s), (cruise_s, cruise_rad_s), (down_s, 0.0)):
        if duration_s <= 0.0:
            rate_rad_s = end_rad_s  # at once
            continue
        acceleration = (end_rad_s - rate_rad_s) / duration_s
        end_times_s = [time_s + duration_s]
        if rate_rad_s * end_rad_s < 0.0:
            end_times_s.insert(0, time_s - rate_rad_s / acceleration)
        for end_s in end_times_s:
            segment = ProfileSegment(time_s, end_s, angle_rad, rate_rad_s, acceleration)
            segments.append(segment)
            time_s, angle_rad, rate_rad_s = end_s, segment.angle_at(end_s), segment.rate_at(end_s)
        rate_rad_s = end_rad_s
    return segments
