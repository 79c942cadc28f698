"""The shaft of the simulated servo: the profile as modified by gear, encoder and load."""

from bisect import bisect_right
from collections.abc import Sequence
from math import copysign, cos, pi, radians, sin

from rig.world.servo.profile import ProfileSegment, ProfileStart
from rig.world.servo.truth import ServoTruth

KEPT_SEGMENTS = 4096
ITERATIONS = 12  # enough to invert the encoder's error to 1e-15 of a revolution


class Shaft:
    """The shaft's angle and rate at any time, past and planned; a counterclockwise turn, seen on the horn, is positive.

    The servo controls the angle that its encoder reads. So the readings follow the planned angle, and the true angle
    contains the encoder's error: if the readings advance evenly, the shaft turns unevenly.
    """

    def __init__(self, truth: ServoTruth, time_s: float) -> None:
        self._once, self._once_phase = radians(truth.encoder_once_deg), radians(truth.encoder_once_phase_deg)
        self._twice, self._twice_phase = radians(truth.encoder_twice_deg), radians(truth.encoder_twice_phase_deg)
        self._half_gap = radians(truth.backlash_deg) / 2
        self._ripple, self._ripples = truth.ripple_fraction, truth.ripple_per_turn
        self._segments = [ProfileSegment(time_s, time_s, radians(truth.start_deg), 0.0)]
        self._gaps = [0.0]  # per segment: the drive's lead over the shaft in the gear's play at its start

    # -- driving -------------------------------------------------------------------------------------------------
    def start_at(self, time_s: float) -> ProfileStart:
        """Return the drive's state at a time at which a profile begins."""
        segment = self._segments[self._index(time_s)]
        if time_s >= segment.end_s:
            return ProfileStart(time_s, segment.angle_at(segment.end_s), 0.0)
        return ProfileStart(time_s, segment.angle_at(time_s), segment.rate_at(time_s))

    def follow(self, time_s: float, segments: Sequence[ProfileSegment]) -> None:
        """Follow `segments` after `time_s`, instead of the segments planned so far."""
        stands = ProfileSegment(time_s, time_s, self.start_at(time_s).angle_rad, 0.0)
        gap = self._gap_at(time_s)
        last = self._index(time_s)
        self._segments[last + 1 :] = []
        self._gaps[last + 1 :] = []
        ended = self._segments[last]
        self._segments[last] = ended._replace(end_s=min(ended.end_s, time_s))
        for segment in segments or [stands]:
            self._segments.append(segment)
            self._gaps.append(gap)
            gap = self._play(gap, segment.angle_at(segment.end_s) - segment.angle_rad)
        del self._segments[:-KEPT_SEGMENTS], self._gaps[:-KEPT_SEGMENTS]

    def halt(self, time_s: float) -> None:
        """Stop at `time_s`, without a ramp."""
        self.follow(time_s, [])

    def ends_s(self) -> float:
        """Return the time at which the drive arrives, s."""
        return self._segments[-1].end_s

    # -- motion --------------------------------------------------------------------------------------------------
    def angle_at(self, time_s: float) -> float:
        """Return the shaft's true angle, rad."""
        read = self.encoder_at(time_s)
        angle = read
        for _ in range(ITERATIONS):
            angle = read - self._encoder_error(angle)
        return angle

    def rate_at(self, time_s: float) -> float:
        """Return the shaft's true rate, rad/s."""
        start = self.start_at(time_s)
        gap = self._gap_at(time_s)
        if abs(gap - copysign(self._half_gap, start.rate_rad_s)) > 1e-12:
            return 0.0  # the play is being taken up
        out = start.angle_rad - gap
        angle = self.angle_at(time_s)
        slope = 1.0 + self._once * cos(angle + self._once_phase) + 2 * self._twice * cos(2 * angle + self._twice_phase)
        return start.rate_rad_s * (1.0 + self._ripple * cos(self._ripples * out)) / slope

    def encoder_at(self, time_s: float) -> float:
        """Return the encoder's angle, rad, with counted revolutions, before the effects of resolution and noise."""
        out = self.start_at(time_s).angle_rad - self._gap_at(time_s)
        return out + self._ripple / self._ripples * sin(self._ripples * out)

    def _encoder_error(self, angle: float) -> float:
        once = self._once * sin(angle + self._once_phase)
        return once + self._twice * sin(2 * angle + self._twice_phase)

    def _gap_at(self, time_s: float) -> float:
        index = self._index(time_s)
        segment = self._segments[index]
        return self._play(self._gaps[index], segment.angle_at(min(time_s, segment.end_s)) - segment.angle_rad)

    def _play(self, gap: float, travel: float) -> float:
        return min(max(gap + travel, -self._half_gap), self._half_gap)

    def _index(self, time_s: float) -> int:
        return max(0, bisect_right(self._segments, time_s, key=lambda segment: segment.start_s) - 1)


def whole_turns(angle_rad: float) -> float:
    """Return the part of an angle, rad, that is whole revolutions, which a servo forgets if it loses power."""
    return angle_rad // (2 * pi) * 2 * pi
