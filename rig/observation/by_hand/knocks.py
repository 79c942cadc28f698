"""Single readings of a body at rest that a knock against the table made: they tell nothing of gravity or a field."""

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import Quantity
from rig.estimation.arrays import Array
from rig.observation.by_hand.steadiness import NORMAL

KNOCK = 8.0  # standard deviations, from which on a reading is none of the noise's
COARSE = 2.0  # steps of the readings, which noise below the resolution takes too
COUNTS = 0.05  # of what is steady: no knock is smaller that matters
MOST = 0.1  # of the readings: more are no knocks, but noise of another kind
FEWEST = 5  # readings, of which most feel nothing


def without_knocks(readings: Array, quantity: Quantity) -> NDArray[np.bool_]:
    """Return which of the readings (n, 3) at rest no knock has made."""
    kept: NDArray[np.bool_] = np.ones(len(readings), dtype=np.bool_)
    if len(readings) < FEWEST:
        return kept
    off = np.abs(readings - np.median(readings, axis=0))
    deviation = NORMAL * np.median(off, axis=0)
    farthest = np.maximum(KNOCK * deviation, COUNTS * quantity.steady)
    farthest = np.maximum(farthest, COARSE * smallest_steps(readings))
    kept = ~np.any(off > farthest, axis=1)
    return kept if np.count_nonzero(~kept) <= MOST * len(kept) else np.ones(len(kept), dtype=np.bool_)


def smallest_steps(readings: Array) -> Array:
    """Return the smallest step between readings (n, 3) that differ, by axis: their resolution, if it shows."""
    return np.array([np.diff(np.unique(axis)).min() if np.ptp(axis) > 0 else 0.0 for axis in readings.T])
