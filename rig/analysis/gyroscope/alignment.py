"""How two sensors on one board are turned against each other: from the mean rates both saw in the same revolutions."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array, rotation_vectors
from rig.observation.observe import Observation

MIN_INDEPENDENCE = 1e-3  # least over greatest information about a turn; revolutions about one axis alone have none


class AlignedCalibration(Protocol):
    """correction_matrix (3, 3) and bias_rad_s (3,) of g = M (m + b)."""

    @property
    def correction_matrix(self) -> Array: ...
    @property
    def bias_rad_s(self) -> Array: ...


@dataclass(frozen=True, slots=True)
class MeanRates:
    """Mean rates of n revolutions (n, 3) with their covariances (n, 3, 3) in (rad/s)²."""

    rate_rad_s: Array
    covariance_rad2_s2: Array

    def turned(self, matrix: Array) -> "MeanRates":
        """The mean rates in another frame, or corrected, by a matrix (3, 3)."""
        return MeanRates(self.rate_rad_s @ matrix.T, matrix @ self.covariance_rad2_s2 @ matrix.T)


@dataclass(frozen=True, slots=True)
class RelativeRotation:
    """`matrix` (3, 3) takes a vector of the reference's frame into the sensor's.

    `std_rad` (3,) belongs to small turns about the sensor's x, y, z, from the readings' noise alone.
    `from_nominal_rad` (3,), in the sensor's frame, is the rotation vector by which it departs from what the two nominal
    mountings imply. `residuals_rad_s` (n, 3) is what no rotation explains: noise, errors of scale and bias, and axes
    that are not at right angles.
    """

    matrix: Array
    std_rad: Array
    from_nominal_rad: Array
    residuals_rad_s: Array

    @property
    def vector_rad(self) -> Array:
        """(3,) rotation vector, rad: its direction is the axis of the turn, its length the angle."""
        return rotation_vectors(self.matrix)


def mean_rates(observations: Sequence[Observation], calibration: AlignedCalibration | None = None) -> MeanRates:
    """The mean rates of a sensor's revolutions, corrected; without a calibration, as the sensor read them."""
    means = np.array([observation.average.mean_rad_s for observation in observations])
    variances = np.array([observation.average.variance_rad2_s2 for observation in observations])
    raw = MeanRates(means, variances[:, :, None] * np.eye(3))
    if calibration is None:
        return raw
    return MeanRates(means + calibration.bias_rad_s, raw.covariance_rad2_s2).turned(calibration.correction_matrix)


def relative_rotation(sensor: MeanRates, reference: MeanRates, nominal: Array) -> RelativeRotation:
    """The rotation R that makes Σ ‖sensor − R reference‖² least; `nominal` (3, 3) is R by the nominal mountings.

    Kabsch's solution by SciPy. Its uncertainty: to first order the sensor sees R r + δθ × R r, so δθ is a linear
    least-squares estimate with the noise of both sensors. Errors of scale lie along the axes turned about and biases
    cancel between the two directions, so neither turns R. Raises Fault `rank_deficient`.
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
    matrix = Rotation.align_vectors(sensor.rate_rad_s, v)[0].as_matrix()
    expected = reference.turned(matrix)
    by_turn = np.cross(np.eye(3), expected.rate_rad_s[:, None, :])  # [n, j]: what a small turn about axis j changes
    inverse = np.linalg.inv(matrix @ information @ matrix.T)
    noise = sensor.covariance_rad2_s2 + expected.covariance_rad2_s2
    covariance = inverse @ np.sum(by_turn @ noise @ by_turn.swapaxes(1, 2), axis=0) @ inverse
    return RelativeRotation(
        matrix=matrix,
        std_rad=np.sqrt(np.diag(covariance)),
        from_nominal_rad=rotation_vectors(matrix @ nominal.T),
        residuals_rad_s=sensor.rate_rad_s - expected.rate_rad_s,
    )
