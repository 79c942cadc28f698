"""Three sensing elements of a part, for angular rate, specific force or magnetic field: from true vector to reading."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from firmware_host.emulator.parts.drift import Drift

_NOISE_BLOCK = 3 * 256

Seed = int | np.random.SeedSequence
Temperature = Callable[[float], float]
Nonlinearity = Callable[[Any], Any]


class Die(Protocol):
    """The sensing structure of a part, if its temperature differs from the thermometer's.

    `branch` is its branch of the hysteresis: 1 after warming, -1 after cooling.
    """

    def temperature_c(self, time_s: float, /) -> float: ...
    def branch(self, time_s: float, /) -> float: ...


_NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class TriadErrors:
    """The common fields of `GyroTruth`, `AccelerometerTruth` and `MagnetometerTruth`, where they are described.

    All are in the units of a reading.
    """

    scale: Sequence[float]
    bias: Sequence[float]
    noise: float
    non_orthogonality_rad: Sequence[float]
    scale_per_k: Sequence[float]
    bias_per_k: Sequence[float]
    holds_at_c: float
    bandwidth_hz: float | None
    instability: float
    instability_time_s: float
    random_walk_per_sqrt_s: float
    scale_per_k2: Sequence[float] = _NONE
    bias_per_k2: Sequence[float] = _NONE
    hysteresis: Sequence[float] = _NONE
    die: Die | None = None


class Triad:
    """Three elements with `TriadErrors`, of a part whose temperature is one number or a function of time.

    `read` makes a reading of the vector that `sense` returns, to which a part may add other effects; `readings` makes
    many.
    """

    def __init__(self, errors: TriadErrors, seed: Seed, temperature_c: float | Temperature) -> None:
        xy, xz, yz = errors.non_orthogonality_rad
        axes = (
            (1.0, 0.0, 0.0),
            (math.sin(xy), math.cos(xy), 0.0),
            (math.sin(xz), math.sin(yz), math.sqrt(1 - math.sin(xz) ** 2 - math.sin(yz) ** 2)),
        )
        self._errors = errors
        self._elements = [
            (*axis, 1 / k, per_k, per_k2)
            for axis, k, per_k, per_k2 in zip(axes, errors.scale, errors.scale_per_k, errors.scale_per_k2, strict=True)
        ]
        self._bias = list(errors.bias)
        self._temperature_varies = callable(temperature_c) or errors.die is not None
        self._bias_varies = any((*errors.bias_per_k, *errors.bias_per_k2, *errors.hysteresis))
        self.temperature_c: Temperature = temperature_c if callable(temperature_c) else lambda _time_s: temperature_c
        self._low_pass = LowPass(errors.bandwidth_hz) if errors.bandwidth_hz is not None else None
        self._drift = _drift(errors, seed)
        self._random = np.random.default_rng(seed)
        self._noise: list[float] = []

    def sense(self, true: Sequence[Any], warmer_k: Any, nonlinearity: Nonlinearity | None = None) -> list[Any]:
        """Return the sensed vector before bias and noise: three floats, or arrays if `true` and `warmer_k` are arrays.

        `nonlinearity` maps the component along an element's axis.
        """
        x, y, z = true
        sensed = []
        for a, b, c, inverse_scale, per_k, per_k2 in self._elements:
            component = a * x + b * y + c * z
            if nonlinearity is not None:
                component = nonlinearity(component)
            value = component * inverse_scale
            if per_k or per_k2:
                value = value / (1.0 + per_k * warmer_k + per_k2 * warmer_k**2)
            sensed.append(value)
        return sensed

    def warmer_k(self, time_s: float) -> float:
        """Return the degrees above `holds_at_c`, K; 0 if the temperature is constant."""
        if not self._temperature_varies:
            return 0.0
        die = self._errors.die
        sensed_c = self.temperature_c(time_s) if die is None else die.temperature_c(time_s)
        return sensed_c - self._errors.holds_at_c

    def read(self, time_s: float, sensed: list[float], warmer_k: float) -> list[float]:
        """Return the next reading, (3,), at `time_s`, of the sensed vector."""
        if len(self._noise) < 3:
            self._noise = self._random.standard_normal(_NOISE_BLOCK).tolist()[::-1]
        if self._low_pass is not None:
            sensed = self._low_pass.step(time_s, sensed)
        bias = self._bias
        if self._bias_varies:
            bias = self._compute_bias(warmer_k, self._branch(time_s))
        if self._drift is not None:
            bias = [b + drift for b, drift in zip(bias, self._drift.evaluate(time_s), strict=True)]
        scale, draw = self._errors.noise, self._noise.pop
        return [value - b + scale * draw() for value, b in zip(sensed, bias, strict=True)]

    def _branch(self, time_s: float) -> float:
        return 0.0 if self._errors.die is None else self._errors.die.branch(time_s)

    def _compute_bias(self, warmer_k: Any, branch: Any) -> list[Any]:
        """Return the bias at `warmer_k`, on the given branch of the hysteresis: three floats or arrays."""
        errors = self._errors
        rows = zip(self._bias, errors.bias_per_k, errors.bias_per_k2, errors.hysteresis, strict=True)
        return [b + per_k * warmer_k + per_k2 * warmer_k**2 + size * branch for b, per_k, per_k2, size in rows]

    def all_warmer_k(self, time_s: np.ndarray) -> np.ndarray | float:
        """Return `warmer_k`, K, at times (n,): (n,), or one number if the temperature is constant."""
        return np.array([self.warmer_k(t) for t in time_s.tolist()]) if self._temperature_varies else 0.0

    def readings(self, time_s: np.ndarray, sensed: Sequence[np.ndarray], warmer_k: np.ndarray | float) -> np.ndarray:
        """Return all readings (n, 3) at times (n,) of the sensed vectors, three arrays (n,)."""
        columns = np.column_stack(sensed)
        if self._low_pass is not None:
            rows = zip(time_s.tolist(), columns.tolist(), strict=True)
            columns = np.array([self._low_pass.step(t, row) for t, row in rows])
        branch = np.array([self._branch(t) for t in time_s.tolist()]) if self._errors.die is not None else 0.0
        bias = np.column_stack(self._compute_bias(np.broadcast_to(warmer_k, time_s.shape), branch))
        if self._drift is not None:
            bias = bias + self._drift.evaluate_all(time_s)
        noise = self._random.standard_normal(columns.shape)
        noisy: np.ndarray = columns - bias + self._errors.noise * noise
        return noisy


class CachedMotion:
    """A part's motion, evaluated once for each time although two triads use it."""

    def __init__(self, motion_at: Callable[[float], Sequence[float]]) -> None:
        self._motion_at = motion_at
        self._time_s = math.nan
        self._motion: Sequence[float] = ()

    def __call__(self, time_s: float) -> Sequence[float]:
        if time_s != self._time_s:
            self._time_s, self._motion = time_s, self._motion_at(time_s)
        return self._motion


