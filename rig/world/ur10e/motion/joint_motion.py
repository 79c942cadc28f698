"""The simulated joints: a trajectory played with a time scaling (speed slider, pause), known at any instant."""

from collections import deque
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from math import ceil, nan
from typing import NamedTuple

from rig.world.clock import TICK_S
from rig.world.ur10e.motion.encoders import Encoders
from rig.world.ur10e.motion.joint_drive import Deflection, JointDrive
from rig.world.ur10e.motion.ripple import Ripple
from rig.world.ur10e.motion.trajectory import ZERO, Joints, Trajectory, build_rest, plan_joint_move, plan_speed_change
from rig.world.ur10e.motion.vibration import Vibration

# ROS 2 description of the UR10e, from the 5.8 manual: base and shoulder 120°/s, elbow and wrists 180°/s.
JOINT_SPEED_LIMIT_RAD_S: Joints = (2.0943951, 2.0943951, 3.1415927, 3.1415927, 3.1415927, 3.1415927)
JERK_TICKS = 6  # ticks in which a joint's force follows a change of its target's acceleration
SCALING_RATE_PER_S = 4.0  # after the slider, pause or play: at most a quarter of a second in all


@dataclass(frozen=True, slots=True)
class Instant:
    """The six joints at one time: commanded (`target_…`) and actual."""

    target_q_rad: Joints
    target_qd_rad_s: Joints
    target_qdd_rad_s2: Joints
    q_rad: Joints
    qd_rad_s: Joints


class _Tick(NamedTuple):
    """A tick's start, and at that moment the trajectory's time, the time scaling (`fraction`) and its derivative."""

    start_s: float
    trajectory_s: float
    fraction: float
    slope_per_s: float
    trajectory: Trajectory
    offset: Joints
    gain: Joints
    deflections: tuple[Deflection, ...] = ()


