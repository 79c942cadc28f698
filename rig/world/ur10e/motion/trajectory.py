"""Joint motion as pieces of constant acceleration: exact at any time, not only at ticks."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf, sqrt

Joints = tuple[float, ...]
ZERO: Joints = (0.0,) * 6
ROUNDING_S = 1e-9  # so many seconds before its end a trajectory counts as over


@dataclass(frozen=True, slots=True)
class MotionSegment:
    """A stretch of `duration_s`: starts at `q_rad` with `qd_rad_s`, keeps `qdd_rad_s2` (six joints each)."""

    duration_s: float
    q_rad: Joints
    qd_rad_s: Joints = ZERO
    qdd_rad_s2: Joints = ZERO
    _moving: tuple[int, ...] = field(init=False, repr=False)  # joints: the others need no working out

    def __post_init__(self) -> None:
        moves = [any(each) for each in zip(self.qd_rad_s, self.qdd_rad_s2, strict=True)]
        object.__setattr__(self, "_moving", tuple(joint for joint, moving in enumerate(moves) if moving))

    def at(self, time_s: float) -> tuple[Joints, Joints, Joints]:
        """Position, velocity, acceleration `time_s` after the piece began."""
        half = 0.5 * time_s
        q, qd = list(self.q_rad), list(self.qd_rad_s)
        for joint in self._moving:
            before = qd[joint]
            qd[joint] = before + self.qdd_rad_s2[joint] * time_s
            # The mean of the velocities at both ends, times the time.
            q[joint] += (before + qd[joint]) * half
        return tuple(q), tuple(qd), self.qdd_rad_s2


class Trajectory:
    """Pieces one after another; before the first and after the last it stands still there."""

    def __init__(self, pieces: Sequence[MotionSegment], end_rad: Joints | None = None) -> None:
        self._pieces = tuple(pieces)
        self.duration_s = sum(piece.duration_s for piece in pieces)
        last = pieces[-1]
        # The exact target: the sum of the pieces misses it by rounding.
        self.end_rad = (
            end_rad if end_rad is not None else last.at(last.duration_s)[0] if last.duration_s < inf else last.q_rad
        )

    def over(self, time_s: float) -> bool:
        return time_s >= self.duration_s - ROUNDING_S

    def at(self, time_s: float) -> tuple[Joints, Joints, Joints]:
        """Position, velocity, acceleration (six joints each) at `time_s` after the start."""
        if self.over(time_s):
            return self.end_rad, ZERO, ZERO
        for piece in self._pieces:
            if time_s < piece.duration_s:
                return piece.at(max(0.0, time_s))
            time_s -= piece.duration_s
        return self.end_rad, ZERO, ZERO


def build_rest(q_rad: Joints) -> Trajectory:
    return Trajectory([MotionSegment(0.0, q_rad)], q_rad)


def plan_joint_move(
    start_rad: Joints, end_rad: Joints, speed_rad_s: float, acceleration_rad_s2: float, limits_rad_s: Joints
) -> Trajectory:
    """A moveJ from rest to rest: all joints in step, the one with the longest way at `speed_rad_s` after a ramp.

    A way too short for the speed becomes a triangle. No joint exceeds its limit (all slow down together).
    """
    way = tuple(b - a for a, b in zip(start_rad, end_rad, strict=True))
    longest = max(abs(w) for w in way)
    if longest == 0.0:
        return build_rest(end_rad)
    share = tuple(w / longest for w in way)
    top = min([speed_rad_s, *(limit / abs(s) for s, limit in zip(share, limits_rad_s, strict=True) if s != 0.0)])
    speed = min(top, sqrt(longest * acceleration_rad_s2))
    ramp_s = speed / acceleration_rad_s2
    ramp = 0.5 * speed * ramp_s
    cruise_s = max(0.0, (longest - 2.0 * ramp) / speed)

    def along(distance: float) -> Joints:
        return tuple(a + s * distance for a, s in zip(start_rad, share, strict=True))

    up = tuple(s * acceleration_rad_s2 for s in share)
    velocity = tuple(s * speed for s in share)
    return Trajectory(
        [
            MotionSegment(ramp_s, start_rad, ZERO, up),
            MotionSegment(cruise_s, along(ramp), velocity),
            MotionSegment(ramp_s, along(longest - ramp), velocity, tuple(-a for a in up)),
        ],
        end_rad,
    )


def plan_speed_change(q_rad: Joints, from_rad_s: Joints, to_rad_s: Joints, acceleration_rad_s2: float) -> Trajectory:
    """A change of velocity, the joint that changes most at the acceleration; then on for ever, or at rest."""
    change = tuple(b - a for a, b in zip(from_rad_s, to_rad_s, strict=True))
    ramp_s = max(abs(c) for c in change) / acceleration_rad_s2
    pieces = []
    if ramp_s > 0.0:
        pieces.append(MotionSegment(ramp_s, q_rad, from_rad_s, tuple(c / ramp_s for c in change)))
        q_rad = pieces[0].at(ramp_s)[0]
    if any(to_rad_s):
        pieces.append(MotionSegment(inf, q_rad, to_rad_s))
    return Trajectory(pieces, q_rad) if pieces else build_rest(q_rad)
