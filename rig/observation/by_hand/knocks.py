"""Single readings at rest that are due to a knock against the table, not to gravity or a field."""

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import Quantity
from rig.estimation.arrays import MAD_TO_STD, Array

KNOCK_STDS = 8.0  # deviation beyond which it is not noise
COARSE_STEPS = 2.0  # deviation in steps of the readings: noise below the resolution deviates by as much
MIN_KNOCK_FRACTION = 0.05  # of `Quantity.steady`
MAX_OUTLIER_FRACTION = 0.1  # more of them are noise of another kind
MIN_READINGS = 5  # that show which of them are undisturbed


def mask_knocks(readings: Array, quantity: Quantity) -> NDArray[np.bool_]:
    """Return a mask (n,) of the readings (n, 3) at rest that are free of knocks.

    If more than a small fraction of the readings deviates, no reading counts as a knock.
    """
    kept: NDArray[np.bool_] = np.ones(len(readings), dtype=np.bool_)
    if len(readings) < MIN_READINGS:
        return kept
    deviations = np.abs(readings - np.median(readings, axis=0))
    typical = MAD_TO_STD * np.median(deviations, axis=0)
    limit = np.maximum(KNOCK_STDS * typical, MIN_KNOCK_FRACTION * quantity.steady)
    limit = np.maximum(limit, COARSE_STEPS * smallest_steps(readings))
    kept = ~np.any(deviations > limit, axis=1)
    return kept if np.count_nonzero(~kept) <= MAX_OUTLIER_FRACTION * len(kept) else np.ones(len(kept), dtype=np.bool_)


def smallest_steps(readings: Array) -> Array:
    """Return the smallest difference (3,) between distinct readings (n, 3) of each axis: an estimate of resolution."""
    return np.array([np.diff(np.unique(axis)).min() if np.ptp(axis) > 0 else 0.0 for axis in readings.T])
