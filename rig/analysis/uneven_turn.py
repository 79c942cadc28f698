"""How far the mean over a turn of a servo will be said to scatter: turns made up, averaged as recorded ones are. Pure.

The loop is closed over an encoder that errs once and twice a turn. So the shaft turns unevenly where its readings are
even: three times a turn, too, and the gear's ripple comes with two more lines on either side. Over a whole turn all of
that averages out. But what is too weak to be found as a line, or too near one, is taken for noise of a colour. How much
that is depends on how the speed, the noise and the data rate go together, and it differs from turn to turn.
"""

from functools import lru_cache

import numpy as np

from rig.estimation.arrays import Array
from rig.motion.steps import TURN_RAD
from rig.observation.averaging import BESIDE_LINES, Passing

# As simulated servos have it, no real one was measured: the gear's ripple, a share of the rate and how often it comes
# in a turn; the encoder's errors once and twice a turn, of the ±1.3° in all that an AS5045 may have; the servo's clock.
RIPPLE, PER_TURN = 0.07, 20
ONCE_RAD, TWICE_RAD = float(np.radians(1.0)), float(np.radians(0.3))
CLOCK = 3e-3
TURNS = 8  # made up, each with noise of its own, and with its readings at places of their own
ITERATIONS = 5  # the encoder's error is inverted to 1e-9 of it by then
ROUNDED = 0.01  # of the noise: a step of the readings
WORST_OF_THREE = 0.846  # standard deviations that the largest of three normal numbers lies over their mean


def scattering_variance(speed_rad_s: float, noise_rad_s: float, rate_hz: float, turns: int) -> float:
    """The variance in (rad/s)² of the mean of readings along the axis that turns, of which one has that noise.

    In the mean over so many `turns` about each of three axes, of that axis which comes off worst.
    """
    made_up = _made_up(round(speed_rad_s, 9), noise_rad_s, rate_hz)
    return float(np.mean(made_up) + WORST_OF_THREE * np.std(made_up, ddof=1) / np.sqrt(turns))


@lru_cache(maxsize=256)
def _made_up(speed_rad_s: float, noise_rad_s: float, rate_hz: float) -> tuple[float, ...]:
    rng = np.random.default_rng(TURNS)
    return tuple(_variance(speed_rad_s, noise_rad_s, rate_hz, rng) for _ in range(TURNS))


def _variance(speed_rad_s: float, noise_rad_s: float, rate_hz: float, rng: np.random.Generator) -> float:
    step_rad = speed_rad_s * (1 + CLOCK * rng.uniform(-1, 1)) / rate_hz
    angle_rad = np.arange(step_rad * rng.uniform(0, 1), TURN_RAD, step_rad)
    count = len(angle_rad)
    waves = np.array([wave(times * angle_rad) for times in (1, 2) for wave in (np.cos, np.sin)]).T
    passing = Passing(np.zeros(count), np.ones(count, dtype=np.bool_), waves)  # encoders see the strongest line alone
    rates = speed_rad_s * _unevenness(angle_rad, rng.uniform(0, TURN_RAD, 3))
    readings = np.column_stack([np.zeros((count, 2)), rates]) + noise_rad_s * rng.standard_normal((count, 3))
    return float(BESIDE_LINES.turned(readings, ROUNDED * noise_rad_s, passing).variance[2])


def _unevenness(driven_rad: Array, phases_rad: Array) -> Array:
    """(n,) the shaft's rate by that of its profile, where this has come to the angles `driven_rad` (n,)."""
    ripple, once, twice = phases_rad
    read = driven_rad + RIPPLE / PER_TURN * np.sin(PER_TURN * driven_rad + ripple)
    angle = read
    for _ in range(ITERATIONS):
        angle = read - ONCE_RAD * np.sin(angle + once) - TWICE_RAD * np.sin(2 * angle + twice)
    slope = 1 + ONCE_RAD * np.cos(angle + once) + 2 * TWICE_RAD * np.cos(2 * angle + twice)
    uneven: Array = (1 + RIPPLE * np.cos(PER_TURN * driven_rad + ripple)) / slope
    return uneven
