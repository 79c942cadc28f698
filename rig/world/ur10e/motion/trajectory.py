"""Joint motion in segments of constant acceleration: exact at any time, not only at ticks."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf, sqrt

Joints = tuple[float, ...]
ZERO: Joints = (0.0,) * 6
ROUNDING_S = 1e-9  # a trajectory counts as finished this time before its end
SOFT_STEPS, SOFT_STEP_S, SOFT_OVERSHOOT = 19, 0.008, 1.38  # the gentle start of a move, as in logs


@dataclass(frozen=True, slots=True)
class MotionSegment:
    """A segment that starts at angles `q_rad` with speeds `qd_rad_s` and keeps the accelerations `qdd_rad_s2`.

    Angles, speeds and accelerations have a value for each of the six joints.
    """

    duration_s: float
    q_rad: Joints
    qd_rad_s: Joints = ZERO
    qdd_rad_s2: Joints = ZERO
    _moving: tuple[int, ...] = field(init=False, repr=False)  # joints that move

    def __post_init__(self) -> None:
        moves = [any(values) for values in zip(self.qd_rad_s, self.qdd_rad_s2, strict=True)]
        object.__setattr__(self, "_moving", tuple(joint for joint, moving in enumerate(moves) if moving))

    def state_at(self, time_s: float) -> tuple[Joints, Joints, Joints]:
        """Return position, velocity, acceleration (six joints each) at `time_s` after the segment's start."""
        half = 0.5 * time_s
        q, qd = list(self.q_rad), list(self.qd_rad_s)
        for joint in self._moving:
            before = qd[joint]
            qd[joint] = before + self.qdd_rad_s2[joint] * time_s
            # At constant acceleration the distance is the mean of both velocities times the time.
            q[joint] += (before + qd[joint]) * half
        return tuple(q), tuple(qd), self.qdd_rad_s2


class Trajectory:
    """A sequence of segments; the joints are at rest before the first and after the last."""

    def __init__(self, segments: Sequence[MotionSegment], end_rad: Joints | None = None) -> None:
        self._segments = tuple(segments)
        self.duration_s = sum(segment.duration_s for segment in segments)
        last = segments[-1]
        # The exact target, which the sum of the segments misses by rounding.
        last_rad = last.state_at(last.duration_s)[0] if end_rad is None and last.duration_s < inf else last.q_rad
        self.end_rad = last_rad if end_rad is None else end_rad

    def is_over(self, time_s: float) -> bool:
        return time_s >= self.duration_s - ROUNDING_S

    def state_at(self, time_s: float) -> tuple[Joints, Joints, Joints]:
        """Return position, velocity, acceleration (six joints each) at `time_s` after the start."""
        if self.is_over(time_s):
            return self.end_rad, ZERO, ZERO
        for segment in self._segments:
            if time_s < segment.duration_s:
                return segment.state_at(max(0.0, time_s))
            time_s -= segment.duration_s
        return self.end_rad, ZERO, ZERO


def build_rest(q_rad: Joints) -> Trajectory:
    return Trajectory([MotionSegment(0.0, q_rad)], q_rad)


def plan_joint_move(
    start_rad: Joints, end_rad: Joints, speed_rad_s: float, acceleration_rad_s2: float, limits_rad_s: Joints
) -> Trajectory:
    """Return a moveJ from rest to rest, in which all joints are in step, the fastest at `speed_rad_s` after a ramp.

    A path too short to reach the speed has no constant part. If a joint would exceed its limit, all joints slow down
    together.
    """
    path = tuple(b - a for a, b in zip(start_rad, end_rad, strict=True))
    longest = max(abs(w) for w in path)
    if longest == 0.0:
        return build_rest(end_rad)
    ratios = tuple(w / longest for w in path)
    # Speeds and distances below are those of the joint with the longest path; the others have these ratios to it.
    top = min([speed_rad_s, *(limit / abs(s) for s, limit in zip(ratios, limits_rad_s, strict=True) if s != 0.0)])
    speed = min(top, sqrt(longest * acceleration_rad_s2))
    ramp_s = speed / acceleration_rad_s2
    ramp = 0.5 * speed * ramp_s
    cruise_s = max(0.0, (longest - 2.0 * ramp) / speed)

    def joints_after(distance: float) -> Joints:
        return tuple(a + s * distance for a, s in zip(start_rad, ratios, strict=True))

    up = tuple(s * acceleration_rad_s2 for s in ratios)
    velocity = tuple(s * speed for s in ratios)
    return Trajectory(
        [
            MotionSegment(ramp_s, start_rad, ZERO, up),
            MotionSegment(cruise_s, joints_after(ramp), velocity),
            MotionSegment(ramp_s, joints_after(longest - ramp), velocity, tuple(-a for a in up)),
        ],
        end_rad,
    )


