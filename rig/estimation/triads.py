"""The relative rotation of two triads on one flange, above all of a gyroscope and an accelerometer.

A triad's right-angled frame is the one nearest to its axes, the orthogonal factor of their polar decomposition, as in
`rig.estimation.sensor_axes`. The matrices F of both triads include the mounting on this flange.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array, rotation_vectors
from rig.estimation.refusals import check_finite, check_handedness, require_shape
from rig.estimation.sensor_axes import SensorAxes


@dataclass(frozen=True, slots=True)
class Alignment:
    """The `rotation` (3, 3) from the gyroscope's frame to the accelerometer's.

    `vector_rad` (3,) is the rotation vector of this rotation; `covariance_rad2` (3, 3) is the covariance of small
    rotations about the accelerometer's x, y, z.
    """

    rotation: Array
    vector_rad: Array
    covariance_rad2: Array


def align_triads(
    gyroscope: ArrayLike,
    accelerometer: ArrayLike,
    gyroscope_covariance: ArrayLike,
    accelerometer_covariance: ArrayLike,
) -> Alignment:
    """Return the alignment of two triads from their matrices F (3, 3) and the covariances (9, 9) of F, row by row.

    The triads' errors are treated as independent, so shared errors of the arm count twice. Raise Fault `not_finite`,
    `mirrored_axis`; ValueError for a wrong shape.
    """
    gyroscope_frame, gyroscope_turns = _frame(gyroscope, gyroscope_covariance)
    accelerometer_frame, accelerometer_turns = _frame(accelerometer, accelerometer_covariance)
    rotation = accelerometer_frame @ gyroscope_frame.T
    return Alignment(
        rotation=rotation,
        vector_rad=rotation_vectors(rotation),
        covariance_rad2=accelerometer_turns + rotation @ gyroscope_turns @ rotation.T,
    )


def _frame(matrix: ArrayLike, covariance: ArrayLike) -> tuple[Array, Array]:
    """Return the rotation (3, 3) from the flange's frame to the triad's, and its covariance (3, 3)."""
    f, of_rows = (np.asarray(value, dtype=np.float64) for value in (matrix, covariance))
    require_shape("matrix", f, (3, 3))
    require_shape("covariance", of_rows, (9, 9))
    check_finite(matrix=f, covariance=of_rows)
    check_handedness(f)
    axes = SensorAxes.from_matrix(f)
    return axes.mounting, axes.angles_covariance_rad2(of_rows)[3:, 3:]
