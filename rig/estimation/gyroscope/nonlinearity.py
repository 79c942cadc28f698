"""How a gyroscope's reading departs from proportion: m = (g + odd |g| g + even g²) / k − b.

g is the rate along the sensor's axis. At one speed the odd part is a part of the scale factor; several speeds tell
both. Data sheets say how far a reading is from the best straight line through ± full scale: a smooth curve is a cubic
and a square, of which that line misses a quarter and a half of what they are at full scale.
"""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array

FREE_PER_RAD_S = 1.0  # no sensor is that far from linear: what the sweeps say is all that counts
CUBE_MISSED, SQUARE_MISSED = 0.25, 0.5
DISTINCT = 1.05  # ratio of two speeds that are not the same


@dataclass(frozen=True, slots=True)
class Nonlinearity:
    """`odd_per_rad_s`, `even_per_rad_s` (3,) by axis and their standard deviations."""

    odd_per_rad_s: Array
    even_per_rad_s: Array
    odd_std_per_rad_s: Array
    even_std_per_rad_s: Array


def distinct_speeds(speeds_rad_s: Array) -> tuple[float, ...]:
    """The mean of each group of speeds (n,) that are the same but for the arm's timing, slowest first."""
    ordered = np.sort(speeds_rad_s)
    steps = np.flatnonzero(ordered[1:] > DISTINCT * ordered[:-1]) + 1
    return tuple(float(group.mean()) for group in np.split(ordered, steps))


def curvature(matrix: Array, rates_rad_s: Array) -> Array:
    """(6, N, 3) what readings gain by odd parts of x, y, z and even parts of x, y, z of `FREE_PER_RAD_S`.

    Of mean rates (N, 3) in the flange's frame, and F (3, 3).
    """
    readings = rates_rad_s @ matrix.T
    along = readings / np.linalg.norm(matrix, axis=1)
    gains = (np.abs(along) * readings, along * readings)
    return FREE_PER_RAD_S * np.array([gain * axis for gain in gains for axis in np.eye(3)])


def bending(matrix: Array, rates_rad_s: Array, full_scale_rad_s: float, true_at_rad_s: float = 0.0) -> Array:
    """(6, N, 3) what readings gain by cubes along x, y, z and squares along x, y, z that are full scale at full scale.

    As `curvature`; F holds at the speed `true_at_rad_s`.
    """
    readings = rates_rad_s @ matrix.T
    along = readings / np.linalg.norm(matrix, axis=1) / full_scale_rad_s
    gains = ((along**2 - (true_at_rad_s / full_scale_rad_s) ** 2) * readings, along * readings)
    return np.array([gain * axis for gain in gains for axis in np.eye(3)])


def nonlinearity(sizes: Array, covariance: Array) -> Nonlinearity:
    """The nonlinearity by the sizes (6,) of `curvature` in its unit, and their covariance (6, 6)."""
    std = FREE_PER_RAD_S * np.sqrt(np.diag(covariance))
    odd, even = np.split(FREE_PER_RAD_S * sizes, 2)
    return Nonlinearity(odd, even, std[:3], std[3:])
