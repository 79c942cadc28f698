"""How two triads on one flange are turned against each other, a gyroscope and an accelerometer above all.

Each triad's right-angled frame is the one nearest to its axes, the orthogonal factor of their polar decomposition, as
`rig.estimation.sensor_axes` and the correction of readings have it. Both F hold the mounting to the same flange.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array, rotation_vectors
from rig.estimation.refusals import check_finite, check_handedness, require_shape
from rig.estimation.sensor_axes import SensorAxes


@dataclass(frozen=True, slots=True)
class Alignment:
    """`rotation` (3, 3) takes a vector of the gyroscope's frame into the accelerometer's.

    `vector_rad` (3,) is the same as a rotation vector; `covariance_rad2` (3, 3) of small turns about the
    accelerometer's x, y, z.
    """

    rotation: Array
    vector_rad: Array
    covariance_rad2: Array


def alignment(
    gyroscope: ArrayLike,
    accelerometer: ArrayLike,
    gyroscope_covariance: ArrayLike,
    accelerometer_covariance: ArrayLike,
) -> Alignment:
    """How two triads are aligned, from F (3, 3) of both and the covariances (9, 9) of their rows.

    The two are taken to be independent: what an arm's error does to both alike is counted twice. Raises Fault
    `not_finite`, `mirrored_axis`; ValueError for a wrong shape.
    """
    of_gyroscope, gyroscope_turns = _frame(gyroscope, gyroscope_covariance)
    of_accelerometer, accelerometer_turns = _frame(accelerometer, accelerometer_covariance)
    rotation = of_accelerometer @ of_gyroscope.T
    return Alignment(
        rotation=rotation,
        vector_rad=rotation_vectors(rotation),
        covariance_rad2=accelerometer_turns + rotation @ gyroscope_turns @ rotation.T,
    )


def _frame(matrix: ArrayLike, covariance: ArrayLike) -> tuple[Array, Array]:
    """The rotation (3, 3) from the flange's frame into the triad's, and the covariance (3, 3) of small turns there."""
    f, of_rows = (np.asarray(each, dtype=np.float64) for each in (matrix, covariance))
    require_shape("matrix", f, (3, 3))
    require_shape("covariance", of_rows, (9, 9))
    check_finite(matrix=f, covariance=of_rows)
    check_handedness(f)
    axes = SensorAxes.of(f)
    return axes.mounting, axes.angles_covariance_rad2(of_rows)[3:, 3:]
