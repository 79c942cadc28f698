"""A gyroscope's nonlinearity: m = (g + odd |g| g + even g²) / k − b.

m is the reading, g the rate along the sensor's axis, k the scale factor, b the bias. At one speed the odd part belongs
to the scale factor; several speeds separate the two. Data sheets state the largest distance from the best straight line
through ± full scale. A smooth curve is taken as the sum of a cube and a square of the rate; the largest distance of the
cube is a quarter of its value at full scale, that of the square a half.
"""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array

PRIOR_STD_PER_RAD_S = 1.0  # far above any sensor's nonlinearity, so that only the sweeps determine it
CUBE_DEVIATION, SQUARE_DEVIATION = 0.25, 0.5  # largest distance of x³ and x² from their best line for |x| ≤ 1
DISTINCT_SPEED_RATIO = 1.05


@dataclass(frozen=True, slots=True)
class Nonlinearity:
    """The coefficients odd and even (3,) of the module's equation for each axis, and their standard deviations."""

    odd_per_rad_s: Array
    even_per_rad_s: Array
    odd_std_per_rad_s: Array
    even_std_per_rad_s: Array


def distinct_speeds(speeds_rad_s: Array) -> tuple[float, ...]:
    """Return the mean of each group of speeds (n,) that differ only because of the arm's timing, slowest first."""
    ordered = np.sort(speeds_rad_s)
    steps = np.flatnonzero(ordered[1:] > DISTINCT_SPEED_RATIO * ordered[:-1]) + 1
    return tuple(float(group.mean()) for group in np.split(ordered, steps))


def curvature(matrix: Array, rates_rad_s: Array) -> Array:
    """Return the effects (6, N, 3) on readings of the nonlinearity's odd parts along x, y, z, then of its even parts.

    Each part has the size `PRIOR_STD_PER_RAD_S`. `rates_rad_s` (N, 3) are mean rates in the flange's frame, which the
    gyroscope's `matrix` F (3, 3) maps to its readings.
    """
    readings = rates_rad_s @ matrix.T
    projected = readings / np.linalg.norm(matrix, axis=1)
    gains = (np.abs(projected) * readings, projected * readings)
    return PRIOR_STD_PER_RAD_S * _separate_axes(gains)


def nonlinear_effects(matrix: Array, rates_rad_s: Array, full_scale_rad_s: float, true_at_rad_s: float = 0.0) -> Array:
    """Return the effects (6, N, 3) of cubes along x, y, z, then of squares, each of unit size at full scale.

    `matrix` F (3, 3) maps the mean rates (N, 3) in the flange's frame to readings. A linear term is subtracted from the
    cubes, so that they have no effect at the speed `true_at_rad_s`, to which F then refers.
    """
    readings = rates_rad_s @ matrix.T
    projected = readings / np.linalg.norm(matrix, axis=1) / full_scale_rad_s
    gains = ((projected**2 - (true_at_rad_s / full_scale_rad_s) ** 2) * readings, projected * readings)
    return _separate_axes(gains)


def _separate_axes(effects: tuple[Array, Array]) -> Array:
    """Return two effects (N, 3) on all axes as effects (6, N, 3) on one axis at a time."""
    alone: Array = (np.array(effects)[:, None] * np.eye(3)[:, None]).reshape(6, -1, 3)
    return alone


def nonlinearity(sizes: Array, covariance: Array) -> Nonlinearity:
    """Return the nonlinearity from the estimated sizes (6,) of the `curvature` columns and their covariance (6, 6)."""
    std = PRIOR_STD_PER_RAD_S * np.sqrt(np.diag(covariance))
    odd, even = np.split(PRIOR_STD_PER_RAD_S * sizes, 2)
    return Nonlinearity(odd, even, std[:3], std[3:])
