"""A check that a log of readings was made at rest, from the readings themselves."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import Quantity
from rig.errors import Fault
from rig.estimation.arrays import MAD_TO_STD, Array, interpolate
from rig.observation.time_stamps.sampling import Sampling

BLOCK_S = 1.0
MAX_NOISE_STDS = 6.0  # difference due to noise
MAX_GAP_S, MAX_GAP_FRACTION = 0.25, 0.01  # at rest: longer gaps are not ignored; readings missing in such gaps
MAX_SCATTER_RATIO = 10.0  # noise of readings, relative to the quantity's largest change from second to second
REMEDY = "Give a log of a sensor that lay still all the time; cut off its beginning and its end, where it was moved"


def contiguous_slices(time_s: Array, sampling: Sampling) -> Iterator[slice]:
    """Yield a slice of rows from each gap to the next, in a log with increasing times (n,).

    A few missing readings are no gap, because `fill_missing` interpolates them, which hardly reduces the noise.
    """
    gaps = sampling.gaps(time_s)
    short = gaps & (np.diff(time_s) <= MAX_GAP_S)
    if sampling.missing[short].sum() <= MAX_GAP_FRACTION * len(time_s) and sampling.late is None:
        gaps &= ~short
    yield from (slice(start, end) for start, end in pairwise([0, *(1 + np.flatnonzero(gaps)).tolist(), len(time_s)]))


def fill_missing(readings: Array, numbers: NDArray[np.intp]) -> Array:
    """Return the readings (n, 3) with missing readings interpolated; gaps in `numbers` (n,) show which are missing."""
    every = np.arange(numbers[0], numbers[-1] + 1)
    if len(every) == len(readings):
        return readings
    return interpolate(every, numbers, readings)


def check_at_rest(time_s: Array, readings: Array, quantity: Quantity) -> None:
    """Raise Fault `not_at_rest` if readings (n, 3) at times (n,) scatter or change by more than noise.

    The readings of a moving sensor, if taken at long intervals, may change as randomly as noise. They are recognised by
    their scatter, because no sensor at rest is as noisy.
    """
    scatter = MAD_TO_STD * np.median(np.abs(readings - np.median(readings, axis=0)), axis=0)
    if (largest := float(scatter.max())) > MAX_SCATTER_RATIO * quantity.steady:
        raise Fault(
            "not_at_rest",
            f"the {quantity} scatters by {largest:.2g} {quantity.unit}, more than any sensor's noise",
            REMEDY,
        )
    block = np.floor((time_s - time_s[0]) / BLOCK_S).astype(np.intp)
    block = np.unique(block, return_inverse=True)[1]  # none is empty
    count = np.bincount(block)
    means = np.column_stack([np.bincount(block, weights=axis) / count for axis in readings.T])
    noise = MAD_TO_STD * np.median(np.abs(np.diff(readings, axis=0)), axis=0) / np.sqrt(2)
    fewest = np.minimum(count[1:], count[:-1])[:, None]
    excess = np.abs(np.diff(means, axis=0)) - MAX_NOISE_STDS * noise * np.sqrt(2 / fewest)
    if len(excess) and (worst := float(excess.max())) > quantity.steady:
        at_s = float(time_s[np.searchsorted(block, int(excess.max(axis=1).argmax()) + 1)])
        raise Fault(
            "not_at_rest",
            f"about {at_s:.1f} s the {quantity} changes by {worst:.2g} {quantity.unit} within a second or two, "
            "more than by its noise",
            REMEDY,
        )
