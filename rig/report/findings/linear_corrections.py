"""Corrections of a sensor's readings in the form of other programs: matrix, offset, noise. Pure.

A reading m follows from the true value in SI units, with matrix F, offset c and g-sensitivity G:

    gyroscope        m = F ω + G a + c,    for the rate ω and the specific force a, which at rest points upwards
    any other triad  m = F s + c           for the specific force or flux density s

The rig's bias b of a gyroscope is −c. A gyroscope's F, ω and a are in the right-angled frame nearest to its axes; the
vector model's `mounting` rotates from the flange into this frame. Without a solution of the vector model F is K⁻¹, the
inverse of the rig's matrix of scale factors, and G is unknown.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rig.data.quantity import Quantity
from rig.estimation.arrays import Array


class AveragedInterval(Protocol):
    """The average of one interval of readings."""

    @property
    def samples(self) -> int: ...
    @property
    def duration_s(self) -> float: ...


@dataclass(frozen=True, slots=True)
class ReadingNoise:
    """Sample rate and `density` of white noise, unit/√Hz; None if the result does not contain them."""

    rate_hz: float | None
    density: float | None


@dataclass(frozen=True, slots=True)
class SensorCorrection:
    """The correction of one calibrated sensor: reading (3,) = `matrix` (3, 3) · true + `offset` (3,).

    - `full_scale` is None if it was not stated.
    - `scale` (3,) is the factor of each axis that converts readings to true values, for programs without a matrix.
    - `g_sensitivity` (3, 3): a gyroscope's g-sensitivity, rad/s per m/s².
    - `second_order`: whether an accelerometer has quadratic terms, which no other program supports.
    - `mounting` (3, 3): the rotation from the frame of the recorded motion to that of the true values, None if unknown.
    - `in_gyroscope_frame`: whether an accelerometer's true values are in the frame of its gyroscope's.
    """

    sensor: str
    quantity: Quantity
    part: str
    serial_number: str
    full_scale: float | None
    temperature_c: float | None
    scale: Array
    matrix: Array
    offset: Array
    noise: ReadingNoise
    g_sensitivity: Array | None = None
    second_order: bool = False
    mounting: Array | None = None
    in_gyroscope_frame: bool = False

    @property
    def name(self) -> str:
        """The sensor's name with its quantity."""
        return self.quantity.label(self.sensor)

    @property
    def gains(self) -> Array:
        """Diagonal matrix (3, 3) of the reading per unit of the true value."""
        return np.diag(np.linalg.norm(self.matrix, axis=1))

    @property
    def axes(self) -> Array:
        """Unit vectors (3, 3) of the axes as rows, such that matrix = gains · axes."""
        axes: Array = self.matrix / np.linalg.norm(self.matrix, axis=1)[:, None]
        return axes


def noise_of(means: Sequence[AveragedInterval], at_rest: Sequence[tuple[Sequence[float], int]]) -> ReadingNoise:
    """Return the readings' sample rate and noise density.

    `at_rest` has the standard deviation (3,) of one sample, and the number of samples, of each rest. The density is the
    standard deviation of the noisiest axis divided by the square root of the sample rate, which holds for noise that is
    white up to half the rate. It is None without rests, as for attitudes that a file states.
    """
    duration_s = sum(mean.duration_s for mean in means)
    rate_hz = sum(mean.samples for mean in means) / duration_s if duration_s > 0 else None
    if not at_rest or rate_hz is None:
        return ReadingNoise(rate_hz, None)
    counts = [count for _, count in at_rest]
    squares = np.average([np.square(noise) for noise, _ in at_rest], axis=0, weights=counts)
    return ReadingNoise(rate_hz, float(np.sqrt(squares.max() / rate_hz)))
