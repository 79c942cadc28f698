"""Errors of the joints that their encoders do not show, known only to the world.

A joint's true angle is e + zero + A₁ sin(e + φ₁) + A₂ sin(2e + φ₂) − h(e) + vibration(t) + settling(t), with e the
angle at its encoder. Eccentric and tilted graduations err once and twice a turn. h is friction hysteresis in Dahl's
form (A solid friction model, 1968): after a reversal it tends exponentially to half its width on the other side. A
vibration that the encoder shows is not included: it is added both to e and to the true angle.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, exp, inf, pi, sin
from random import Random

from rig.world.ur10e.motion.trajectory import ZERO, Joints
from rig.world.ur10e.motion.vibration import WRISTS, Vibration

REVERSAL_RAD = 0.01  # travel within which hysteresis develops: shorter than the ramps
MIN_SPEED_RAD_S = 1e-6  # slower speeds are rounding errors of joints that do not move
NEGLIGIBLE_DECAY_TIMES = 12.0  # after which settling is negligible
JointState = tuple[Joints, Joints, Joints]  # angles, speeds, accelerations


@dataclass(frozen=True, slots=True)
class Errors:
    """Magnitudes of a joint's errors.

    - `hysteresis_rad`: the full width between both directions.
    - `vibration_rms_rad_s`: RMS of each wrist's vibration rate.
    - `vibration_rad_s`, `settling_rad_s`: angular frequencies of the vibration's tones, and of the settling.
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
    """Errors of all six joints. `step` records reversals and stops; `true_state` returns the joints' true state."""

    def __init__(self, errors: Errors, random: Random) -> None:
        self._errors = errors
        self._phases = [[random.uniform(0.0, 2.0 * pi) for _ in range(3)] for _ in range(6)]
        self._direction = [0.0] * 6
        self._speed: Joints = ZERO
        self._reversal = [(0.0, 0.0)] * 6  # encoder's angle and hysteresis at the last reversal
        self._moving = [False] * 6
        self._stops = [(-inf, 0.0)] * 6  # time of the last stop, and the direction before it
        first, *more = errors.vibration_rad_s
        tones = [(first, [self._phases[joint][2] for joint in WRISTS])]
        tones += [(turn, [random.uniform(0.0, 2.0 * pi) for _ in WRISTS]) for turn in more]
        self._vibration = Vibration(errors.vibration_rms_rad_s, tones)
        self._settling = errors.settling_rad_s
        self._patience_s = NEGLIGIBLE_DECAY_TIMES * errors.settling_decay_s
        self._last = [(0.0, 0.0, 1.0, 0.0)] * 6  # last result: encoder's angle; true angle and its two derivatives
        self._is_current = [False] * 6
        self._rest: tuple[Joints, Joints] = ((), ())  # encoder and true angles at the last rest

    def step(self, time_s: float, smooth_qd_rad_s: Joints, q_rad: Callable[[], Joints]) -> None:
        """Update the errors at the end of a tick, from the joints' speeds without ripple and their angles.

        `q_rad` returns the angles; it is called only at reversals. Reversals are found in the speeds without ripple,
        because a joint's full speed also changes its sign when the joint settles or is shaken.
        """
        if smooth_qd_rad_s is self._speed:
            return
        self._speed = smooth_qd_rad_s
        for joint, speed in enumerate(smooth_qd_rad_s):
            moving = abs(speed) > MIN_SPEED_RAD_S
            if moving:
                direction = 1.0 if speed > 0.0 else -1.0
                if direction != self._direction[joint]:
                    angle = q_rad()[joint]
                    self._reversal[joint] = (angle, self._hysteresis(joint, angle)[0])
                    self._direction[joint] = direction
                    self._is_current[joint] = False
            elif self._moving[joint]:
                self._stops[joint] = (time_s, self._direction[joint])
            self._moving[joint] = moving

    def is_quiet(self, time_s: float) -> bool:
        """Return whether, at `time_s`, no joint vibrates and none still settles after a stop."""
        return not self._errors.vibration_rms_rad_s and not (
            self._errors.settling_rad and any(time_s - stop_s < self._patience_s for stop_s, _ in self._stops)
        )

    def true_state(self, time_s: float, q_rad: Joints, qd_rad_s: Joints, qdd_rad_s2: Joints) -> JointState:
        """Return true angles, speeds and accelerations, rad, for the encoders' values at a time."""
        if qd_rad_s is ZERO and q_rad is self._rest[0]:
            angles, speeds, accelerations = list(self._rest[1]), [0.0] * 6, [0.0] * 6
        else:
            angles, speeds, accelerations = self._encoder_to_true(q_rad, qd_rad_s, qdd_rad_s2)
            if qd_rad_s is ZERO:
                self._rest = q_rad, tuple(angles)
        if self._errors.settling_rad:
            for joint, (stop_s, direction) in enumerate(self._stops):
                if 0.0 <= time_s - stop_s < self._patience_s:
                    angle, speed, acceleration = self._settle(direction, time_s - stop_s)
                    angles[joint] += angle
                    speeds[joint] += speed
                    accelerations[joint] += acceleration
        if self._errors.vibration_rms_rad_s:
            return self._vibration.add(time_s, angles, speeds, accelerations)
        return tuple(angles), tuple(speeds), tuple(accelerations)

    def _encoder_to_true(
        self, q_rad: Joints, qd_rad_s: Joints, qdd_rad_s2: Joints
    ) -> tuple[list[float], list[float], list[float]]:
        """Return the joints' true angles, speeds and accelerations, without vibration and settling."""
        angles, speeds, accelerations = list(q_rad), list(qd_rad_s), list(qdd_rad_s2)
        for joint, (e, speed) in enumerate(zip(q_rad, qd_rad_s, strict=True)):
            if self._last[joint][0] != e or not self._is_current[joint]:  # most moves use few joints
                self._last[joint] = (e, *self._true_angle(joint, e))
                self._is_current[joint] = True
            _, angles[joint], gain, bend = self._last[joint]
            if speed or accelerations[joint]:
                speeds[joint] = gain * speed
                accelerations[joint] = gain * accelerations[joint] + bend * speed * speed
        return angles, speeds, accelerations

    def _true_angle(self, joint: int, e: float) -> tuple[float, float, float]:
        """Return a joint's true angle, rad, at its encoder's angle `e`, and two derivatives with respect to `e`."""
        errors, (once, twice, _) = self._errors, self._phases[joint]
        a, b = errors.encoder_once_rad, errors.encoder_twice_rad
        lag, slope, bend = self._hysteresis(joint, e)
        return (
            e + errors.zero_rad[joint] + a * sin(e + once) + b * sin(2.0 * e + twice) - lag,
            1.0 + a * cos(e + once) + 2.0 * b * cos(2.0 * e + twice) - slope,
            -a * sin(e + once) - 4.0 * b * sin(2.0 * e + twice) - bend,
        )

    def _hysteresis(self, joint: int, e: float) -> tuple[float, float, float]:
        """Return the joint's lag due to friction, rad, and its two derivatives with respect to the encoder's angle."""
        reversal_rad, lag = self._reversal[joint]
        end = 0.5 * self._errors.hysteresis_rad * self._direction[joint]
        excess = (lag - end) * exp(-abs(e - reversal_rad) / REVERSAL_RAD)
        return end + excess, -excess / REVERSAL_RAD * self._direction[joint], excess / REVERSAL_RAD**2

    def _settle(self, direction: float, elapsed_s: float) -> tuple[float, float, float]:
        """Return angle, rate and acceleration of the oscillation of a joint that stopped `elapsed_s` ago."""
        decay, turn = -1.0 / self._errors.settling_decay_s, self._settling
        size = self._errors.settling_rad * direction * exp(decay * elapsed_s)
        s, c = size * sin(turn * elapsed_s), size * cos(turn * elapsed_s)
        return s, decay * s + turn * c, (decay**2 - turn**2) * s + 2.0 * decay * turn * c
