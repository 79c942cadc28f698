"""The shaft of the simulated servo: what the gear, the encoder and the load make of the profile."""

from bisect import bisect_right
from collections.abc import Sequence
from math import copysign, cos, pi, radians, sin

from rig.world.servo.profile import Piece, Start
from rig.world.servo.truth import ServoTruth

KEPT = 4096  # pieces of the past
ITERATIONS = 12  # the encoder's error is inverted to 1e-15 of a turn by then


class Shaft:
    """The shaft's angle and rate at any time, past and planned; a turn ccw, seen on the horn, counts up.

    The loop is closed over the encoder, so the drive is an angle as the encoder reads it, and the shaft's true angle
    carries the encoder's error: it turns unevenly where the readings are even.
    """

    def __init__(self, truth: ServoTruth, time_s: float) -> None:
        self._once, self._once_phase = radians(truth.encoder_once_deg), radians(truth.encoder_once_phase_deg)
        self._twice, self._twice_phase = radians(truth.encoder_twice_deg), radians(truth.encoder_twice_phase_deg)
        self._half_gap = radians(truth.backlash_deg) / 2
        self._ripple, self._ripples = truth.ripple_fraction, truth.ripple_per_turn
        self._pieces = [Piece(time_s, time_s, radians(truth.start_deg), 0.0)]
        self._gaps = [0.0]  # by piece: how far the drive is ahead of the shaft in the gear's play, at its start

    # -- driving -------------------------------------------------------------------------------------------------
    def start_at(self, time_s: float) -> Start:
        """The drive's state at a time, for a profile that begins then."""
        piece = self._pieces[self._index(time_s)]
        if time_s >= piece.end_s:
            return Start(time_s, piece.angle_at(piece.end_s), 0.0)
        return Start(time_s, piece.angle_at(time_s), piece.rate_at(time_s))

    def follow(self, time_s: float, pieces: Sequence[Piece]) -> None:
        """Drive by `pieces` from `time_s` on, instead of what was planned."""
        stands = Piece(time_s, time_s, self.start_at(time_s).angle_rad, 0.0)
        gap = self._gap_at(time_s)
        last = self._index(time_s)
        self._pieces[last + 1 :], self._gaps[last + 1 :] = [], []
        cut = self._pieces[last]
        self._pieces[last] = cut._replace(end_s=min(cut.end_s, time_s))
        for piece in pieces or [stands]:
            self._pieces.append(piece)
            self._gaps.append(gap)
            gap = self._play(gap, piece.angle_at(piece.end_s) - piece.angle_rad)
        del self._pieces[:-KEPT], self._gaps[:-KEPT]

    def halt(self, time_s: float) -> None:
        """Stand from `time_s` on, without a ramp."""
        self.follow(time_s, [])

    def ends_s(self) -> float:
        """The time at which the drive has arrived."""
        return self._pieces[-1].end_s

    # -- what is felt --------------------------------------------------------------------------------------------
    def angle_at(self, time_s: float) -> float:
        """The shaft's true angle, rad."""
        read = self.encoder_at(time_s)
        angle = read
        for _ in range(ITERATIONS):
            angle = read - self._error(angle)
        return angle

    def rate_at(self, time_s: float) -> float:
        """The shaft's true rate, rad/s."""
        start = self.start_at(time_s)
        gap = self._gap_at(time_s)
        if abs(gap - copysign(self._half_gap, start.rate_rad_s)) > 1e-12:
            return 0.0  # the play is being taken up
        out = start.angle_rad - gap
        angle = self.angle_at(time_s)
        slope = 1.0 + self._once * cos(angle + self._once_phase) + 2 * self._twice * cos(2 * angle + self._twice_phase)
        return start.rate_rad_s * (1.0 + self._ripple * cos(self._ripples * out)) / slope

    def encoder_at(self, time_s: float) -> float:
        """What the encoder would read if it had neither steps nor noise, rad; turns are counted."""
        out = self.start_at(time_s).angle_rad - self._gap_at(time_s)
        return out + self._ripple / self._ripples * sin(self._ripples * out)

    def _error(self, angle: float) -> float:
        once = self._once * sin(angle + self._once_phase)
        return once + self._twice * sin(2 * angle + self._twice_phase)

    def _gap_at(self, time_s: float) -> float:
        index = self._index(time_s)
        piece = self._pieces[index]
        return self._play(self._gaps[index], piece.angle_at(min(time_s, piece.end_s)) - piece.angle_rad)

    def _play(self, gap: float, way: float) -> float:
        return min(max(gap + way, -self._half_gap), self._half_gap)

    def _index(self, time_s: float) -> int:
        return max(0, bisect_right(self._pieces, time_s, key=lambda piece: piece.start_s) - 1)


def whole_turns(angle_rad: float) -> float:
    """The whole turns in an angle, rad: what is forgotten with the supply off."""
    return angle_rad // (2 * pi) * 2 * pi
