"""An abrupt change of a sensor between two of the placements in which it measured a constant reference.

    v_m = F s + b + (h  or  diag(h) F s) [m ≥ r] + errors of the placements + noise

The errors are those of `rig.estimation.external.placement_model`, whose sizes the placements themselves determine.
"""

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.external.abrupt_change import OF_SCALE, AbruptChange, PossibleChanges, find_change
from rig.estimation.external.placement_model import MOST, build_placement_model
from rig.estimation.reference.attitude_error import Placed
from rig.estimation.reference.reference_model import BIAS, REFERENCE, predicted

FEWEST = 8  # placements; fewer show no change, or take a wrong attitude for one
EITHER_SIDE = 2  # placements at least: a single one that differs is a wrong placement
BIAS_SIZES = (1e-3, 1e-2)  # prior standard deviations of a change of the bias, relative to the reference
SMALL = 0.01  # scale of the errors tried in addition to the estimate, which the change may have inflated
POSSIBLE = 0.0  # least evidence (ln of the Bayes factor) of a change


def find_placement_change(theta: Array, placed: Placed, starts_s: Array) -> AbruptChange | None:
    """Return the abrupt change that N placements in the order of time show, None if they show none.

    `theta` (p,) is the solution without a change; the placements begin at `starts_s` (N,).
    """
    count = len(starts_s)
    if not FEWEST <= count <= MOST:
        return None
    model = build_placement_model(theta, placed, count)
    std = model.find_maxima()[0]
    axes = np.tile(np.eye(3), (count, 1, 1))
    index = np.arange(count)
    inner = np.repeat((np.minimum(index, count - index) >= EITHER_SIDE)[:, None], 3, axis=1)
    size = float(np.linalg.norm(theta[REFERENCE]))
    read = predicted(theta, placed.attitudes, placed.v_bar) - theta[BIAS]
    changes = [PossibleChanges("bias", ratio * size * axes, inner, ratio * size) for ratio in BIAS_SIZES]
    changes.append(PossibleChanges("scale", OF_SCALE * axes * read[:, None, :], inner, OF_SCALE))
    return find_change(model, np.array([std, SMALL * std]), changes, starts_s, POSSIBLE)
