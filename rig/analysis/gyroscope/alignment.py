"""The rotation between two sensors on one board, from their mean rates in the same revolutions."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array, rotation_vectors
from rig.observation.observe import Observation

MIN_INDEPENDENCE = 1e-3  # least over greatest information about a rotation; revolutions about one axis have 0


class LinearCalibration(Protocol):
    """A calibration: rate = correction_matrix (3, 3) · (reading + bias_rad_s (3,))."""

    @property
    def correction_matrix(self) -> Array: ...
    @property
    def bias_rad_s(self) -> Array: ...


@dataclass(frozen=True, slots=True)
class MeanRates:
    """Mean rates of n revolutions (n, 3) with their covariances (n, 3, 3) in (rad/s)²."""

    rate_rad_s: Array
    covariance_rad2_s2: Array

    def rotate(self, matrix: Array) -> "MeanRates":
        """Return the mean rates multiplied by a matrix (3, 3), to rotate them into another frame or to correct them."""
        return MeanRates(self.rate_rad_s @ matrix.T, matrix @ self.covariance_rad2_s2 @ matrix.T)


@dataclass(frozen=True, slots=True)
class RelativeRotation:
    """The rotation between two sensors, independent of errors of scale and bias.

    - `matrix` (3, 3): from a vector in the reference's frame to the sensor's.
    - `std_rad` (3,): standard deviations of small rotations about the sensor's x, y, z, from the readings' noise alone.
    - `from_nominal_rad` (3,): the rotation by which `matrix` differs from that of the nominal mountings, as a rotation
      vector in the sensor's frame.
    - `residuals_rad_s` (n, 3): the sensor's mean rates minus the rotated ones of the reference.
    """

    matrix: Array
    std_rad: Array
    from_nominal_rad: Array
    residuals_rad_s: Array

    @property
    def vector_rad(self) -> Array:
        """The rotation vector (3,) of `matrix`, in rad."""
        return rotation_vectors(self.matrix)


def collect_mean_rates(observations: Sequence[Observation], calibration: LinearCalibration | None = None) -> MeanRates:
    """Return a sensor's mean rate in each revolution, corrected by the `calibration` if there is one."""
    means = np.array([observation.average.mean_rad_s for observation in observations])
    variances = np.array([observation.average.variance_rad2_s2 for observation in observations])
    raw = MeanRates(means, variances[:, :, None] * np.eye(3))
    if calibration is None:
        return raw
    return MeanRates(means + calibration.bias_rad_s, raw.covariance_rad2_s2).rotate(calibration.correction_matrix)


def fit_rotation(sensor: MeanRates, reference: MeanRates, nominal: Array) -> RelativeRotation:
    """Return the rotation R that minimises Σ ‖sensor − R reference‖²; `nominal` is R for the nominal mountings.

    R is independent of errors of scale, which are parallel to the axes of rotation, and of biases, which cancel between
    both directions. Raise Fault `rank_deficient` if all revolutions are about one axis.
    """
    from scipy.spatial.transform import Rotation

    v = reference.rate_rad_s
    information = np.sum(v**2) * np.eye(3) - v.T @ v
    least, _, greatest = np.linalg.eigvalsh(information)
    if not least > MIN_INDEPENDENCE * greatest:
        raise Fault(
            "rank_deficient",
            "the revolutions turn about one axis only, so the mounting of one sensor relative to the other "
            "is not known",
            "Sweep about at least two different axes",
        )
    matrix = Rotation.align_vectors(sensor.rate_rad_s, v)[0].as_matrix()  # Wahba's problem (Kabsch 1976)
    expected = reference.rotate(matrix)
    # For an error δθ of R and a rate r of the reference, the sensor reads R r + δθ × R r to first order. So the
    # covariance of δθ is that of a linear least-squares estimate, with the noise of both sensors.
    by_rotation = np.cross(
        np.eye(3), expected.rate_rad_s[:, None, :]
    )  # [n, j]: change by a small rotation about axis j
    inverse = np.linalg.inv(matrix @ information @ matrix.T)
    noise = sensor.covariance_rad2_s2 + expected.covariance_rad2_s2
    covariance = inverse @ np.sum(by_rotation @ noise @ by_rotation.swapaxes(1, 2), axis=0) @ inverse
    return RelativeRotation(
        matrix=matrix,
        std_rad=np.sqrt(np.diag(covariance)),
        from_nominal_rad=rotation_vectors(matrix @ nominal.T),
        residuals_rad_s=sensor.rate_rad_s - expected.rate_rad_s,
    )
