"""What all simulated gyroscopes share: from the true motion, through the part's errors and its noise, to counts."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from firmware_host.emulator.drift import Drift

_NOISE_BLOCK = 3 * 256

Temperature = Callable[[float], float]


@dataclass(frozen=True, slots=True)
class GyroTruth:
    """What the simulated gyroscope really does, in the model g = K (m + b) with m the reading (SIX, Eq. (3)).

    `scale`: diagonal of K; `bias_rad_s`: b, in the units of the reading; `noise_rad_s`: standard deviation of one
    reading; `non_orthogonality_rad` (xy, xz, yz): the y axis leans by xy towards x, the z axis by xz towards x and
    by yz towards y.

    What the model leaves out, and a real part has: `scale_per_k` and `bias_rad_s_per_k`, by how much K (as a fraction)
    and b grow per degree above `holds_at_c`; `g_sensitivity_rad_s_per_g` (3 rows, or none): what a reading gains per g
    of specific force along x, y, z; `nonlinearity_even_per_rad_s` and `nonlinearity_odd_per_rad_s`: by which fraction
    a reading grows with the rate along its axis, and with the rate's magnitude; a low-pass of first order with
    `bandwidth_hz` (none: no filter), `delay_s` late, that noise and bias do not pass; the bias' drift, see `Drift`.
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


@dataclass(frozen=True, slots=True)
class Warming:
    """The temperature of a part that gets power at `begins_s`: from `start_c` to `final_c`, exponentially."""

    start_c: float
    final_c: float
    time_constant_s: float
    begins_s: float = 0.0

    def __call__(self, time_s: float) -> float:
        since_s = max(0.0, time_s - self.begins_s)
        return self.final_c + (self.start_c - self.final_c) * math.exp(-since_s / self.time_constant_s)


class Gyroscope:
    """Three sensing axes with the errors of `truth`.

    `motion_at(time_s)`: true angular rate in the part's own axes, 3 floats, rad/s, and for a part with g-sensitivity
    the specific force there, 3 floats more, g; asked once for each reading, `truth.delay_s` back. `seed`: of noise and
    drift; the noise is drawn per reading. `temperature_c`: the die's, or a function of time.
    """

    def __init__(
        self,
        motion_at: Callable[[float], Sequence[float]],
        truth: GyroTruth,
        seed: int | np.random.SeedSequence,
        temperature_c: float | Temperature = 25.0,
    ) -> None:
        self._motion_at = motion_at
        self._axes = _Axes(truth)
        self._truth = truth
        self._bias = list(truth.bias_rad_s)
        self._noise_rad_s = truth.noise_rad_s
        self._warms = callable(temperature_c)
        self.temperature_c: Temperature = temperature_c if callable(temperature_c) else lambda _time_s: temperature_c
        self._low_pass = LowPass(truth.bandwidth_hz) if truth.bandwidth_hz is not None else None
        self._drift = _drift(truth, seed)
        self._random = np.random.default_rng(seed)
        self._noise: list[float] = []

    def read(self, time_s: float, settled: float = 1.0) -> list[float]:
        """The next reading, (3,) rad/s, taken at `time_s`; of the motion only the fraction `settled` is felt."""
        if len(self._noise) < 3:
            self._noise = self._random.standard_normal(_NOISE_BLOCK).tolist()[::-1]
        motion = [settled * component for component in self._motion_at(time_s - self._truth.delay_s)]
        warmer_k = self.temperature_c(time_s) - self._truth.holds_at_c if self._warms else 0.0
        felt = self._axes.sense(motion, warmer_k)
        if self._low_pass is not None:
            felt = self._low_pass.step(time_s, felt)
        bias = self._bias
        if warmer_k:
            bias = [b + per_k * warmer_k for b, per_k in zip(bias, self._truth.bias_rad_s_per_k, strict=True)]
        if self._drift is not None:
            bias = [b + drift for b, drift in zip(bias, self._drift.at(time_s), strict=True)]
        return [value - b + self._noise_rad_s * self._noise.pop() for value, b in zip(felt, bias, strict=True)]


