"""What the joints do beside what their encoders say: known to nobody but the world.

A joint's true angle is e + zero + A₁ sin(e + φ₁) + A₂ sin(2e + φ₂) − h(e) + vibration(t) + settling(t), with e the
angle its encoder sees. Eccentric and tilted graduations err once and twice a turn; h is the friction's hysteresis in
Dahl's form (A solid friction model, 1968): after a reversal it goes exponentially to half its width on the other side.
A vibration that the encoder sees, too, is no part of this: it is added to e and to the true angle alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, exp, inf, pi, sin
from random import Random

from rig.world.ur10e.motion.trajectory import ZERO, Joints
from rig.world.ur10e.motion.vibration import WRISTS, Vibration

REVERSAL_RAD = 0.01  # way in which hysteresis comes about: inside the ramps
STANDING_RAD_S = 1e-6  # a joint that need not move may be asked to by rounding
FORGOTTEN = 12.0  # settling times after which nothing is left of it


@dataclass(frozen=True, slots=True)
class Errors:
    """Sizes of errors. `hysteresis_rad`: between both directions; `vibration_rms_rad_s`: of each wrist's rate.

    `vibration_rad_s` (of each line), `settling_rad_s`: angular frequencies.
    """

    zero_rad: Sequence[float] = (0.0,) * 6
    encoder_once_rad: float = 0.0
    encoder_twice_rad: float = 0.0
    hysteresis_rad: float = 0.0
    vibration_rad_s: Sequence[float] = (60.0,)
    vibration_rms_rad_s: float = 0.0
    settling_rad: float = 0.0
    settling_rad_s: float = 60.0
    settling_decay_s: float = 0.1

    @property
    def any(self) -> bool:
        return any(self.zero_rad) or any(
            (
                self.encoder_once_rad,
                self.encoder_twice_rad,
                self.hysteresis_rad,
                self.vibration_rms_rad_s,
                self.settling_rad,
            )
        )


class JointErrors:
    """Errors of all six joints. `step` remembers where they turn back and when they stop; `at` has the true joints."""

    def __init__(self, errors: Errors, random: Random) -> None:
        self._errors = errors
        self._phases = [[random.uniform(0.0, 2.0 * pi) for _ in range(3)] for _ in range(6)]
        self._direction = [0.0] * 6
        self._reversal = [(0.0, 0.0)] * 6  # encoder's angle, and the hysteresis there
        self._moving = [False] * 6
        self._stops = [(-inf, 0.0)] * 6  # when, and from which direction
        first, *more = errors.vibration_rad_s
        lines = [(first, [self._phases[joint][2] for joint in WRISTS])]
        lines += [(turn, [random.uniform(0.0, 2.0 * pi) for _ in WRISTS]) for turn in more]
        self._vibration = Vibration(errors.vibration_rms_rad_s, lines)
        self._settling = errors.settling_rad_s
        self._patience_s = FORGOTTEN * errors.settling_decay_s
        self._placed = [(0.0, 0.0, 1.0, 0.0)] * 6  # last worked out: encoder's angle; angle and its two derivatives
        self._known = [False] * 6
        self._stood: tuple[Joints, Joints] = ((), ())  # the encoders' angles that joints stood at last, and the true

    def step(self, time_s: float, q_rad: Joints, qd_rad_s: Joints) -> None:
        """The joints at the end of a tick, as the encoders see them."""
        for joint, (angle, speed) in enumerate(zip(q_rad, qd_rad_s, strict=True)):
            moving = abs(speed) > STANDING_RAD_S
            if moving:
                direction = 1.0 if speed > 0.0 else -1.0
                if direction != self._direction[joint]:
                    self._reversal[joint] = (angle, self._hysteresis(joint, angle)[0])
                    self._direction[joint] = direction
                    self._known[joint] = False
            elif self._moving[joint]:
                self._stops[joint] = (time_s, self._direction[joint])
            self._moving[joint] = moving

    def quiet(self, time_s: float) -> bool:
        """Whether joints that stand stand still."""
        return not self._errors.vibration_rms_rad_s and not (
            self._errors.settling_rad and any(time_s - stop_s < self._patience_s for stop_s, _ in self._stops)
        )

    def at(self, time_s: float, q_rad: Joints, qd_rad_s: Joints, qdd_rad_s2: Joints) -> tuple[Joints, Joints, Joints]:
        """True angles, speeds and accelerations at a time of which the encoders' are given."""
        if qd_rad_s is ZERO and q_rad is self._stood[0]:
            angles, speeds, accelerations = list(self._stood[1]), [0.0] * 6, [0.0] * 6
        else:
            angles, speeds, accelerations = self._carried(q_rad, qd_rad_s, qdd_rad_s2)
            if qd_rad_s is ZERO:
                self._stood = q_rad, tuple(angles)
        if self._errors.settling_rad:
            for joint, (stop_s, direction) in enumerate(self._stops):
                if 0.0 <= time_s - stop_s < self._patience_s:
                    angle, speed, acceleration = self._settle(direction, time_s - stop_s)
                    angles[joint] += angle
                    speeds[joint] += speed
                    accelerations[joint] += acceleration
        if self._errors.vibration_rms_rad_s:
            return self._vibration.added(time_s, angles, speeds, accelerations)
        return tuple(angles), tuple(speeds), tuple(accelerations)

    def _carried(
        self, q_rad: Joints, qd_rad_s: Joints, qdd_rad_s2: Joints
    ) -> tuple[list[float], list[float], list[float]]:
        """The true joints without vibration and settling."""
        angles, speeds, accelerations = list(q_rad), list(qd_rad_s), list(qdd_rad_s2)
        for joint, (e, speed) in enumerate(zip(q_rad, qd_rad_s, strict=True)):
            if self._placed[joint][0] != e or not self._known[joint]:  # most moves turn few joints
                self._placed[joint] = (e, *self._place(joint, e))
                self._known[joint] = True
            _, angles[joint], gain, bend = self._placed[joint]
            if speed or accelerations[joint]:
                speeds[joint] = gain * speed
                accelerations[joint] = gain * accelerations[joint] + bend * speed * speed
        return angles, speeds, accelerations

    def _place(self, joint: int, e: float) -> tuple[float, float, float]:
        """True angle at the encoder's, and its two derivatives by that."""
        errors, (once, twice, _) = self._errors, self._phases[joint]
        a, b = errors.encoder_once_rad, errors.encoder_twice_rad
        lag, slope, bend = self._hysteresis(joint, e)
        return (
            e + errors.zero_rad[joint] + a * sin(e + once) + b * sin(2.0 * e + twice) - lag,
            1.0 + a * cos(e + once) + 2.0 * b * cos(2.0 * e + twice) - slope,
            -a * sin(e + once) - 4.0 * b * sin(2.0 * e + twice) - bend,
        )

    def _hysteresis(self, joint: int, e: float) -> tuple[float, float, float]:
        """The joint's lag, rad, and the two derivatives by the encoder's angle."""
        turned_at, lag = self._reversal[joint]
        end = 0.5 * self._errors.hysteresis_rad * self._direction[joint]
        left = (lag - end) * exp(-abs(e - turned_at) / REVERSAL_RAD)
        return end + left, -left / REVERSAL_RAD * self._direction[joint], left / REVERSAL_RAD**2

    def _settle(self, direction: float, since_s: float) -> tuple[float, float, float]:
        """Swing of a joint that stopped so long ago: angle, rate, and its change."""
        decay, turn = -1.0 / self._errors.settling_decay_s, self._settling
        size = self._errors.settling_rad * direction * exp(decay * since_s)
        s, c = size * sin(turn * since_s), size * cos(turn * since_s)
        return s, decay * s + turn * c, (decay**2 - turn**2) * s + 2.0 * decay * turn * c
