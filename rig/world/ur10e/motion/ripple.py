"""The servo's vibration: a position ripple locked to the joint's angle, so that whole turns integrate exactly.

The joint's angle is q = u + Σ Aₙ sin(n u + φₙ), with u the angle without ripple and, for n whole cycles a turn, the
amplitude Aₙ and phase φₙ. After a turn of u the joint has made a turn too, regardless of the ripple; the mean speed in
the paper SIX, section on vibration, requires this.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, pi, sin, sqrt
from random import Random


@dataclass(frozen=True, slots=True)
class Ripple:
    """One joint's ripple: (cycles a turn, amplitude rad, phase rad) of each component."""

    components: tuple[tuple[int, float, float], ...] = ()

    def angle(self, smooth_rad: float) -> float:
        """Return the joint's angle, rad, from its angle without ripple."""
        ripple = 0.0
        for n, a, phase in self.components:
            ripple += a * sin(n * smooth_rad + phase)
        return smooth_rad + ripple

    def gain(self, smooth_rad: float) -> float:
        """Return the exact derivative of the joint's angle with respect to its angle without ripple."""
        ripple = 0.0
        for n, a, phase in self.components:
            ripple += a * n * cos(n * smooth_rad + phase)
        return 1.0 + ripple

    def bend(self, smooth_rad: float) -> float:
        """Return the second derivative of the joint's angle with respect to its angle without ripple."""
        ripple = 0.0
        for n, a, phase in self.components:
            ripple += a * n * n * sin(n * smooth_rad + phase)
        return -ripple

    def smooth(self, angle_rad: float) -> float:
        """Return an angle without ripple for the joint's angle `angle_rad`, by bisection, valid for any amplitude."""
        if not self.components:
            return angle_rad
        reach = sum(a for _, a, _ in self.components)
        low, high = angle_rad - reach, angle_rad + reach
        for _ in range(60):
            middle = 0.5 * (low + high)
            if self.angle(middle) < angle_rad:
                low = middle
            else:
                high = middle
        return 0.5 * (low + high)


def draw_ripple(fraction: float, cycles_per_turn: Sequence[int], random: Random) -> Ripple:
    """Return a ripple of random phases, whose components have angular rates of equal amplitude.

    The ripple's RMS rate is `fraction` of the joint's rate.
    """
    if fraction == 0.0:
        return Ripple()
    rate = fraction * sqrt(2.0 / len(cycles_per_turn))
    return Ripple(tuple((n, rate / n, random.uniform(0.0, 2.0 * pi)) for n in cycles_per_turn))
