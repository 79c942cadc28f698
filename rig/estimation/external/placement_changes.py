"""An abrupt change of a sensor between two of the placements in which it measured a constant reference.

    v_m = F s + b + (h  or  diag(h) F s,  from one placement on) + errors of the placements + noise

v_m is a reading of the reference s by a sensor with the matrix F and the bias b; h (3,) is the change of the bias, or
the relative change of each axis' scale factor. The errors are those of `rig.estimation.external.placement_model`; the
placements themselves determine the sizes of these errors.
"""

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.external.abrupt_change import SCALE_STD, AbruptChange, PossibleChanges, find_change
from rig.estimation.external.placement_model import MAX_CORRELATED, build_placement_model
from rig.estimation.reference.attitude_error import AttitudeReadings
from rig.estimation.reference.reference_model import BIAS, REFERENCE, predicted

MIN_PLACEMENTS = 8  # fewer show no change, or take a wrong attitude for one
MIN_EITHER_SIDE = 2  # placements: a single one that differs is a wrong placement
BIAS_CHANGE_STD_RATIOS = (1e-3, 1e-2)  # prior, relative to the reference
SMALL_ERROR_RATIO = 0.01  # scale of the errors tried in addition to the estimate, which the change may have inflated
MIN_EVIDENCE = 0.0  # ln of the Bayes factor of a change


def find_placement_change(theta: Array, placed: AttitudeReadings, starts_s: Array) -> AbruptChange | None:
    """Return the abrupt change that N placements in the order of time show, None if they show none.

    `theta` (p,) is the solution without a change; the placements begin at `starts_s` (N,).
    """
    count = len(starts_s)
    if not MIN_PLACEMENTS <= count <= MAX_CORRELATED:
        return None
    model = build_placement_model(theta, placed, count)
    std = model.find_maxima()[0]
    axes = np.tile(np.eye(3), (count, 1, 1))
    index = np.arange(count)
    inner = np.repeat((np.minimum(index, count - index) >= MIN_EITHER_SIDE)[:, None], 3, axis=1)
    size = float(np.linalg.norm(theta[REFERENCE]))
    read = predicted(theta, placed.attitudes, placed.v_bar) - theta[BIAS]
    changes = [PossibleChanges("bias", ratio * size * axes, inner, ratio * size) for ratio in BIAS_CHANGE_STD_RATIOS]
    changes.append(PossibleChanges("scale", SCALE_STD * axes * read[:, None, :], inner, SCALE_STD))
    return find_change(model, np.array([std, SMALL_ERROR_RATIO * std]), changes, starts_s, MIN_EVIDENCE)