class JointMotion:
    """Angles and speeds of the six joints. `step` plays a tick; `joints_at` returns them at any time within that tick.

    - `drive`: how the joints follow the trajectory.
    - `encoders`: the errors of the angles and speeds that clients receive.
    - `memory_s`: the time before the last tick's end that `joints_at` covers too.
    - `vibration`: a vibration that the encoders show; it is added to their angles and to the true ones.

    Three angles are in use: `target` is the commanded one; `smooth` is the joint's without ripple, scaled such that the
    joint with its ripple comes to rest exactly on target; the third is the joint's own, with the ripple.
    """

    def __init__(
        self,
        start_rad: Sequence[float],
        ripples: Sequence[Ripple],
        encoders: Encoders | None = None,
        memory_s: float = 0.0,
        *,
        drive: JointDrive | None = None,
        vibration: Vibration | None = None,
        speed_limit_rad_s: Joints = JOINT_SPEED_LIMIT_RAD_S,
    ) -> None:
        """Place the joints at rest at `start_rad` (6,)."""
        self.speed_limit_rad_s = speed_limit_rad_s
        self.vibration = vibration
        self._ripples = tuple(ripples)
        self._has_ripples = any(ripple.components for ripple in ripples)
        self._encoders, self._drive = encoders or Encoders(), drive or JointDrive()
        self._trajectory = build_rest(tuple(start_rad))
        self._offset, self._gain = self._map(tuple(start_rad), tuple(start_rad))
        self._smooth, self._angles = [nan] * 6, [0.0] * 6  # last results, joint by joint
        self._scales = True  # a stop is not stretched by the speed slider
        self._trajectory_s = 0.0
        self._fraction = 1.0
        self.fraction_wanted = 1.0
        first = _Tick(-TICK_S, 0.0, 1.0, 0.0, self._trajectory, self._offset, self._gain)
        self._ticks = deque([first], 1 + ceil((memory_s + self._drive.lag_s) / TICK_S))
        self.smooth_qd_rad_s: Joints = ZERO  # speeds of the smooth angles at the end of the last tick
        self._changes = deque([ZERO] * JERK_TICKS, JERK_TICKS)  # changes of the smooth speeds in the last ticks
        self._moving_ticks = 0  # upper bound of the ticks in memory with motion
        self._now: Instant | None = None  # computed on demand: most ticks need none

    # -- present state -------------------------------------------------------------------------------------------
    @property
    def fraction(self) -> float:
        """The time scaling: 1 at full speed, 0 when paused."""
        return self._fraction

    @property
    def standing(self) -> bool:
        """Whether the last trajectory has ended; a paused one has not."""
        return self._trajectory.is_over(self._trajectory_s)

    @property
    def now(self) -> Instant:
        """The joints at the end of the last tick."""
        if self._now is None:
            target, velocity, acceleration = self._trajectory.state_at(self._trajectory_s)
            fraction = self._fraction if self._scales else 1.0
            q, qd, _ = self._follow(self._end_s)
            self._now = Instant(target, tuple(v * fraction for v in velocity), acceleration, q, qd)
        return self._now

    @property
    def still(self) -> bool:
        """Whether nothing moved in the last tick and in the earlier ticks in memory."""
        return not self._moving_ticks

    @property
    def q_rad(self) -> Joints:
        return self.now.q_rad

    @property
    def qd_rad_s(self) -> Joints:
        return self.now.qd_rad_s

    @property
    def qdd_rad_s2(self) -> Joints:
        """Accelerations of the joints at the end of the last tick."""
        return ZERO if self.still else self.state_at(self._end_s)[2]

    @property
    def _end_s(self) -> float:
        """The end of the last tick, s."""
        return self._ticks[-1].start_s + TICK_S

    @property
    def moving(self) -> bool:
        return any(self.smooth_qd_rad_s)

    @property
    def actual_q_rad(self) -> Joints:
        """The joints' angles as the encoders read them at the end of the last tick."""
        q_rad, qd_rad_s, _ = self._vibrating(ZERO)
        return self._encoders.read_angles(self._end_s, q_rad, qd_rad_s)

    @property
    def actual_qd_rad_s(self) -> Joints:
        """The joints' speeds as the encoders measure them."""
        return self._encoders.read_speeds(self._end_s, self._vibrating(ZERO)[1])

    @property
    def settled_q_rad(self) -> Joints:
        """The angles at which the joints rest once they have followed their targets."""
        target = self.now.target_q_rad
        smooth = [offset + gain * q for offset, gain, q in zip(self._offset, self._gain, target, strict=True)]
        return tuple(ripple.angle(u) for ripple, u in zip(self._ripples, smooth, strict=True))

    @property
    def actual(self) -> tuple[Joints, Joints, Joints]:
        """Angles, speeds and accelerations as encoders with perfect resolution and without noise would measure them."""
        return self._vibrating(self.qdd_rad_s2)

    def _vibrating(self, qdd_rad_s2: Joints) -> tuple[Joints, Joints, Joints]:
        joints = self.q_rad, self.qd_rad_s, qdd_rad_s2
        return joints if self.vibration is None else self.vibration.add(self._end_s, *joints)

    def joints_at(self, time_s: float) -> tuple[Joints, Joints]:
        """Return angles and speeds of the joints at a virtual time within the last tick or the `memory_s` before it."""
        return self.state_at(time_s)[:2]

    def state_at(self, time_s: float) -> tuple[Joints, Joints, Joints]:
        """Return the joints' angles, speeds and accelerations, including the ripple's."""
        return (self.now.q_rad, ZERO, ZERO) if self.still else self._follow(time_s)

    def _follow(self, time_s: float) -> tuple[Joints, Joints, Joints]:
        """Return angles, speeds and accelerations of the joints as their drives follow the trajectory."""
        drive = self._drive
        time_s -= drive.lag_s
        tick = self._ticks[-1]
        if time_s < tick.start_s:
            tick = next((it for it in reversed(self._ticks) if it.start_s <= time_s), self._ticks[0])
        elapsed = min(max(time_s - tick.start_s, 0.0), TICK_S)
        fraction = tick.fraction + tick.slope_per_s * elapsed
        trajectory_s = tick.trajectory_s + (tick.fraction + 0.5 * tick.slope_per_s * elapsed) * elapsed
        target, velocity, acceleration = tick.trajectory.state_at(trajectory_s)
        smooth, speed, change = list(target), [0.0] * 6, [0.0] * 6
        squared, slope_per_s = fraction * fraction, tick.slope_per_s
        moving = [joint for joint, (v, a) in enumerate(zip(velocity, acceleration, strict=True)) if v or a]
        for joint in moving:
            v = velocity[joint]
            speed[joint], change[joint] = v * fraction, acceleration[joint] * squared + v * slope_per_s
        joints = self._apply_ripples(tick, smooth, speed, change) if self._has_ripples else (smooth, speed, change)
        q, qd, qdd = joints
        shaken = []  # joints, with the angle and derivatives that are added
        for joint in moving:
            if drive.orders[joint]:
                shaken.extend(drive.shake(joint, smooth[joint], speed[joint], change[joint]))
        shaken.extend((deflection.joint, *drive.deflection_at(deflection, elapsed)) for deflection in tick.deflections)
        for joint, angle, rate, bend in shaken:
            q[joint] += angle
            qd[joint] += rate
            qdd[joint] += bend
        return tuple(q), tuple(qd), tuple(qdd)

    def _apply_ripples(
        self, tick: _Tick, target: list[float], speed: list[float], change: list[float]
    ) -> tuple[list[float], list[float], list[float]]:
        """Return angles, speeds and accelerations of the joints with the ripples that are locked to their angles.

        The arguments are the targets' angles, speeds and accelerations. They are changed in place to those of the
        joints without ripple.
        """
        qd, qdd = [0.0] * 6, [0.0] * 6
        for joint, (offset, gain) in enumerate(zip(tick.offset, tick.gain, strict=True)):
            u = target[joint] = offset + gain * target[joint]
            ripple = self._ripples[joint]
            if self._smooth[joint] != u:  # most moves turn few joints
                self._smooth[joint], self._angles[joint] = u, ripple.angle(u)
            v, a = speed[joint], change[joint]
            if v or a:
                v, a = speed[joint], change[joint] = gain * v, gain * a
                slope = ripple.gain(u)
                qd[joint], qdd[joint] = slope * v, slope * a + ripple.bend(u) * v * v
        return self._angles.copy(), qd, qdd

    # -- one tick ------------------------------------------------------------------------------------------------
    def step(self, end_s: float) -> None:
        """Play one tick, ending at the virtual time `end_s`."""
        begin_s, begin_fraction = self._trajectory_s, self._fraction
        change = self.fraction_wanted - self._fraction
        limit = SCALING_RATE_PER_S * TICK_S
        self._fraction += max(-limit, min(limit, change))
        fraction, slope = (begin_fraction, (self._fraction - begin_fraction) / TICK_S) if self._scales else (1.0, 0.0)
        standing = self.standing
        if not standing:
            mean = 0.5 * (begin_fraction + self._fraction) if self._scales else 1.0
            self._trajectory_s += mean * TICK_S
            self._now = None
        deflections = self._deflect(standing)
        self._ticks.append(
            _Tick(end_s - TICK_S, begin_s, fraction, slope, self._trajectory, self._offset, self._gain, deflections)
        )
        if not standing or deflections:
            self._moving_ticks = self._ticks.maxlen or 1
            self._now = None
        elif self._moving_ticks:
            self._moving_ticks -= 1
            self._now = None
        self._encoders.step()

    def _deflect(self, standing: bool) -> tuple[Deflection, ...]:
        """Return the joints' deflections in the tick just simulated."""
        before, last, changes = self.smooth_qd_rad_s, self._ticks[-1].deflections, self._changes
        if standing and before is ZERO:
            changes.append(ZERO)
            return self._drive.advance(last, _mean(changes)) if last else ()
        velocity = self._trajectory.state_at(self._trajectory_s)[1]
        fraction = self._fraction if self._scales else 1.0
        speed = tuple([g * v * fraction for g, v in zip(self._gain, velocity, strict=True)]) if any(velocity) else ZERO
        self.smooth_qd_rad_s = speed
        changes.append(ZERO if speed == before else tuple([v - b for v, b in zip(speed, before, strict=True)]))
        if not last and changes[-1] is ZERO:
            return ()
        return self._drive.advance(last, _mean(changes))

    # -- commands ------------------------------------------------------------------------------------------------
    def move(self, target_rad: Joints, speed_rad_s: float, acceleration_rad_s2: float) -> None:
        """Play a moveJ from rest."""
        # From the joints' actual angles, which after a stop need not be the program's.
        self.follow(
            plan_joint_move(self.settled_q_rad, target_rad, speed_rad_s, acceleration_rad_s2, self.speed_limit_rad_s)
        )

    def follow(self, trajectory: Trajectory) -> None:
        """Play a trajectory that begins at rest at the joints' angles."""
        self._offset, self._gain = self._map(self.settled_q_rad, trajectory.end_rad)
        self._play(trajectory, scaled=True)

    def speed(self, qd_rad_s: Joints, acceleration_rad_s2: float) -> None:
        """Play a speedJ from the joints' present state: accelerate to `qd_rad_s` (6,) and keep this velocity."""
        wanted = tuple(max(-m, min(m, v)) for v, m in zip(qd_rad_s, self.speed_limit_rad_s, strict=True))
        velocity = self._trajectory.state_at(self._trajectory_s)[1]
        self._play(plan_speed_change(self.now.target_q_rad, velocity, wanted, acceleration_rad_s2), scaled=True)

    def stop(self, deceleration_rad_s2: float) -> None:
        """Slow the joints down to rest along their present direction."""
        if self.moving:
            stopping = plan_speed_change(self.now.target_q_rad, self.now.target_qd_rad_s, ZERO, deceleration_rad_s2)
            self._play(stopping, scaled=False)
        else:
            self._play(build_rest(self.now.target_q_rad), scaled=True)

    def _play(self, trajectory: Trajectory, scaled: bool) -> None:
        self._trajectory, self._scales, self._trajectory_s = trajectory, scaled, 0.0
        self._now = None

    def _map(self, start: Joints, end: Joints) -> tuple[Joints, Joints]:
        """Return the offset and gain (6,) that convert each joint's target into its angle without ripple.

        Offset and gain are chosen such that the joints, with their ripple, are exactly on target at the path's two
        ends.
        """
        first = [r.smooth(q) for r, q in zip(self._ripples, start, strict=True)]
        last = [r.smooth(q) for r, q in zip(self._ripples, end, strict=True)]
        gain = tuple(  # a path shorter than any useful precision has none
            (v - u) / (b - a) if abs(b - a) > 1e-9 else 1.0 for u, v, a, b in zip(first, last, start, end, strict=True)
        )
        return tuple(u - g * a for u, g, a in zip(first, gain, start, strict=True)), gain


def _mean(changes: Collection[Joints]) -> list[float]:
    """Return the mean (6,) of changes in several ticks."""
    return [sum(values) / len(changes) for values in zip(*changes, strict=True)]
