"""Simulated gyroscopes and their averaged sweeps, vectorised over runs, as in section III of the paper SIX.

A sweep's mean reading is drawn directly. The mean of N samples with white noise σ is Gaussian with σ/√N, so samples are
not needed; if a study squares the samples first, the mean of the squares is drawn from its exact distribution, too.

There are two models of the servo's vibration, which the paper describes as "rotation noise" of 5 % of the speed:

`whole_turns`
    Vibration oscillates about the even turn, and integrates to the joint's whole turn. Its mean over the turn is zero
    by geometry, as with a servo that has a position loop.
`white`
    The speed of each sample is drawn independently. The mean speed of the sweep is then off by 5 % / √N: the joint
    misses its own end stop. The paper's wording suggests this model, but its figures do not.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.estimation.arrays import Array

Vibration = Literal["whole_turns", "white"]

RATE_HZ = 200.0  # SIX, section III-A
NOISE_LEVELS_RAD_S = (0.035, 0.2)
VIBRATION_FRACTION = 0.05
MAX_MISALIGNMENT = 0.1
FAST_SPEED_RAD_S = 3.0  # the speed at which simulated errors agree with the published bands
ARM_SPEED_RAD_S = np.pi / 3  # SIX, section IV: 60°/s
SETS, RUNS = 30, 500

# SIX, Fig. 1, in the order of Eq. (7): clockwise and counter-clockwise along x, y, z.
DIRECTIONS: Array = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Population:
    """Uniform ranges of gyroscopes: scale factors, and magnitudes of the bias, whose sign is random."""

    name: str
    scale: tuple[float, float]
    bias_rad_s: tuple[float, float]

    def draw(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """Draw scale factors (3,) and biases (3,), rad/s, of one gyroscope."""
        sign = rng.choice([-1.0, 1.0], size=3)
        return rng.uniform(*self.scale, size=3), sign * rng.uniform(*self.bias_rad_s, size=3)


NORMAL = Population("normal", (0.8, 1.2), (0.0, 0.1))
EXTREME = Population("extreme", (1.2, 2.0), (0.1, 0.2))


@dataclass(frozen=True, slots=True)
class SimulatedSweep:
    """The properties of all six sweeps of a run: turn rate, noise of a sample, number of samples, kind of vibration."""

    speed_rad_s: float
    noise_rad_s: float
    samples: int
    vibration: Vibration = "whole_turns"

    @property
    def variance_rad2_s2(self) -> float:
        """Variance of a mean reading due to the sensor's noise alone."""
        return self.noise_rad_s**2 / self.samples


def count_turn_samples(speed_rad_s: float) -> int:
    """Return the number of samples in one revolution."""
    return round(RATE_HZ * 2 * np.pi / speed_rad_s)


def build_whole_turn(speed_rad_s: float, noise_rad_s: float, vibration: Vibration = "whole_turns") -> SimulatedSweep:
    """Return a sweep of one revolution sampled at 200 Hz."""
    return SimulatedSweep(speed_rad_s, noise_rad_s, count_turn_samples(speed_rad_s), vibration)


def draw_mountings(rng: np.random.Generator, runs: int, largest: float = MAX_MISALIGNMENT) -> Array:
    """Draw rotations (runs, 3, 3) from flange to sensor axes; each is about a random axis.

    The sine of the angle is uniformly distributed from 0 to `largest`. The paper states only "misalignment U(0 %,
    10 %)", taken here as the fraction of a rate that other axes sense.
    """
    from scipy.spatial.transform import Rotation

    axis = rng.normal(size=(runs, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    angle = np.arcsin(rng.uniform(0.0, largest, size=(runs, 1)))
    return np.asarray(Rotation.from_rotvec(angle * axis).as_matrix(), dtype=np.float64)


def build_sensitivity(scale: Array, mounting: Array, skew: Array | None = None) -> Array:
    """Return the matrix F (…, 3, 3) of m = F ω − b, from scale factors (3,) and mountings (…, 3, 3).

    The rows of `skew` (…, 3, 3) are unit vectors of non-orthogonal sensor axes; None stands for orthogonal axes.
    """
    intrinsic = np.diag(1 / scale) if skew is None else np.diag(1 / scale) @ skew
    return np.asarray(intrinsic @ mounting, dtype=np.float64)


def draw_mean_readings(rng: np.random.Generator, F: Array, bias_rad_s: Array, sweep: SimulatedSweep) -> Array:
    """Draw the mean readings (…, 6, 3), rad/s, of the six sweeps of sensors with F (…, 3, 3)."""
    return _draw_means(rng, F, bias_rad_s, sweep)[0]


def draw_means_and_squares(
    rng: np.random.Generator, F: Array, bias_rad_s: Array, sweep: SimulatedSweep
) -> tuple[Array, Array]:
    """Draw averages of readings and of their squares, both (…, 6, 3), of the same samples, exactly.

    Let d = n + c v be the deviation of one of N samples from the mean, with noise n of standard deviation σ, and the
    vibration v common to the axes, which an axis reads as c v. v enters through Σ(v − v̄)² ~ χ²(N − 1), the noise along
    v through one Gaussian z, and the remaining noise through χ²(N − 2), so that Σ(d − d̄)² = (σ z + c √Σ(v − v̄)²)² + σ²
    χ²(N − 2).
    """
    mean, per_vibration = _draw_means(rng, F, bias_rad_s, sweep)
    shape, count = mean.shape, sweep.samples
    vibration_size = VIBRATION_FRACTION * sweep.speed_rad_s * np.sqrt(rng.chisquare(count - 1, size=(*shape[:-1], 1)))
    axis_noise = sweep.noise_rad_s * rng.normal(size=shape) + per_vibration * vibration_size
    scatter = axis_noise**2 + sweep.noise_rad_s**2 * rng.chisquare(count - 2, size=shape)
    return mean, mean**2 + scatter / count


def _draw_means(rng: np.random.Generator, F: Array, bias_rad_s: Array, sweep: SimulatedSweep) -> tuple[Array, Array]:
    """Return drawn mean readings (…, 6, 3) of six turns, and the readings (…, 6, 3) per rad/s of turn rate."""
    per_rate = np.asarray(np.einsum("...ij,sj->...si", F, DIRECTIONS), dtype=np.float64)
    speed: Array | float = sweep.speed_rad_s
    if sweep.vibration == "white":
        error = VIBRATION_FRACTION * sweep.speed_rad_s / np.sqrt(sweep.samples)
        speed = sweep.speed_rad_s + error * rng.normal(size=(*per_rate.shape[:-1], 1))
    noise = np.sqrt(sweep.variance_rad2_s2) * rng.normal(size=per_rate.shape)
    return np.asarray(speed * per_rate - bias_rad_s + noise, dtype=np.float64), per_rate
