"""Readings with given noise, and shared errors of one unknown standard deviation.

    y = J x + E e + n,   n ~ N(0, V),   e ~ N(0, δ² I)

J is the Jacobian of the readings y, the effects E map unit errors to readings. In coordinates in which V is I and E Eᵀ
is diagonal, with the elements γ (`growth`), the readings are independent with variances 1 + δ² γ for any δ. δ is
estimated by restricted maximum likelihood (Patterson and Thompson, Biometrika 58 (1971) 545).
"""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.reference.attitude_error import AttitudeError, maximise_likelihood


@dataclass(frozen=True, slots=True)
class Decorrelation:
    """The map `transform` (n, n) from readings to independent ones with the variances 1 + `growth` × δ².

    δ is the unknown standard deviation of the shared errors.
    """

    transform: Array
    growth: Array

    def whitener(self, std_rad: float) -> Array:
        """Return the matrix (n, n) that whitens readings whose shared errors have the standard deviation `std_rad`."""
        return np.asarray(self.transform / np.sqrt(1 + std_rad**2 * self.growth)[:, None], dtype=np.float64)


def decorrelate(noise: Array, effects: Array) -> Decorrelation:
    """Return the decorrelation of readings with the covariance `noise` (n, n) and the `effects` E (n, P) of the errors.

    Raise LinAlgError for an invalid covariance.
    """
    whitener = np.asarray(np.linalg.inv(np.linalg.cholesky(noise)), dtype=np.float64)
    scaled = whitener @ effects
    growth, directions = np.linalg.eigh(scaled @ scaled.T)
    return Decorrelation(directions.T @ whitener, np.maximum(growth, 0.0))


def estimate_common_error(readings: Decorrelation, residuals: Array, jacobian: Array) -> float:
    """Return the std of the shared errors by restricted maximum likelihood, from residuals (n,) and a Jacobian."""
    return maximise_likelihood(readings.growth, readings.transform @ residuals, readings.transform @ jacobian)[0]


def add_uncertainty(readings: Decorrelation, std_rad: float, jacobian: Array) -> AttitudeError:
    """Return the std `std_rad` of the shared errors with its uncertainty, from the expected information."""
    expected = information(readings.growth, std_rad, readings.transform @ jacobian)
    if expected <= 0:
        return AttitudeError(std_rad, float("inf"))
    return AttitudeError(std_rad, float(np.sqrt(std_rad**2 + expected**-0.5) - std_rad))


def information(growth: Array, std_rad: float, slopes: Array) -> float:
    """Return the expected information on the shared errors' variance `std_rad`²: tr((P G)²)/2.

    The readings' covariance is V = I + `std_rad`² G with G = diag(`growth`). P is V⁻¹ times the matrix that maps the
    readings to their residuals from the weighted fit of `slopes` (n, q).
    """
    variance = 1 + std_rad**2 * growth
    growth = growth / variance
    orthogonal = np.linalg.qr(slopes / np.sqrt(variance)[:, None])[0]
    explained = orthogonal.T @ (growth[:, None] * orthogonal)
    return 0.5 * float(growth @ growth - 2 * growth**2 @ np.sum(orthogonal**2, axis=1) + np.sum(explained**2))
