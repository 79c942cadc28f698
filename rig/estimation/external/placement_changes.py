"""An abrupt change of a sensor between two of the placements in which it measured a constant reference.

    v_m = F s + (b  +  h  or  diag(h) F s) [m ≥ r] + E ε + η + noise

ε and η are the errors of `rig.estimation.external.placement`, whose sizes the placements themselves determine.
"""

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.external.abrupt_change import OF_SCALE, AbruptChange, PossibleChanges, find_change
from rig.estimation.external.placement import USUAL
from rig.estimation.reference.attitude_error import Placed, effects
from rig.estimation.reference.reference_model import BIAS, REFERENCE, free_directions, jacobian, predicted
from rig.estimation.statistics.variance_components import Mixed, MixedModel

FEWEST = 8  # placements; fewer show no change, or take a wrong attitude for one
EITHER_SIDE = 2  # placements at least: a single one that differs is a wrong placement
USUAL_RAD = 3e-3  # median of the prior of the attitudes' errors
BIAS_SIZES = (1e-3, 1e-2)  # prior standard deviations of a change of the bias, relative to the reference
SMALL = 0.01  # errors without the change, relative to those with it: the errors' sizes may contain it
POSSIBLE = 0.0  # least evidence


def find_placement_change(theta: Array, placed: Placed, starts_s: Array) -> AbruptChange | None:
    """Return the abrupt change that N placements in the order of time show, None if they show none.

    `theta` (p,) is the solution without a change; the placements begin at `starts_s` (N,).
    """
    count = len(starts_s)
    if count < FEWEST:
        return None
    attitudes, v_bar = placed.attitudes, placed.v_bar
    tilts = effects(theta, attitudes, v_bar)
    free = free_directions(theta, norm_known=placed.norm_known)
    stated = tilts * placed.attitude_std_rad[:, None, None]
    noise = np.eye(3) * placed.variances[:, :, None] + stated @ np.swapaxes(stated, -1, -2)
    size = float(np.linalg.norm(theta[REFERENCE]))
    mixed = Mixed(
        observed=(placed.readings - predicted(theta, attitudes, v_bar)).ravel(),
        design=(jacobian(theta, attitudes, v_bar) @ free).reshape(3 * count, -1),
        fixed=_block_diagonal(noise),
        components=np.array([_block_diagonal(tilts @ np.swapaxes(tilts, -1, -2)), np.eye(3 * count)]),
        precision=np.zeros(free.shape[1]),
        scales=np.array([USUAL_RAD, USUAL * size]),
        alone=np.zeros((2, 2)),
    )
    model = MixedModel(mixed)
    std = model.find_maxima()[0]
    axes = np.tile(np.eye(3), (count, 1, 1))
    index = np.arange(count)
    inner = np.repeat((np.minimum(index, count - index) >= EITHER_SIDE)[:, None], 3, axis=1)
    read = predicted(theta, attitudes, v_bar) - theta[BIAS]
    changes = [PossibleChanges("bias", ratio * size * axes, inner, ratio * size) for ratio in BIAS_SIZES]
    changes.append(PossibleChanges("scale", OF_SCALE * axes * read[:, None, :], inner, OF_SCALE))
    return find_change(model, np.array([std, SMALL * std]), changes, starts_s, POSSIBLE)


def _block_diagonal(blocks: Array) -> Array:
    """Return the matrix (3N, 3N) of N blocks (3, 3) on its diagonal."""
    count = len(blocks)
    matrix = np.zeros((count, 3, count, 3))
    index = np.arange(count)
    matrix[index, :, index, :] = blocks
    return matrix.reshape(3 * count, 3 * count)
