"""The only attitude that determines a scale factor, so that no other attitude shows whether this one is wrong.

Repeated rests in one attitude agree even if the attitude is wrong, so they only show how well placements repeat.
"""

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from rig.estimation.reference.attitude_error import AttitudeReadings, effects, find_whiteners
from rig.estimation.reference.reference_model import REFERENCE, F, weighted_jacobian
from rig.estimation.reference.reference_model import free_directions as directions

SAME_ATTITUDE_RAD = 0.2  # largest angle between reference directions in the body that count as one attitude
USUAL_ERROR_RAD = 0.02  # of an attitude about each axis: an arm, or a table turned by hand
MAX_DETERMINED_STD = 0.1  # of a scale factor
MIN_EIGENVALUE = 1e-9  # of the information: a smaller one counts as zero


def find_sole_attitude(theta: Array, placed: AttitudeReadings) -> tuple[int, int] | None:
    """Return the axis whose scale factor depends on a single placement, and that placement; None if there is none.

    Without that placement, the scale factor's standard deviation exceeds `MAX_DETERMINED_STD`. Return None also if no
    attitude was repeated. `theta` (p,) is the solution in SI units, with scale factors about 1.
    """
    size = np.linalg.norm(theta[REFERENCE])
    verticals = np.einsum("nji,j->ni", placed.attitudes, theta[REFERENCE] / size)
    group = _group(verticals)
    if group.max() + 1 == len(group):
        return None
    whiteners = find_whiteners(placed.variances, effects(theta, placed.attitudes, placed.v_bar),
                               np.hypot(placed.attitude_std_rad, USUAL_ERROR_RAD))  # fmt: skip
    rows = weighted_jacobian(theta, placed.attitudes, placed.v_bar, whiteners, norm_known=placed.norm_known)
    rows = rows.reshape(len(verticals), 3, -1)
    free = directions(theta, norm_known=placed.norm_known)
    matrix = theta[F].reshape(3, 3)
    slopes = np.zeros((3, len(theta)))
    for axis in range(3):
        slopes[axis, 3 * axis : 3 * axis + 3] = matrix[axis] / np.linalg.norm(matrix[axis]) ** 2  # of −ln k
    wanted = slopes @ free
    usual = _find_std(rows, wanted)
    for number in np.flatnonzero(np.bincount(group) == 1).tolist():
        without = _find_std(rows[group != number], wanted)
        hanging = np.flatnonzero((without > MAX_DETERMINED_STD) & (usual <= MAX_DETERMINED_STD))
        if len(hanging):
            return int(hanging[0]), int(np.flatnonzero(group == number)[0])
    return None


def _group(verticals: Array) -> NDArray[np.intp]:
    """Return the index (N,) of each direction's group; a group contains the directions (N, 3) near its first one."""
    group = np.full(len(verticals), -1, dtype=np.intp)
    for first in range(len(verticals)):
        if group[first] < 0:
            near = (verticals @ verticals[first] > np.cos(SAME_ATTITUDE_RAD)) & (group < 0)
            group[near] = group.max() + 1
    return group


def _find_std(rows: Array, wanted: Array) -> Array:
    """Return the std (k,) that whitened rows (N, 3, q) give to the combinations `wanted` (k, q) of q parameters."""
    flat = rows.reshape(-1, rows.shape[-1])
    scale = np.linalg.norm(flat, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh((flat / scale).T @ (flat / scale))
    spread = (wanted / scale) @ vectors
    return np.asarray(np.sqrt(np.sum(spread**2 / np.maximum(values, MIN_EIGENVALUE), axis=1)), dtype=np.float64)
