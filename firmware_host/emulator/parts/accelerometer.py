"""The simulated accelerometers: from the true specific force, through the part's errors and its noise, to counts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from firmware_host.emulator.parts.triad import Die, Seed, Temperature, Triad, TriadErrors, spawned

STANDARD_GRAVITY_M_S2 = 9.80665  # what a data sheet's g is
_AT_REST_G = (0.0, 0.0, 1.0)  # with z up
_SEED_KEY = 2  # of its randomness beside the gyroscope's and its drift's


@dataclass(frozen=True, slots=True)
class AccelerometerTruth:
    """What the simulated accelerometer really does: s = K (m + b) as for the gyroscope, m the reading, in m/s².

    `scale`, `non_orthogonality_rad`, `holds_at_c`, `bandwidth_hz`, `delay_s`, all of temperature, and the bias' drift:
    as in `GyroTruth`. `second_order_s2_m`: φ, by which each component of the specific force feels as s + φ s² before
    anything else becomes of it (TRIAX, a_m = F (s + φ s²) + b, where b is the negative of this one).
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
    """Three sensing axes with the errors of `truth`, or with none and without noise.

    `motion_at`, `seed`, `temperature_c`: those of the part's `Gyroscope`, whose noise stays what it is. A motion of 3
    components has no force: then the part rests with z up.
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
        """The next reading, (3,) m/s², taken at `time_s`; of the force only the fraction `settled` is felt."""
        delay_s = self._truth.delay_s if self._truth is not None else 0.0
        force_g = self._motion_at(time_s - delay_s)[3:] or _AT_REST_G
        force = [settled * STANDARD_GRAVITY_M_S2 * component for component in force_g]
        if self._truth is None or self._triad is None:
            return force
        warmer_k = self._triad.warmer_k(time_s)
        felt = self._triad.sense(_bent(self._truth, force), warmer_k)
        return self._triad.read(time_s, felt, warmer_k)


def accelerations(
    truth: AccelerometerTruth,
    time_s: np.ndarray,
    force_m_s2: np.ndarray,
    seed: Seed,
    temperature_c: float | Temperature = 25.0,
) -> np.ndarray:
    """The readings (n, 3) m/s² that an `Accelerometer` would take at `time_s` (n,) of a specific force (n, 3), before
    rounding to counts. The force of `truth.delay_s` before is interpolated in straight lines.
    """
    late_s = time_s - truth.delay_s
    force = [np.interp(late_s, time_s, column) for column in force_m_s2.T] if truth.delay_s else list(force_m_s2.T)
    triad = _triad(truth, seed, temperature_c)
    warmer_k = triad.all_warmer_k(time_s)
    return triad.readings(time_s, triad.sense(_bent(truth, force), warmer_k), warmer_k)


def _bent(truth: AccelerometerTruth, force: Sequence[Any]) -> list[Any]:
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
    return Triad(errors, spawned(seed, _SEED_KEY), temperature_c)
