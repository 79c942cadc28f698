"""The common part of all simulated gyroscopes: from the true motion, through errors and noise, to readings."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from firmware_host.emulator.parts.triad import Die, Nonlinearity, Seed, Temperature, Triad, TriadErrors, saturate

__all__ = ["GyroTruth", "Gyroscope", "Temperature", "Warming", "readings", "saturate"]


@dataclass(frozen=True, slots=True)
class GyroTruth:
    """The true errors of a simulated gyroscope, in the model g = K (m + b): rate g, reading m (paper SIX, Eq. (3)).

    - `scale`: the diagonal of K.
    - `bias_rad_s`: b, in the units of the reading.
    - `noise_rad_s`: the standard deviation of one reading.
    - `non_orthogonality_rad` (xy, xz, yz): the y axis is tilted by xy towards x, the z axis by xz towards x and by yz
      towards y.

    Errors beyond the model:

    - `scale_per_k`, `bias_rad_s_per_k`, `scale_per_k2`, `bias_rad_s_per_k2`: the changes of K (as a fraction) and of b
      per degree above `holds_at_c`, and per square of a degree.
    - `g_sensitivity_rad_s_per_g` (3 rows, or none): the change of a reading per g of specific force along x, y, z.
    - `nonlinearity_even_per_rad_s`, `nonlinearity_odd_per_rad_s`: the fractions by which a reading grows per rad/s of
      the rate along its axis, and per rad/s of that rate's magnitude.
    - `bandwidth_hz`, `delay_s`: a low-pass of first order (None: no filter) and a delay, which noise and bias bypass.
    - `instability_rad_s`, `instability_time_s`, `random_walk_rad_s_per_sqrt_s`: the bias drift, see `Drift`.
    - `hysteresis_rad_s`: b is larger by this after warming, smaller by this after cooling.
    - `die`: the structure whose temperature determines all these, if it is not the thermometer's.
    """

    scale: Sequence[float] = (1.0, 1.0, 1.0)
    bias_rad_s: Sequence[float] = (0.0, 0.0, 0.0)
    noise_rad_s: float = 0.0
    non_orthogonality_rad: Sequence[float] = (0.0, 0.0, 0.0)
    scale_per_k: Sequence[float] = (0.0, 0.0, 0.0)
    bias_rad_s_per_k: Sequence[float] = (0.0, 0.0, 0.0)
    holds_at_c: float = 25.0
    g_sensitivity_rad_s_per_g: Sequence[Sequence[float]] = ()
    nonlinearity_even_per_rad_s: float = 0.0
    nonlinearity_odd_per_rad_s: float = 0.0
    bandwidth_hz: float | None = None
    delay_s: float = 0.0
    instability_rad_s: float = 0.0
    instability_time_s: float = 100.0
    random_walk_rad_s_per_sqrt_s: float = 0.0
    scale_per_k2: Sequence[float] = (0.0, 0.0, 0.0)
    bias_rad_s_per_k2: Sequence[float] = (0.0, 0.0, 0.0)
    hysteresis_rad_s: Sequence[float] = (0.0, 0.0, 0.0)
    die: Die | None = None


@dataclass(frozen=True, slots=True)
class Warming:
    """The temperature of a part with power from `begins_s` on: from `start_c` to `final_c`, exponentially."""

    start_c: float
    final_c: float
    time_constant_s: float
    begins_s: float = 0.0

    def __call__(self, time_s: float) -> float:
        powered_s = max(0.0, time_s - self.begins_s)
        return self.final_c + (self.start_c - self.final_c) * math.exp(-powered_s / self.time_constant_s)


class Gyroscope:
    """Three sensing axes with the errors of `truth`.

    `motion_at(time_s)` returns the true angular rate in the part's own axes, 3 floats, rad/s, and for a part with
    g-sensitivity also the specific force there, 3 floats, g. It is evaluated once for each reading, for the time
    `truth.delay_s` before. `seed` is that of noise and drift; noise is drawn for each reading. `temperature_c` is the
    part's temperature, one number or a function of time.
    """

    def __init__(
        self,
        motion_at: Callable[[float], Sequence[float]],
        truth: GyroTruth,
        seed: Seed,
        temperature_c: float | Temperature = 25.0,
    ) -> None:
        self._motion_at = motion_at
        self._truth = truth
        self._triad = _triad(truth, seed, temperature_c)
        self._nonlinearity = _nonlinearity(truth)
        self.temperature_c = self._triad.temperature_c

    def read(self, time_s: float, settled: float = 1.0) -> list[float]:
        """Return the next reading, (3,) rad/s, at `time_s`. The part senses the fraction `settled` of the motion."""
        motion = self._motion_at(time_s - self._truth.delay_s)
        if settled != 1.0:
            motion = [settled * component for component in motion]
        warmer_k = self._triad.warmer_k(time_s)
        return self._triad.read(
            time_s, _sense_motion(self._triad, self._truth, motion, warmer_k, self._nonlinearity), warmer_k
        )


def readings(
    truth: GyroTruth, time_s: np.ndarray, motion: np.ndarray, seed: Seed, temperature_c: float | Temperature = 25.0
) -> np.ndarray:
    """Return the unrounded readings (n, 3), rad/s, of a `Gyroscope` at `time_s` (n,) for a `motion` (n, 3 or 6).

    The motion is delayed by `truth.delay_s`, with linear interpolation.
    """
    late_s = time_s - truth.delay_s
    delayed = [np.interp(late_s, time_s, column) for column in motion.T] if truth.delay_s else list(motion.T)
    triad = _triad(truth, seed, temperature_c)
    warmer_k = triad.all_warmer_k(time_s)
    return triad.readings(time_s, _sense_motion(triad, truth, delayed, warmer_k, _nonlinearity(truth)), warmer_k)


def _sense_motion(
    triad: Triad, truth: GyroTruth, motion: Sequence[Any], warmer_k: Any, nonlinearity: Nonlinearity | None
) -> list[Any]:
    """Return the sensed rates for a motion of 3 or 6 components, floats or arrays, before bias and noise."""
    sensed = triad.sense(motion[:3], warmer_k, nonlinearity)
    if truth.g_sensitivity_rad_s_per_g:
        x, y, z = motion[3:]
        rows = zip(sensed, truth.g_sensitivity_rad_s_per_g, strict=True)
        sensed = [value + (row[0] * x + row[1] * y + row[2] * z) for value, row in rows]
    return sensed


def _nonlinearity(truth: GyroTruth) -> Nonlinearity | None:
    even, odd = truth.nonlinearity_even_per_rad_s, truth.nonlinearity_odd_per_rad_s
    return (lambda rate: rate * (1.0 + even * rate + odd * abs(rate))) if even or odd else None


def _triad(truth: GyroTruth, seed: Seed, temperature_c: float | Temperature) -> Triad:
    errors = TriadErrors(
        scale=truth.scale,
        bias=truth.bias_rad_s,
        noise=truth.noise_rad_s,
        non_orthogonality_rad=truth.non_orthogonality_rad,
        scale_per_k=truth.scale_per_k,
        bias_per_k=truth.bias_rad_s_per_k,
        holds_at_c=truth.holds_at_c,
        bandwidth_hz=truth.bandwidth_hz,
        instability=truth.instability_rad_s,
        instability_time_s=truth.instability_time_s,
        random_walk_per_sqrt_s=truth.random_walk_rad_s_per_sqrt_s,
        scale_per_k2=truth.scale_per_k2,
        bias_per_k2=truth.bias_rad_s_per_k2,
        hysteresis=truth.hysteresis_rad_s,
        die=truth.die,
    )
    return Triad(errors, seed, temperature_c)
