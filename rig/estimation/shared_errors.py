"""Readings whose noise is known, with errors that many of them share and of which only the common size is to be found.

    y = J x + E e + n,   n ~ N(0, V),   e ~ N(0, δ² 1)

In coordinates in which V is 1 and E Eᵀ is diagonal, `growth` γ, the readings are independent with variance 1 + δ² γ,
whatever δ. It is found by restricted maximum likelihood (Patterson and Thompson, Biometrika 58 (1971) 545).
"""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.attitude_error import AttitudeError, likeliest


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
    return of_white(np.linalg.inv(np.linalg.cholesky(noise)), effects)


def of_white(white: Array, effects: Array) -> Apart:
    """Readings made independent whose noise `white` (n, n) leaves white, with errors E (n, P)."""
    growth, directions = np.linalg.eigh(white @ effects @ effects.T @ white.T)
    return Apart(directions.T @ white, np.maximum(growth, 0.0))


def likeliest_error(readings: Apart, residuals: Array, jacobian: Array) -> float:
    """δ, rad, from residuals (n,) and J (n, q)."""
    turned, slopes = readings.turn @ residuals, readings.turn @ jacobian
    return likeliest(lambda log_delta: _lost(np.exp(log_delta), readings.growth, turned, slopes, slopes.shape[1]))


def more_likely(readings: Apart, residuals: Array, jacobian: Array, columns: Array) -> float:
    """Twice the logarithm of how much likelier residuals (n,) are with `columns` (n, k) beside J (n, q).

    Each with the δ that makes them likeliest, of what J leaves of the readings (Welham and Thompson, J. R. Stat. Soc. B
    59 (1997) 701). Where δ is known it is χ² of what the columns explain.
    """
    turned, slopes = readings.turn @ residuals, readings.turn @ np.column_stack([jacobian, columns])
    count = jacobian.shape[1]

    def least(whole: Array) -> float:
        std_rad = likeliest(lambda log_delta: _lost(np.exp(log_delta), readings.growth, turned, whole, count))
        return _lost(std_rad, readings.growth, turned, whole, count)

    return 2 * (least(slopes[:, :count]) - least(slopes))


def _lost(std_rad: float, growth: Array, residuals: Array, slopes: Array, count: int) -> float:
    """− ln of the likelihood of what the first `count` of the slopes (n, p) leave, where the others explain more."""
    variance = 1 + std_rad**2 * growth
    orthogonal, triangle = np.linalg.qr(slopes / np.sqrt(variance)[:, None])
    left = residuals / np.sqrt(variance)
    left = left - orthogonal @ (orthogonal.T @ left)
    sizes = np.abs(np.diag(triangle))[:count]
    return float(0.5 * (left @ left + np.log(variance).sum()) + np.log(sizes).sum())


def with_uncertainty(readings: Apart, std_rad: float, jacobian: Array) -> AttitudeError:
    """What the expected information on δ² makes of it."""
    told = information(readings, std_rad, jacobian)
    if told <= 0:
        return AttitudeError(std_rad, float("inf"))
    return AttitudeError(std_rad, float(np.sqrt(std_rad**2 + told**-0.5) - std_rad))


def information(readings: Apart, std_rad: float, jacobian: Array) -> float:
    """Information on δ²: half the trace of (P G)², G = E Eᵀ and P what the fit of J (n, q) leaves, whitened."""
    variance = 1 + std_rad**2 * readings.growth
    growth = readings.growth / variance
    orthogonal = np.linalg.qr((readings.turn @ jacobian) / np.sqrt(variance)[:, None])[0]
    taken = orthogonal.T @ (growth[:, None] * orthogonal)
    return 0.5 * float(growth @ growth - 2 * growth**2 @ np.sum(orthogonal**2, axis=1) + np.sum(taken**2))