class LowPass:
    """A low-pass of first order, exact for inputs that are linear between their times."""

    def __init__(self, bandwidth_hz: float) -> None:
        self._time_constant_s = 1.0 / (2.0 * math.pi * bandwidth_hz)
        self._time_s = -math.inf
        self._inputs: list[float] = []
        self._outputs: list[float] = []

    def step(self, time_s: float, inputs: list[float]) -> list[float]:
        """Return the outputs at `time_s`; `inputs` are the values at that time."""
        step_s = time_s - self._time_s
        if math.isinf(step_s):
            self._outputs = inputs
        elif step_s > 0.0:
            decay = math.exp(-step_s / self._time_constant_s)
            lag = self._time_constant_s / step_s  # the lag of a linear input's response, as a fraction of the step
            self._outputs = [
                new - lag * (new - old) + (output - old + lag * (new - old)) * decay
                for new, old, output in zip(inputs, self._inputs, self._outputs, strict=True)
            ]
        self._time_s, self._inputs = time_s, inputs
        return self._outputs


def spawn_seed(seed: Seed, key: int) -> np.random.SeedSequence:
    """Return a seed derived from `seed` and `key` alone, so that its draws affect no other draws."""
    sequence = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    return np.random.SeedSequence(sequence.entropy, spawn_key=(*sequence.spawn_key, key))


def _drift(errors: TriadErrors, seed: Seed) -> Drift | None:
    if not (errors.instability or errors.random_walk_per_sqrt_s):
        return None
    return Drift(errors.instability, errors.instability_time_s, errors.random_walk_per_sqrt_s, spawn_seed(seed, 1))


def saturate(counts: int, bits: int = 16) -> int:
    """Return the nearest number in a two's complement register of `bits`."""
    limit = 1 << bits - 1
    return max(-limit, min(limit - 1, counts))