def readings(
    truth: GyroTruth,
    time_s: np.ndarray,
    motion: np.ndarray,
    seed: int | np.random.SeedSequence,
    temperature_c: float | Temperature = 25.0,
) -> np.ndarray:
    """The readings (n, 3) rad/s that a `Gyroscope` would take at `time_s` (n,) of a `motion` (n, 3 or 6), before
    rounding to counts. The motion of `truth.delay_s` before is interpolated in straight lines.
    """
    late_s = time_s - truth.delay_s
    felt_then = [np.interp(late_s, time_s, column) for column in motion.T] if truth.delay_s else list(motion.T)
    warmer_k = (
        np.array([temperature_c(t) for t in time_s.tolist()]) - truth.holds_at_c if callable(temperature_c) else 0.0
    )
    felt = np.column_stack(_Axes(truth).sense(felt_then, warmer_k))
    if truth.bandwidth_hz is not None:
        low_pass = LowPass(truth.bandwidth_hz)
        felt = np.array([low_pass.step(t, row) for t, row in zip(time_s.tolist(), felt.tolist(), strict=True)])
    bias = np.array(truth.bias_rad_s) + np.multiply.outer(warmer_k, np.array(truth.bias_rad_s_per_k))
    if (drift := _drift(truth, seed)) is not None:
        bias = bias + drift.at_times(time_s)
    noise = np.random.default_rng(seed).standard_normal(felt.shape)
    taken: np.ndarray = felt - bias + truth.noise_rad_s * noise
    return taken


class _Axes:
    """What the three elements make of a motion before bias and noise."""

    def __init__(self, truth: GyroTruth) -> None:
        xy, xz, yz = truth.non_orthogonality_rad
        self._axes = (
            (1.0, 0.0, 0.0),
            (math.sin(xy), math.cos(xy), 0.0),
            (math.sin(xz), math.sin(yz), math.sqrt(1 - math.sin(xz) ** 2 - math.sin(yz) ** 2)),
        )
        self._inverse_scale = [1 / k for k in truth.scale]
        self._per_k = truth.scale_per_k
        self._per_g = truth.g_sensitivity_rad_s_per_g
        self._even, self._odd = truth.nonlinearity_even_per_rad_s, truth.nonlinearity_odd_per_rad_s

    def sense(self, motion: Sequence[Any], warmer_k: Any) -> list[Any]:
        """Three components, floats or arrays as those of the motion (3 or 6) and `warmer_k` are."""
        x, y, z, *force = motion
        felt = []
        for index, (axis, inverse_scale) in enumerate(zip(self._axes, self._inverse_scale, strict=True)):
            along = axis[0] * x + axis[1] * y + axis[2] * z
            if self._even or self._odd:
                along = along * (1.0 + self._even * along + self._odd * abs(along))
            value = along * inverse_scale
            if self._per_k[index]:
                value = value / (1.0 + self._per_k[index] * warmer_k)
            if self._per_g:
                row = self._per_g[index]
                value = value + (row[0] * force[0] + row[1] * force[1] + row[2] * force[2])
            felt.append(value)
        return felt


class LowPass:
    """A low-pass of first order, exact for inputs that are straight lines between the times they are given at."""

    def __init__(self, bandwidth_hz: float) -> None:
        self._time_constant_s = 1.0 / (2.0 * math.pi * bandwidth_hz)
        self._time_s = -math.inf
        self._inputs: list[float] = []
        self._outputs: list[float] = []

    def step(self, time_s: float, inputs: list[float]) -> list[float]:
        """The outputs at `time_s`, when the inputs have come to these."""
        since_s = time_s - self._time_s
        if math.isinf(since_s):
            self._outputs = inputs
        elif since_s > 0.0:
            forgotten = math.exp(-since_s / self._time_constant_s)
            late = self._time_constant_s / since_s  # by how much of the step the output of a straight line lags
            self._outputs = [
                new - late * (new - old) + (output - old + late * (new - old)) * forgotten
                for new, old, output in zip(inputs, self._inputs, self._outputs, strict=True)
            ]
        self._time_s, self._inputs = time_s, inputs
        return self._outputs


def _drift(truth: GyroTruth, seed: int | np.random.SeedSequence) -> Drift | None:
    if not (truth.instability_rad_s or truth.random_walk_rad_s_per_sqrt_s):
        return None
    sequence = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    own = np.random.SeedSequence(sequence.entropy, spawn_key=(*sequence.spawn_key, 1))
    return Drift(truth.instability_rad_s, truth.instability_time_s, truth.random_walk_rad_s_per_sqrt_s, own)


def saturated(counts: int, bits: int = 16) -> int:
    """The nearest number that a two's complement register of so many bits holds."""
    limit = 1 << bits - 1
    return max(-limit, min(limit - 1, counts))