def plan_soft_joint_move(
    start_rad: Joints, end_rad: Joints, speed_rad_s: float, acceleration_rad_s2: float, limits_rad_s: Joints
) -> Trajectory:
    """Return a moveJ that a controller plays as a program of its own: the move starts gently, and stops as usual.

    In logs of a UR3 and of the maker's simulator the acceleration grows with the square of time in 19 steps of 8 ms, to
    1.38 times the requested acceleration; then it has the requested value. A move that is too slow or too short for a
    gentle start has the usual start.
    """
    path = tuple(b - a for a, b in zip(start_rad, end_rad, strict=True))
    longest = max(abs(w) for w in path)
    steps = [SOFT_OVERSHOOT * (k / SOFT_STEPS) ** 2 * acceleration_rad_s2 for k in range(1, SOFT_STEPS + 1)]
    gentle_speed, gentle = 0.0, 0.0  # speed and path of the longest joint at the end of the gentle steps
    for acceleration in steps:
        gentle += (gentle_speed + 0.5 * acceleration * SOFT_STEP_S) * SOFT_STEP_S
        gentle_speed += acceleration * SOFT_STEP_S
    # The speed v whose ramp and brake fill the remaining path: longest − gentle = (v² − gentle_speed²)/2a + v²/2a.
    reach = max(0.0, (longest - gentle) * acceleration_rad_s2 + 0.5 * gentle_speed**2)
    speed = min(speed_rad_s, sqrt(reach))
    if longest > 0.0:
        speed = min([speed, *(lim * longest / abs(w) for w, lim in zip(path, limits_rad_s, strict=True) if w)])
    if speed <= gentle_speed:
        return plan_joint_move(start_rad, end_rad, speed_rad_s, acceleration_rad_s2, limits_rad_s)
    ramp_s, brake_s = (speed - gentle_speed) / acceleration_rad_s2, speed / acceleration_rad_s2
    ramp, brake = 0.5 * (speed + gentle_speed) * ramp_s, 0.5 * speed * brake_s
    cruise_s = max(0.0, (longest - gentle - ramp - brake) / speed)
    legs = [(SOFT_STEP_S, acceleration) for acceleration in steps]
    legs += [(ramp_s, acceleration_rad_s2), (cruise_s, 0.0), (brake_s, -acceleration_rad_s2)]
    distance, rate = 0.0, 0.0
    segments = []
    ratios = tuple(w / longest for w in path)
    for duration_s, acceleration in legs:
        q_rad = tuple(a + s * distance for a, s in zip(start_rad, ratios, strict=True))
        qd_rad_s, qdd_rad_s2 = (tuple(s * value for s in ratios) for value in (rate, acceleration))
        segments.append(MotionSegment(duration_s, q_rad, qd_rad_s, qdd_rad_s2))
        distance += (rate + 0.5 * acceleration * duration_s) * duration_s
        rate += acceleration * duration_s
    return Trajectory(segments, end_rad)


def plan_speed_change(q_rad: Joints, from_rad_s: Joints, to_rad_s: Joints, acceleration_rad_s2: float) -> Trajectory:
    """Return a change of velocity, in which the joint whose speed changes most has the given acceleration.

    Afterwards the joints keep the new velocity, or rest if the new velocity is zero.
    """
    change = tuple(b - a for a, b in zip(from_rad_s, to_rad_s, strict=True))
    ramp_s = max(abs(c) for c in change) / acceleration_rad_s2
    segments = []
    if ramp_s > 0.0:
        segments.append(MotionSegment(ramp_s, q_rad, from_rad_s, tuple(c / ramp_s for c in change)))
        q_rad = segments[0].state_at(ramp_s)[0]
    if any(to_rad_s):
        segments.append(MotionSegment(inf, q_rad, to_rad_s))
    return Trajectory(segments, q_rad) if segments else build_rest(q_rad)
