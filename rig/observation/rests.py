"""When a body lay still, as its sensors' readings alone tell.

A recording is cut into blocks of a quarter of a second. A block is at rest where the readings scatter no more than a
few times as much as in the quietest tenth of all blocks, and where a gyroscope reads what it reads at rest: the blocks
that agree with its smallest reading. Blocks that follow each other and read the same are one rest.

A gyroscope alone decides where there is one: it feels every turn, and no knock against the table.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rig.data.installed_kinds import quantities
from rig.data.quantity import RATE, Quantity
from rig.estimation.arrays import Array
from rig.observation.steadiness import BEYOND
from rig.observation.windows import Window

BLOCK_S, FEWEST = 0.25, 5  # samples of a block
QUIETEST, AS_QUIET = 0.1, 3.0  # share of the blocks that tell the noise; times as much is at rest as well
COUNTS = 0.2  # of what is steady: so much may always scatter, where the noise is below the resolution
FIRST = 4  # blocks of the first second
GAP = 2.5  # intervals


def find_rests(time_s: Array, readings: Mapping[Quantity, Array], still_at_first: bool = False) -> tuple[Window, ...]:
    """Rests of two blocks and longer, by readings (n, 3) of one quantity or several at rising times (n,).

    `still_at_first`: the body was as still in the first second as it ever is meant to be.
    """
    quantity = next(each for each in quantities().values() if each in readings)
    interval_s = float(np.median(np.diff(time_s)))
    width = max(FEWEST, int(np.ceil(BLOCK_S / interval_s)))
    count = len(time_s) // width
    if count < 2:
        return ()
    times = time_s[: count * width].reshape(count, width)
    blocks = readings[quantity][: count * width].reshape(count, width, -1)
    means, scatter = blocks.mean(axis=1), blocks.std(axis=1)
    noise = np.maximum(np.quantile(scatter, QUIETEST, axis=0), COUNTS * quantity.steady)
    if still_at_first:
        noise = np.maximum(noise, np.median(scatter[:FIRST], axis=0))
    apart = quantity.steady + BEYOND * noise * np.sqrt(2 / width)
    still = (scatter <= AS_QUIET * noise).all(axis=1) & (np.diff(times, axis=1).max(axis=1) <= GAP * interval_s)
    if quantity == RATE and still.any():
        still &= _unturned(means, still, apart)
    follows = times[1:, 0] - times[:-1, -1] <= GAP * interval_s
    follows &= (np.abs(np.diff(means, axis=0)) <= apart).all(axis=1)
    joined = np.concatenate([[False], still[:-1] & still[1:] & follows, [False]])
    edges = np.flatnonzero(np.diff(joined.astype(np.int8))).reshape(-1, 2)
    return tuple(Window(float(times[first, 0]), float(times[last, -1])) for first, last in edges.tolist())


def _unturned(means: Array, still: NDArray[np.bool_], apart: Array) -> NDArray[np.bool_]:
    """(count,) blocks that read what a gyroscope reads at rest."""
    smallest = means[still][np.argmin(np.linalg.norm(means[still], axis=1))]
    near = still & (np.abs(means - smallest) <= apart).all(axis=1)
    agreeing: NDArray[np.bool_] = (np.abs(means - np.median(means[near], axis=0)) <= apart).all(axis=1)
    return agreeing
