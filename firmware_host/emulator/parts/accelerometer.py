"""The simulated accelerometers: from the true specific force, through the part's errors and its noise, to readings."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from firmware_host.emulator.parts.triad import Die, Seed, Temperature, Triad, TriadErrors, spawn_seed

STANDARD_GRAVITY_M_S2 = 9.80665  # the g of data sheets
_AT_REST_G = (0.0, 0.0, 1.0)  # with z up
_SEED_KEY = 2  # the key of its random stream, apart from the gyroscope's and its drift's


@dataclass(frozen=True, slots=True)
class AccelerometerTruth:
    """The true errors of a simulated accelerometer in the model s = K (m + b): force s and reading m, both in m/s².

    - `scale`, `bias_m_s2`, `noise_m_s2`, `non_orthogonality_rad`: as in `GyroTruth`.
    - `second_order_s2_m`: φ; each component s of the specific force is sensed as s + φ s² before the other errors. The
      paper TRIAX writes a_m = F (s + φ s²) + b, where b has the opposite sign.
    - `holds_at_c`, `bandwidth_hz`, `delay_s`, the bias' drift and all fields of temperature: as in `GyroTruth`.
    """

    scale: Sequence[float] = (1.0, 1.0, 1.0)
    bias_m_s2: Sequence[float] = (0.0, 0.0, 0.0)
    noise_m_s2: float = 0.0
    non_orthogonality_rad: Sequence[float] = (0.0, 0.0, 0.0)
    second_order_s2_m: Sequence[float] = (0.0, 0.0, 0.0)
    scale_per_k: Sequence[float] = (0.0, 0.0, 0.0)
    bias_m_s2_per_k: Sequence[float] = (0.0, 0.0, 0.0)
    holds_at_c: float = 25.0
    bandwidth_hz: float | None = None
    delay_s: float = 0.0
    instability_m_s2: float = 0.0
    instability_time_s: float = 100.0
    random_walk_m_s2_per_sqrt_s: float = 0.0
    scale_per_k2: Sequence[float] = (0.0, 0.0, 0.0)
    bias_m_s2_per_k2: Sequence[float] = (0.0, 0.0, 0.0)
    hysteresis_m_s2: Sequence[float] = (0.0, 0.0, 0.0)
    die: Die | None = None


class Accelerometer:
    """Three sensing axes with the errors of `truth`, or without errors and noise if `truth` is None.

    `motion_at`, `seed`, `temperature_c`: as for the part's `Gyroscope`; the noise of the two is independent. If the
    motion has only the 3 components of the rate, the part rests with z up.
    """

    def __init__(
        self,
        motion_at: Callable[[float], Sequence[float]],
        truth: AccelerometerTruth | None,
        seed: Seed,
        temperature_c: float | Temperature = 25.0,
    ) -> None:
        self._motion_at = motion_at
        self._truth = truth
        self._triad = _triad(truth, seed, temperature_c) if truth is not None else None

    def read(self, time_s: float, settled: float = 1.0) -> list[float]:
        """Return the next reading, (3,) m/s², at `time_s`. The part senses the fraction `settled` of the force."""
        delay_s = self._truth.delay_s if self._truth is not None else 0.0
        force_g = self._motion_at(time_s - delay_s)[3:] or _AT_REST_G
        force = [settled * STANDARD_GRAVITY_M_S2 * component for component in force_g]
        if self._truth is None or self._triad is None:
            return force
        warmer_k = self._triad.warmer_k(time_s)
        sensed = self._triad.sense(_apply_second_order(self._truth, force), warmer_k)
        return self._triad.read(time_s, sensed, warmer_k)


def accelerations(
    truth: AccelerometerTruth,
    time_s: np.ndarray,
    force_m_s2: np.ndarray,
    seed: Seed,
    temperature_c: float | Temperature = 25.0,
) -> np.ndarray:
    """Return the unrounded readings (n, 3), m/s², of an `Accelerometer` at `time_s` (n,) for a specific force (n, 3).

    The force is delayed by `truth.delay_s`, with linear interpolation.
    """
    late_s = time_s - truth.delay_s
    force = [np.interp(late_s, time_s, column) for column in force_m_s2.T] if truth.delay_s else list(force_m_s2.T)
    triad = _triad(truth, seed, temperature_c)
    warmer_k = triad.all_warmer_k(time_s)
    return triad.readings(time_s, triad.sense(_apply_second_order(truth, force), warmer_k), warmer_k)


def _apply_second_order(truth: AccelerometerTruth, force: Sequence[Any]) -> list[Any]:
    return [s + phi * s * s for s, phi in zip(force, truth.second_order_s2_m, strict=True)]


def _triad(truth: AccelerometerTruth, seed: Seed, temperature_c: float | Temperature) -> Triad:
    errors = TriadErrors(
        scale=truth.scale,
        bias=truth.bias_m_s2,
        noise=truth.noise_m_s2,
        non_orthogonality_rad=truth.non_orthogonality_rad,
        scale_per_k=truth.scale_per_k,
        bias_per_k=truth.bias_m_s2_per_k,
        holds_at_c=truth.holds_at_c,
        bandwidth_hz=truth.bandwidth_hz,
        instability=truth.instability_m_s2,
        instability_time_s=truth.instability_time_s,
        random_walk_per_sqrt_s=truth.random_walk_m_s2_per_sqrt_s,
        scale_per_k2=truth.scale_per_k2,
        bias_per_k2=truth.bias_m_s2_per_k2,
        hysteresis=truth.hysteresis_m_s2,
        die=truth.die,
    )
    return Triad(errors, spawn_seed(seed, _SEED_KEY), temperature_c)
