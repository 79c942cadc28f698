"""Three sensing elements of a part, for turn rate, specific force or magnetic field: from a true vector,
through their errors and their noise, to a reading.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from firmware_host.emulator.parts.drift import Drift

_NOISE_BLOCK = 3 * 256

Seed = int | np.random.SeedSequence
Temperature = Callable[[float], float]
Bend = Callable[[Any], Any]


class Die(Protocol):
    """What moves in a part, where it is not as warm as the part's thermometer says.

    `branch` is where it is on its hysteresis: 1 after warming, -1 after cooling.
    """

    def temperature_c(self, time_s: float, /) -> float: ...
    def branch(self, time_s: float, /) -> float: ...


_NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class TriadErrors:
    """What `GyroTruth`, `AccelerometerTruth` and `MagnetometerTruth` have in common, and explain.

    Everything in the units of a reading.
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
    """Three elements with these errors, of a part whose temperature is one number or a function of time.

    A reading is made of `sense`, whatever else the part feels, and `read`; `readings` makes many in one go.
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
        self._warms = callable(temperature_c) or errors.die is not None
        self._bias_moves = any((*errors.bias_per_k, *errors.bias_per_k2, *errors.hysteresis))
        self.temperature_c: Temperature = temperature_c if callable(temperature_c) else lambda _time_s: temperature_c
        self._low_pass = LowPass(errors.bandwidth_hz) if errors.bandwidth_hz is not None else None
        self._drift = _drift(errors, seed)
        self._random = np.random.default_rng(seed)
        self._noise: list[float] = []

    def sense(self, true: Sequence[Any], warmer_k: Any, bend: Bend | None = None) -> list[Any]:
        """What the elements make of a vector before bias and noise: three floats or arrays, as `true` and `warmer_k`.

        `bend`: what becomes of the component along an element's axis.
        """
        x, y, z = true
        felt = []
        for a, b, c, inverse_scale, per_k, per_k2 in self._elements:
            along = a * x + b * y + c * z
            if bend is not None:
                along = bend(along)
            value = along * inverse_scale
            if per_k or per_k2:
                value = value / (1.0 + per_k * warmer_k + per_k2 * warmer_k**2)
            felt.append(value)
        return felt

    def warmer_k(self, time_s: float) -> float:
        """How much warmer the part is than where its errors hold."""
        if not self._warms:
            return 0.0
        die = self._errors.die
        felt_c = self.temperature_c(time_s) if die is None else die.temperature_c(time_s)
        return felt_c - self._errors.holds_at_c

    def read(self, time_s: float, felt: list[float], warmer_k: float) -> list[float]:
        """The next reading, (3,), at `time_s`, of what the elements felt then."""
        if len(self._noise) < 3:
            self._noise = self._random.standard_normal(_NOISE_BLOCK).tolist()[::-1]
        if self._low_pass is not None:
            felt = self._low_pass.step(time_s, felt)
        bias = self._bias
        if self._bias_moves:
            bias = self._moved(warmer_k, self._branch(time_s))
        if self._drift is not None:
            bias = [b + drift for b, drift in zip(bias, self._drift.at(time_s), strict=True)]
        scale, draw = self._errors.noise, self._noise.pop
        return [value - b + scale * draw() for value, b in zip(felt, bias, strict=True)]

    def _branch(self, time_s: float) -> float:
        return 0.0 if self._errors.die is None else self._errors.die.branch(time_s)

    def _moved(self, warmer_k: Any, branch: Any) -> list[Any]:
        """The bias where the part is so much warmer, on that branch of its hysteresis: three floats or arrays."""
        errors = self._errors
        rows = zip(self._bias, errors.bias_per_k, errors.bias_per_k2, errors.hysteresis, strict=True)
        return [b + per_k * warmer_k + per_k2 * warmer_k**2 + size * branch for b, per_k, per_k2, size in rows]

    def all_warmer_k(self, time_s: np.ndarray) -> np.ndarray | float:
        """How much warmer the part is than where its errors hold, (n,) or one number for all times."""
        return np.array([self.warmer_k(t) for t in time_s.tolist()]) if self._warms else 0.0

    def readings(self, time_s: np.ndarray, felt: Sequence[np.ndarray], warmer_k: np.ndarray | float) -> np.ndarray:
        """All readings (n, 3) at times (n,) of what the elements felt, three arrays (n,)."""
        columns = np.column_stack(felt)
        if self._low_pass is not None:
            rows = zip(time_s.tolist(), columns.tolist(), strict=True)
            columns = np.array([self._low_pass.step(t, row) for t, row in rows])
        branch = np.array([self._branch(t) for t in time_s.tolist()]) if self._errors.die is not None else 0.0
        bias = np.column_stack(self._moved(np.broadcast_to(warmer_k, time_s.shape), branch))
        if self._drift is not None:
            bias = bias + self._drift.at_times(time_s)
        noise = self._random.standard_normal(columns.shape)
        taken: np.ndarray = columns - bias + self._errors.noise * noise
        return taken


class Remembered:
    """A part's motion, asked for once for each time although two triads feel it."""

    def __init__(self, motion_at: Callable[[float], Sequence[float]]) -> None:
        self._motion_at = motion_at
        self._time_s = math.nan
        self._motion: Sequence[float] = ()

    def __call__(self, time_s: float) -> Sequence[float]:
        if time_s != self._time_s:
            self._time_s, self._motion = time_s, self._motion_at(time_s)
        return self._motion


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


def spawned(seed: Seed, key: int) -> np.random.SeedSequence:
    """A seed of its own that depends on `seed` alone: what draws from it changes nothing for the others."""
    sequence = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    return np.random.SeedSequence(sequence.entropy, spawn_key=(*sequence.spawn_key, key))


def _drift(errors: TriadErrors, seed: Seed) -> Drift | None:
    if not (errors.instability or errors.random_walk_per_sqrt_s):
        return None
    return Drift(errors.instability, errors.instability_time_s, errors.random_walk_per_sqrt_s, spawned(seed, 1))


def saturated(counts: int, bits: int = 16) -> int:
    """The nearest number that a two's complement register of so many bits holds."""
    limit = 1 << bits - 1
    return max(-limit, min(limit - 1, counts))
