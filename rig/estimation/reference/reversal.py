"""A magnetometer's own bias and the field of what carries it, told apart by turning the sensor over on its holder.

In run k the sensor is mounted by the rotation M_k from the holder's axes to its own. Its bias b goes with it, the field
a of what it is mounted on (the arm's iron, as far as it turns with the flange) stays with the holder:

    b_k = b + F_k M_k a

where b_k is the bias found as mounted and F_k the matrix found with it, which knows how the sensor really sat. Half a
turn about one axis: b is half the sum and the field half the difference on the other two axes, and along it they stay
together. A second one about another axis tells all three. What the arm's other links do at the sensor is the same in
all runs with the same attitudes, to first order, and goes with a.
"""

from dataclasses import dataclass

import numpy as np

from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.estimation.reference.magnetometer import FALSE_ALARM

SAME = 1e-6  # of mountings, which are nominal and exact


@dataclass(frozen=True, slots=True)
class Reversal:
    """`bias_t` b (3,) in the sensor's axes, and `arm_field_t` (3,) in them as mounted in the first run; `covariance`
    (6, 6) of both.

    On an axis that was not turned over, `arm_field_in_bias`, the sum of both stands in the bias and 0 in the field.
    `chi_square` says whether the runs agree on what they share.
    """

    bias_t: Array
    arm_field_t: Array
    covariance: Array
    arm_field_in_bias: tuple[bool, bool, bool]
    chi_square: float
    degrees_of_freedom: int
    limit: float


def separate(biases_t: Array, covariances_t2: Array, matrices: Array, mountings: Array) -> Reversal:
    """Sensor and arm told apart by K ≥ 2 runs: biases (K, 3) with covariances (K, 3, 3), F and M (K, 3, 3).

    Raises Refused `mounting_not_turned` where all mountings are one, Fault `reversal_contradicts` where the runs do not
    agree on what turning over leaves alone.
    """
    from scipy.special import chdtri

    together = _together(mountings)
    if together.shape[1] == 3:
        raise Refused(
            "mounting_not_turned",
            "the sensor had the same mounting in all runs",
            "Turn it over on its extension, state this in its `mounting`, and run again",
        )
    # The directions of the holder's in which a is found; it is 0 in the others.
    told = np.eye(3) - together @ together.T
    white = np.linalg.inv(np.linalg.cholesky(covariances_t2))
    design = np.concatenate([np.broadcast_to(np.eye(3), matrices.shape), matrices @ mountings @ told], axis=-1)
    whitened = (white @ design).reshape(-1, 6)
    inverse = np.linalg.pinv(whitened, rcond=1e-6)
    found = inverse @ (white @ biases_t[..., None]).reshape(-1)
    left = (white @ (biases_t - design @ found)[..., None]).reshape(-1)
    chi_square, freedom = float(left @ left), len(left) - (6 - together.shape[1])
    limit = float(chdtri(freedom, FALSE_ALARM))
    if chi_square > limit:
        raise Fault(
            "reversal_contradicts",
            "the runs do not agree in what must stay the same when the sensor is turned over: "
            f"χ² is {chi_square:.3g}, at most {limit:.3g} by noise",
            "See that the sensor sits in the same place in all runs and the field did not change between them; repeat",
        )
    to_axes = np.block([[np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), mountings[0]]])
    covariance = to_axes @ (inverse @ inverse.T) @ to_axes.T
    mixed = np.abs(mountings[0] @ together).max(axis=1, initial=0.0) > SAME
    x, y, z = mixed.tolist()
    return Reversal(found[:3], mountings[0] @ found[3:], covariance, (x, y, z), chi_square, freedom, limit)


def _together(mountings: Array) -> Array:
    """(3, n) orthonormal directions of the holder's whose fields look alike in all mountings, and so like a bias."""
    differences = (mountings[1:] - mountings[0]).reshape(-1, 3)
    _, sizes, rows = np.linalg.svd(differences)
    alike = np.ones(3, dtype=np.bool_)
    alike[: len(sizes)] = sizes < SAME
    return np.asarray(rows[alike].T, dtype=np.float64)
