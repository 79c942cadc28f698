"""Separation of a magnetometer's own bias and the field of its carrier by turning the sensor over on its holder.

In run k the sensor is mounted by the rotation M_k from the holder's axes to the sensor's. The sensor's bias b rotates
with it; the field a of its carrier (the part of the arm's iron that rotates with the flange) is fixed to the holder:

    b_k = b + F_k M_k a

b_k is the bias estimated in run k and F_k the matrix estimated with it, which includes the real mounting. With half a
revolution about one axis, on the other two axes b is half the sum and the field half the difference; along the axis
only the sum is identifiable. Half a revolution about another axis separates all three. a includes the field of the
arm's other links, which to first order is the same in all runs with the same attitudes.
"""

from dataclasses import dataclass

import numpy as np

from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.estimation.reference.magnetometer import FALSE_ALARM_PROBABILITY

MOUNTING_TOLERANCE = 1e-6  # mountings are nominal and exact


@dataclass(frozen=True, slots=True)
class Reversal:
    """The bias (3,) in the sensor's axes, the arm's field (3,) in the first run's axes, and their covariance (6, 6).

    If an axis was not turned over, its `arm_field_in_bias` is True. The axis' bias is then the sum of bias and field,
    and the axis' field is 0. The runs agree if `chi_square` is at most `limit`.
    """

    bias_t: Array
    arm_field_t: Array
    covariance: Array
    arm_field_in_bias: tuple[bool, bool, bool]
    chi_square: float
    degrees_of_freedom: int
    limit: float


def separate(biases_t: Array, covariances_t2: Array, matrices: Array, mountings: Array) -> Reversal:
    """Return the sensor's own bias and the arm's field, which K ≥ 2 runs with different mountings separate.

    Each run has a bias (K, 3) with its covariance (K, 3, 3), a matrix F (K, 3, 3), and a mounting M (K, 3, 3). Raise
    Refused `mounting_not_turned` if all mountings are equal, Fault `reversal_contradicts` if runs disagree.
    """
    from scipy.special import chdtri

    common = _find_common_directions(mountings)
    if common.shape[1] == 3:
        raise Refused(
            "mounting_not_turned",
            "the sensor had the same mounting in all runs",
            "Turn it over on its extension, state this in its `mounting`, and run again",
        )
    # Projection to the holder's directions in which a is identifiable; it is 0 in the others.
    projection = np.eye(3) - common @ common.T
    whiteners = np.linalg.inv(np.linalg.cholesky(covariances_t2))
    design = np.concatenate([np.broadcast_to(np.eye(3), matrices.shape), matrices @ mountings @ projection], axis=-1)
    whitened = (whiteners @ design).reshape(-1, 6)
    inverse = np.linalg.pinv(whitened, rcond=1e-6)
    estimate = inverse @ (whiteners @ biases_t[..., None]).reshape(-1)
    residuals = (whiteners @ (biases_t - design @ estimate)[..., None]).reshape(-1)
    chi_square, dof = float(residuals @ residuals), len(residuals) - (6 - common.shape[1])
    limit = float(chdtri(dof, FALSE_ALARM_PROBABILITY))
    if chi_square > limit:
        raise Fault(
            "reversal_contradicts",
            "the runs do not agree in the parameters that must stay the same when the sensor is turned over: "
            f"χ² is {chi_square:.3g}; noise explains at most {limit:.3g}",
            "Make sure that the sensor is in the same place in all runs and that the field did not change between "
            "them; then repeat",
        )
    # The bias stays in the sensor's axes; the field goes from the holder's axes to the sensor's in the first run.
    to_axes = np.block([[np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), mountings[0]]])
    covariance = to_axes @ (inverse @ inverse.T) @ to_axes.T
    inseparable = np.abs(mountings[0] @ common).max(axis=1, initial=0.0) > MOUNTING_TOLERANCE
    x, y, z = inseparable.tolist()
    return Reversal(estimate[:3], mountings[0] @ estimate[3:], covariance, (x, y, z), chi_square, dof, limit)


def _find_common_directions(mountings: Array) -> Array:
    """Return orthonormal directions (3, n) of the holder along which a field looks like a bias in all mountings."""
    differences = (mountings[1:] - mountings[0]).reshape(-1, 3)
    _, sizes, rows = np.linalg.svd(differences)
    alike = np.ones(3, dtype=np.bool_)
    alike[: len(sizes)] = sizes < MOUNTING_TOLERANCE
    return np.asarray(rows[alike].T, dtype=np.float64)
