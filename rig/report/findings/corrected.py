"""How readings of a sensor are put right, as other programs want to be told: matrix, offset, noise. Pure.

In SI units and the right-angled frame nearest to a gyroscope's axes, whose rotation is the vector model's `mounting`:

    gyroscope        m = F ω + G a + c,    c = −b, a the specific force, which at rest points upwards
    any other triad  m = F s + c

Without a solution of the vector model a gyroscope's F is K⁻¹, and no g-sensitivity is known.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rig.data.quantity import Quantity
from rig.estimation.arrays import Array


class Averaged(Protocol):
    """What one stretch of readings was averaged to."""

    @property
    def samples(self) -> int: ...
    @property
    def duration_s(self) -> float: ...


@dataclass(frozen=True, slots=True)
class Noise:
    """How often samples came; `density` of white noise, unit/√Hz. None where the result does not tell it."""

    rate_hz: float | None
    density: float | None


@dataclass(frozen=True, slots=True)
class Corrected:
    """One calibrated sensor: reading (3,) = `matrix` (3, 3) · true + `offset` (3,).

    `scale` (3,) is what a reading along each axis is multiplied by where a program has no matrix. `full_scale` is None
    where nobody stated it. A gyroscope may have a `g_sensitivity` (3, 3), rad/s per m/s²; `second_order` tells that an
    accelerometer has terms that none of the programs knows.
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
    noise: Noise
    g_sensitivity: Array | None = None
    second_order: bool = False

    @property
    def name(self) -> str:
        """How the sensor is called beside the others of its name."""
        return self.quantity.label(self.sensor)

    @property
    def gains(self) -> Array:
        """(3, 3) diagonal matrix of what one unit reads as."""
        return np.diag(np.linalg.norm(self.matrix, axis=1))

    @property
    def axes(self) -> Array:
        """(3, 3) unit vectors of the axes, in rows: matrix = gains · axes."""
        axes: Array = self.matrix / np.linalg.norm(self.matrix, axis=1)[:, None]
        return axes


def noise_of(means: Sequence[Averaged], at_rest: Sequence[tuple[Sequence[float], int]]) -> Noise:
    """Noise by what was averaged, and by σ of one sample and the count of samples of each rest.

    The density is that of the noisiest axis: σ over √rate, as if it were white up to half the rate. Nothing is known of
    attitudes that a file told.
    """
    lasted_s = sum(each.duration_s for each in means)
    rate_hz = sum(each.samples for each in means) / lasted_s if lasted_s > 0 else None
    if not at_rest or rate_hz is None:
        return Noise(rate_hz, None)
    counts = [count for _, count in at_rest]
    squares = np.average([np.square(noise) for noise, _ in at_rest], axis=0, weights=counts)
    return Noise(rate_hz, float(np.sqrt(squares.max() / rate_hz)))
