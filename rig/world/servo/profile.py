"""The servo's profile generator: from where it is, and as fast as it goes, to a goal; pieces of constant acceleration.

Source: ROBOTIS e-Manual, "What is the Profile" (profile_description.md). Velocity-based: a trapezoid, or a triangle,
of a greatest speed and an acceleration. Time-based: the whole move takes t3 and each of its ramps t1. A goal that comes
while it moves is taken up from the speed it has, without a stop in between.
"""

from math import copysign, sqrt
from typing import NamedTuple


class Piece(NamedTuple):
    """An angle from `start_s` to `end_s`: `angle_rad` and `rate_rad_s` are those at its start."""

    start_s: float
    end_s: float
    angle_rad: float
    rate_rad_s: float
    acceleration_rad_s2: float = 0.0

    def angle_at(self, time_s: float) -> float:
        """The angle at a time of the piece, rad."""
        since_s = time_s - self.start_s
        return self.angle_rad + (self.rate_rad_s + 0.5 * self.acceleration_rad_s2 * since_s) * since_s

    def rate_at(self, time_s: float) -> float:
        """The rate at a time of the piece, rad/s."""
        return self.rate_rad_s + self.acceleration_rad_s2 * (time_s - self.start_s)


class Start(NamedTuple):
    """Where a profile begins."""

    time_s: float
    angle_rad: float
    rate_rad_s: float


def timed(start: Start, goal_rad: float, total_s: float, ramp_s: float, most_rad_s: float) -> list[Piece]:
    """A move of `total_s` with ramps of `ramp_s`; a longer one where it would have to be faster than `most_rad_s`."""
    way_rad = goal_rad - start.angle_rad
    ramp_s = min(ramp_s, total_s / 2)
    cruise_rad_s = (way_rad - start.rate_rad_s * ramp_s / 2) / (total_s - ramp_s)
    if abs(cruise_rad_s) > most_rad_s:
        cruise_rad_s = copysign(most_rad_s, cruise_rad_s)
        total_s = (way_rad - start.rate_rad_s * ramp_s / 2) / cruise_rad_s + ramp_s
    return _trapezoid(start, cruise_rad_s, ramp_s, total_s - 2 * ramp_s, ramp_s)


def limited(start: Start, goal_rad: float, speed_rad_s: float, acceleration_rad_s2: float) -> list[Piece]:
    """A move no faster than `speed_rad_s`, with ramps of `acceleration_rad_s2`."""
    v0, a = start.rate_rad_s, acceleration_rad_s2
    way_rad = goal_rad - start.angle_rad
    sign = copysign(1.0, way_rad - v0 * abs(v0) / (2 * a))  # of the way that is left when it has braked
    peak_rad_s = sign * min(speed_rad_s, sqrt(max(0.0, a * sign * way_rad + v0 * v0 / 2)))
    up_s, down_s = abs(peak_rad_s - v0) / a, abs(peak_rad_s) / a
    left_rad = way_rad - (v0 + peak_rad_s) / 2 * up_s - peak_rad_s / 2 * down_s
    cruise_s = left_rad / peak_rad_s if peak_rad_s else 0.0
    return _trapezoid(start, peak_rad_s, up_s, max(0.0, cruise_s), down_s)


def _trapezoid(start: Start, cruise_rad_s: float, up_s: float, cruise_s: float, down_s: float) -> list[Piece]:
    """The pieces, each with a rate of one sign, so that whoever follows knows where the way is reversed."""
    pieces: list[Piece] = []
    time_s, angle_rad, rate_rad_s = start
    for lasts_s, end_rad_s in ((up_s, cruise_rad_s), (cruise_s, cruise_rad_s), (down_s, 0.0)):
        if lasts_s <= 0.0:
            rate_rad_s = end_rad_s  # at once
            continue
        acceleration = (end_rad_s - rate_rad_s) / lasts_s
        ends = [time_s + lasts_s]
        if rate_rad_s * end_rad_s < 0.0:
            ends.insert(0, time_s - rate_rad_s / acceleration)
        for end_s in ends:
            piece = Piece(time_s, end_s, angle_rad, rate_rad_s, acceleration)
            pieces.append(piece)
            time_s, angle_rad, rate_rad_s = end_s, piece.angle_at(end_s), piece.rate_at(end_s)
        rate_rad_s = end_rad_s
    return pieces
