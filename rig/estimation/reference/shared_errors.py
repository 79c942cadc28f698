"""Readings whose noise is known, with errors that many of them share and of which only the common size is to be found.

    y = J x + E e + n,   n ~ N(0, V),   e ~ N(0, δ² 1)

In coordinates in which V is 1 and E Eᵀ is diagonal, `growth` γ, the readings are independent with variance 1 + δ² γ,
whatever δ. It is found by restricted maximum likelihood (Patterson and Thompson, Biometrika 58 (1971) 545).
"""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.reference.attitude_error import AttitudeError, likeliest


@dataclass(frozen=True, slots=True)
class Apart:
    """`turn` (n, n) takes readings to where they are independent, `growth` (n,) is γ there."""

    turn: Array
    growth: Array

    def white(self, std_rad: float) -> Array:
        """(n, n) what leaves readings independent, each with standard deviation 1, for errors of the size δ."""
        return np.asarray(self.turn / np.sqrt(1 + std_rad**2 * self.growth)[:, None], dtype=np.float64)


def apart(noise: Array, effects: Array) -> Apart:
    """Readings of noise V (n, n) and errors E (n, P) made independent. Raises LinAlgError for a V not positive."""
    white = np.linalg.inv(np.linalg.cholesky(noise))
    spread = white @ effects
    growth, directions = np.linalg.eigh(spread @ spread.T)
    return Apart(directions.T @ white, np.maximum(growth, 0.0))


def likeliest_error(readings: Apart, residuals: Array, jacobian: Array) -> float:
    """δ, rad, from residuals (n,) and J (n, q)."""
    return likeliest(readings.growth, readings.turn @ residuals, readings.turn @ jacobian)[0]


def with_uncertainty(readings: Apart, std_rad: float, jacobian: Array) -> AttitudeError:
    """What the expected information on δ² makes of it."""
    told = information(readings.growth, std_rad, readings.turn @ jacobian)
    if told <= 0:
        return AttitudeError(std_rad, float("inf"))
    return AttitudeError(std_rad, float(np.sqrt(std_rad**2 + told**-0.5) - std_rad))


def information(growth: Array, std_rad: float, slopes: Array) -> float:
    """Information on δ²: half the trace of (P G)², G = E Eᵀ and P what the fit of slopes (n, q) leaves, whitened."""
    variance = 1 + std_rad**2 * growth
    growth = growth / variance
    orthogonal = np.linalg.qr(slopes / np.sqrt(variance)[:, None])[0]
    taken = orthogonal.T @ (growth[:, None] * orthogonal)
    return 0.5 * float(growth @ growth - 2 * growth**2 @ np.sum(orthogonal**2, axis=1) + np.sum(taken**2))
