"""Abrupt changes between the increments of a recording: of the gyroscope, and of the attitudes' own coordinates."""

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array, equal_runs, rotation_vectors
from rig.estimation.external.abrupt_change import LIKELY_EVIDENCE, SCALE_STD, AbruptChange, PossibleChanges, find_change
from rig.estimation.external.attitude_drift import BIAS, MATRIX, FixedAttitudes, Fixes
from rig.estimation.statistics.variance_components import MixedModel

BIAS_STD_RAD_S = 5e-3  # prior of a change of the bias
ATTITUDE_STD_RAD = 0.2  # prior of a rotation of the attitudes' coordinates
MIN_RESET_RAD = 0.02  # that is reported: errors of attitudes may be as large
MIN_LASTING_RATIO = 0.5  # rotation over all increments to the largest one: after a wild row the attitudes return


def find_increment_change(
    model: MixedModel, std: Array, averaged: FixedAttitudes, fixes: Fixes, matrix: Array
) -> AbruptChange | None:
    """Return the abrupt change that the increments show, None if they show none.

    `model` describes the increments between `fixes`, with the errors' most probable standard deviations `std` (k,);
    `matrix` (3, 3) is the gyroscope's. The change's time is on the attitudes' clock.
    """
    sensitivities = np.diff(averaged.sensitivities, axis=0)[fixes.joined]
    of_rows = sensitivities[..., MATRIX].reshape(-1, 3, 3, 3)  # sensitivities to F's elements, by row and column
    possible = np.repeat((np.arange(len(sensitivities)) > 0)[:, None], 3, axis=1)
    of_attitude = np.tile(ATTITUDE_STD_RAD * np.eye(3), (len(sensitivities), 1, 1))
    effects = (
        PossibleChanges("bias", BIAS_STD_RAD_S * sensitivities[..., BIAS], possible, BIAS_STD_RAD_S),
        PossibleChanges("scale", SCALE_STD * np.einsum("niab,ab->nia", of_rows, matrix), possible, SCALE_STD),
        PossibleChanges("attitude", of_attitude, possible, ATTITUDE_STD_RAD, lasts=False),
    )
    begins_s = fixes.at_s[np.searchsorted(fixes.fix, np.flatnonzero(fixes.joined))]
    return find_change(model, std[None], effects, begins_s, LIKELY_EVIDENCE)


def find_reset(
    averaged: FixedAttitudes, fixes: Fixes, aside: NDArray[np.bool_], change: AbruptChange | None
) -> tuple[float, float] | None:
    """Return time and angle (rad) of the largest lasting rotation of the attitudes' coordinates, or None.

    A new origin of the reference rotates all later attitudes, so the rotations of consecutive outliers add up to a
    lasting one. At a single wrong attitude, the rotations of the increments before and after it cancel. The mask
    `aside` shows which increments between `fixes` are outliers. A `change` of the attitudes, found among the other
    increments, is returned if it is larger.
    """
    turned: tuple[float, float] | None = None
    if change is not None and change.what == "attitude" and np.linalg.norm(change.sizes) > MIN_RESET_RAD:
        turned = change.from_s, float(np.linalg.norm(change.sizes))
    for start, end in equal_runs(aside).tolist():
        if not aside[start]:
            continue
        attitudes = averaged.attitudes[start : end + 1]
        singly = rotation_vectors(np.swapaxes(attitudes[:-1], -1, -2) @ attitudes[1:])
        angle_rad = float(np.linalg.norm(rotation_vectors((attitudes[0].T @ attitudes[-1])[None])))
        largest_rad = float(np.linalg.norm(singly, axis=1).max())
        if angle_rad > max(MIN_RESET_RAD, MIN_LASTING_RATIO * largest_rad, 0.0 if turned is None else turned[1]):
            turned = float(fixes.at_s[np.searchsorted(fixes.fix, end)]), angle_rad
    return turned
