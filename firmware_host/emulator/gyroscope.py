"""What all simulated gyroscopes share: from the true turn rate, through the part's errors and its noise, to counts."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

_NOISE_BLOCK = 3 * 256


@dataclass(frozen=True, slots=True)
class GyroTruth:
    """What the simulated gyroscope really does, in the model g = K (m + b) with m the reading (SIX, Eq. (3)).

    `scale`: diagonal of K; `bias_rad_s`: b, in the units of the reading; `noise_rad_s`: standard deviation of one
    reading; `non_orthogonality_rad` (xy, xz, yz): the y axis leans by xy towards x, the z axis by xz towards x and
    by yz towards y.
    """

    scale: Sequence[float] = (1.0, 1.0, 1.0)
    bias_rad_s: Sequence[float] = (0.0, 0.0, 0.0)
    noise_rad_s: float = 0.0
    non_orthogonality_rad: Sequence[float] = (0.0, 0.0, 0.0)


class Gyroscope:
    """Three sensing axes with the errors of `truth`.

    `rate_at(time_s)`: true angular rate in the part's own axes, 3 floats, rad/s; asked once for each reading. `seed`:
    of the noise, which is drawn per reading.
    """

    def __init__(
        self, rate_at: Callable[[float], Sequence[float]], truth: GyroTruth, seed: int | np.random.SeedSequence
    ) -> None:
        self._rate_at = rate_at
        self._inverse_scale = [1 / k for k in truth.scale]
        self._bias = list(truth.bias_rad_s)
        self._noise_rad_s = truth.noise_rad_s
        xy, xz, yz = truth.non_orthogonality_rad
        self._axes = (
            (1.0, 0.0, 0.0),
            (math.sin(xy), math.cos(xy), 0.0),
            (math.sin(xz), math.sin(yz), math.sqrt(1 - math.sin(xz) ** 2 - math.sin(yz) ** 2)),
        )
        self._random = np.random.default_rng(seed)
        self._noise: list[float] = []

    def read(self, time_s: float, settled: float = 1.0) -> list[float]:
        """The next reading, (3,) rad/s, taken at `time_s`; of the turn rate only the fraction `settled` is felt."""
        if len(self._noise) < 3:
            self._noise = self._random.standard_normal(_NOISE_BLOCK).tolist()[::-1]
        true = [settled * rate_rad_s for rate_rad_s in self._rate_at(time_s)]
        reading = []
        for axis, inverse_scale, bias in zip(self._axes, self._inverse_scale, self._bias, strict=True):
            along = axis[0] * true[0] + axis[1] * true[1] + axis[2] * true[2]
            reading.append(along * inverse_scale - bias + self._noise_rad_s * self._noise.pop())
        return reading


def saturated(counts: int, bits: int = 16) -> int:
    """The nearest number that a two's complement register of so many bits holds."""
    limit = 1 << bits - 1
    return max(-limit, min(limit - 1, counts))
