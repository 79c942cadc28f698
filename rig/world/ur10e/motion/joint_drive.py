"""The response of a joint to its target: lag, deflection by acceleration, and the ripple of its harmonic drive.

The joint's angle is u(t − lag) + y + p. u is the target. y is the deflection: a critically damped second-order system
follows −`yield_s2` times the target's mean acceleration of the last 12 ms, within a bound. p is the ripple, a function
of angle and speed v: p = v/(v² + v₀²) Σ Rₙ/n sin(n u + φₙ), with n cycles a turn, amplitude Rₙ and phase φₙ. At speeds
far above v₀ the ripple's rate is Σ Rₙ cos(n u + φₙ), whatever the speed; a joint at rest is exactly on its target. Over
a whole turn at constant speed p adds nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, exp, pi, sin, sqrt
from random import Random
from typing import NamedTuple

from rig.config.world.arm_joints import SimulatedDriveSection
from rig.world.clock import TICK_S

RIPPLE_SPEED_RAD_S = 0.1  # v₀ of the ripple
RIPPLE_SPEED_SQUARED = RIPPLE_SPEED_RAD_S**2
PARALLEL_JOINTS = {1: (2,), 2: (1, 3), 3: (2,)}  # shoulder, elbow and wrist 1 have parallel axes
MAX_YIELD_RAD = 3e-4  # in logs no joint errs by more than 0.7 to 1 mrad, including the lag
NEGLIGIBLE_RAD, NEGLIGIBLE_RAD_S = 1e-9, 1e-7  # a smaller deflection counts as none
RippleOrders = tuple[tuple[int, float, float], ...]  # cycles a turn, Rₙ/n in rad/s, phase in rad
Derivatives = tuple[float, float, float]  # an angle in rad and its first two derivatives
# A joint, and the angle and its derivatives that are added to its smooth angle.
Shaken = tuple[int, float, float, float]


class Deflection(NamedTuple):
    """The deflection, rad, of a joint that yields to its acceleration, at a time t (s) in a tick.

    The deflection is end + (start + slope t) exp(−t/τ), with τ the drive's `yield_time_s`.
    """

    joint: int
    end_rad: float
    start_rad: float
    slope_rad_s: float


@dataclass(frozen=True, slots=True)
class JointDrive:
    """The drives of all six joints. All fields except `orders` are keys of `world.arm.drive`, in rad and s.

    `orders`: for each joint the components (n, Rₙ/n, φₙ) of its ripple, as in the module's equation.
    """

    orders: tuple[RippleOrders, ...] = ((),) * 6
    lag_s: float = 0.0
    yield_s2: float = 0.0
    yield_time_s: float = 0.01
    crosstalk: float = 0.0

    def shake(self, joint: int, u: float, v: float, a: float) -> list[Shaken]:
        """Return the ripple of a joint whose motion without ripple has angle `u`, rate `v`, acceleration `a` (rad, s).

        A ripple is (joint, angle, rate, acceleration). With crosstalk, a fraction of the ripple of this joint is also
        returned for each neighbour with a parallel axis.
        """
        # p = A(v) S(u) with A = v/(v² + v₀²), S = Σ Rₙ/n sin(n u + φₙ), and its first two derivatives over time.
        sines = cosines = bends = 0.0  # S, dS/du and −d²S/du²
        for n, amplitude, phase in self.orders[joint]:
            angle = n * u + phase
            sine, cosine = amplitude * sin(angle), amplitude * n * cos(angle)
            sines += sine
            cosines += cosine
            bends += n * n * sine
        square = v * v + RIPPLE_SPEED_SQUARED
        size = v / square
        if a:
            growth = (RIPPLE_SPEED_SQUARED - v * v) / (square * square) * a  # dA/dt, at constant acceleration
            bend = 2.0 * v * (v * v - 3.0 * RIPPLE_SPEED_SQUARED) / (square * square * square) * a * a  # d²A/dt²
            angle, rate = size * sines, growth * sines + size * v * cosines
            change = bend * sines + 2.0 * growth * v * cosines + size * (a * cosines - v * v * bends)
        else:
            angle, rate, change = size * sines, size * v * cosines, -size * v * v * bends
        shaken = [(joint, angle, rate, change)]
        c = self.crosstalk
        if c and joint in PARALLEL_JOINTS:
            shaken += [(other, c * angle, c * rate, c * change) for other in PARALLEL_JOINTS[joint]]
        return shaken

    def advance(self, before: Sequence[Deflection], change_rad_s: Sequence[float]) -> tuple[Deflection, ...]:
        """Return the joints' deflections in the next tick, if their targets' rates change by `change_rad_s`.

        `before` has the deflections in the last tick. Joints that are not deflected are left out of `before` and of the
        result.
        """
        if not self.yield_s2 or not (before or any(change_rad_s)):
            return ()
        at_tick_end = {deflection.joint: self.deflection_at(deflection, TICK_S) for deflection in before}
        deflections = []
        for joint, change in enumerate(change_rad_s):
            angle, rate, _ = at_tick_end.get(joint, (0.0, 0.0, 0.0))
            if change or abs(angle) > NEGLIGIBLE_RAD or abs(rate) > NEGLIGIBLE_RAD_S:
                end = -max(-MAX_YIELD_RAD, min(self.yield_s2 * change / TICK_S, MAX_YIELD_RAD))
                start, slope = angle - end, rate + (angle - end) / self.yield_time_s
                deflections.append(Deflection(joint, end, start, slope))
        return tuple(deflections)

    def deflection_at(self, deflection: Deflection, elapsed_s: float) -> Derivatives:
        """Return a joint's deflection `elapsed_s` after the start of the tick, and its derivatives."""
        per_s = 1.0 / self.yield_time_s
        decay = exp(-elapsed_s * per_s)
        remainder = (deflection.start_rad + deflection.slope_rad_s * elapsed_s) * decay
        slope = deflection.slope_rad_s * decay
        return deflection.end_rad + remainder, slope - remainder * per_s, (remainder * per_s - 2.0 * slope) * per_s


def build_drive(section: SimulatedDriveSection, seed: int) -> JointDrive:
    """Return the drives of a simulated arm. The phases of the ripple are drawn with the simulated laboratory's seed."""
    random = Random(f"drive {seed}")
    orders = tuple(
        tuple(
            (part.cycles_per_turn, sqrt(2.0) * rms / part.cycles_per_turn, random.uniform(0.0, 2.0 * pi))
            for part in section.ripple
            if (rms := part.rms_rad_s[joint])
        )
        for joint in range(6)
    )
    return JointDrive(orders, section.lag_s, section.yield_s2, section.yield_time_s, section.crosstalk)
