"""Single readings at rest that are due to a knock against the table: they show neither gravity nor a field."""

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import Quantity
from rig.estimation.arrays import Array
from rig.observation.by_hand.steadiness import NORMAL

KNOCK = 8.0  # standard deviations: a larger deviation is not noise
COARSE = 2.0  # steps of the readings: noise below the resolution deviates as far
COUNTS = 0.05  # of a quantity's steadiness: a smaller knock does not matter
MOST = 0.1  # of the readings: more outliers are noise of another kind
FEWEST = 5  # readings, most of which are undisturbed


def mask_knocks(readings: Array, quantity: Quantity) -> NDArray[np.bool_]:
    """Return a mask (n,) of the readings (n, 3) at rest without those during knocks."""
    kept: NDArray[np.bool_] = np.ones(len(readings), dtype=np.bool_)
    if len(readings) < FEWEST:
        return kept
    deviations = np.abs(readings - np.median(readings, axis=0))
    typical = NORMAL * np.median(deviations, axis=0)
    limit = np.maximum(KNOCK * typical, COUNTS * quantity.steady)
    limit = np.maximum(limit, COARSE * smallest_steps(readings))
    kept = ~np.any(deviations > limit, axis=1)
    return kept if np.count_nonzero(~kept) <= MOST * len(kept) else np.ones(len(kept), dtype=np.bool_)


def smallest_steps(readings: Array) -> Array:
    """Return the smallest difference between distinct readings (n, 3), by axis: an estimate of their resolution."""
    return np.array([np.diff(np.unique(axis)).min() if np.ptp(axis) > 0 else 0.0 for axis in readings.T])
