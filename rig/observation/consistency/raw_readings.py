"""Raw readings of a revolution, a rest or a dwell, with their residuals. Pure functions."""

from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import Quantity
from rig.estimation.arrays import MAD_TO_STD, Array, median
from rig.observation.average import Stream
from rig.observation.statistics.coloured_noise import innovations

REST = -1  # instead of the index of a revolution
PREDICTOR_ORDER = 12  # earlier readings from which a reading is predicted


@dataclass(frozen=True, slots=True)
class RawReadings:
    """Raw readings of one revolution, rest or dwell.

    - sweep: index among the sensor's revolutions, −1 for a rest or dwell.
    - counts (n, 3): the readings as recorded.
    - residual_counts (m, 3): readings minus the mean of their segment and minus the vibration, only of samples at which
      the motion was recorded.
    - vibration_counts (3,): RMS of the arm's vibration.
    - vibration_rad2 (3,): mean square of the body's rotation by vibration from one random time of a rest to another.
    """

    sweep: int
    counts: NDArray[np.int64]
    residual_counts: Array
    vibration_counts: Array
    vibration_rad2: Array = field(default_factory=partial(np.zeros, 3))


def counts_of(stream: Stream, quantity: Quantity, inside: slice) -> NDArray[np.int64]:
    """Return the counts (n, 3) of a quantity as recorded, in the samples of the slice `inside`."""
    counts: NDArray[np.int64] = stream.sensor.channel(quantity).counts(stream.raw)[inside].astype(np.int64)
    return counts


def innovation_std(counts: NDArray[np.int64]) -> Array:
    """Return the standard deviation (3,), in counts, of the noise of a reading.

    The noise is the error of predicting a reading from previous ones. This excludes drift and vibration, because they
    shift neighbouring readings together.
    """
    return np.array([_innovation_std(axis - axis.mean()) for axis in counts.T])


def _innovation_std(readings: Array) -> float:
    """Return the standard deviation of the error of predicting readings (n,) from `PREDICTOR_ORDER` earlier ones."""
    if len(readings) < 4 * PREDICTOR_ORDER:
        return float(np.std(np.diff(readings)) / np.sqrt(2)) if len(readings) > 1 else 0.0
    return float(MAD_TO_STD * median(np.abs(innovations(readings, PREDICTOR_ORDER))))
