"""When a body lay still, as its sensors' readings alone tell.

A recording is cut into blocks of a quarter of a second. A block is at rest where the readings scatter no more than a
few times as much as in the quietest tenth of all blocks, and where a gyroscope reads what it reads at rest. This is the
reading that most of the quiet blocks have in common, whatever the bias; a steady turn is as quiet as a rest, so of
readings that are nearly as frequent the smallest counts. Blocks that follow each other and read the same are one rest.
A few missing readings do not end it.

A gyroscope alone decides where there is one: it feels every turn, and no knock against the table. Where there is none,
a few readings that a knock has made do not count.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rig.data.installed_kinds import quantities
from rig.data.quantity import RATE, Quantity
from rig.estimation.arrays import Array
from rig.observation.by_hand.knocks import KNOCK, smallest_steps
from rig.observation.by_hand.steadiness import BEYOND
from rig.observation.sampling import find_sampling
from rig.observation.windows import Window

BLOCK_S, FEWEST = 0.25, 5  # samples of a block
ROUNDING = 1e-6  # of a number of intervals that may be whole but for the arithmetic
QUIETEST, AS_QUIET = 0.1, 3.0  # share of the blocks that tell the noise; times as much is at rest as well
COUNTS = 0.2  # of what is steady: so much may always scatter, where the noise is below the resolution
TOGGLES = 0.5  # of a step of the readings: so much they scatter between two values
FIRST = 4  # blocks of the first second
GAP = 2.5  # intervals: no reading is missing, or one
NEARLY = 0.5  # of the blocks of the most frequent reading
CANDIDATES = 400  # blocks whose readings may be that at rest


def find_rests(
    time_s: Array,
    readings: Mapping[Quantity, Array],
    *,
    still_at_first: bool = False,
    lying: Sequence[Window] = (),
) -> tuple[Window, ...]:
    """Return the rests of two blocks and longer, by readings (n, 3) of one quantity or several at rising times (n,).

    `still_at_first`: the body was as still in the first second as it ever is meant to be. `lying`: windows in which it
    is said to lie still at least part of the time, if anything is said of it.
    """
    quantity = next(each for each in quantities().values() if each in readings)
    if len(time_s) < 2 * FEWEST:
        return ()
    interval_s = find_sampling(time_s).interval_s
    width = max(FEWEST, int(np.ceil(BLOCK_S / interval_s - ROUNDING)))
    count = len(time_s) // width
    if count < 2:
        return ()
    times = time_s[: count * width].reshape(count, width)
    blocks = readings[quantity][: count * width].reshape(count, width, -1)
    means, scatter = blocks.mean(axis=1), blocks.std(axis=1)
    least = np.maximum(COUNTS * quantity.steady, TOGGLES * smallest_steps(readings[quantity]))
    noise = np.maximum(np.quantile(scatter, QUIETEST, axis=0), least)
    if still_at_first:
        noise = np.maximum(noise, np.median(scatter[:FIRST], axis=0))
    if quantity != RATE:
        means, scatter = _unknocked(blocks, noise)
    apart = quantity.steady + BEYOND * noise * np.sqrt(2 / width)
    gap_s = max(GAP * interval_s, BLOCK_S)  # a body is not moved away and back in a shorter one
    still = (scatter <= AS_QUIET * noise).all(axis=1) & (np.diff(times, axis=1).max(axis=1) <= gap_s)
    follows = (times[1:, 0] - times[:-1, -1] <= gap_s) & (np.abs(np.diff(means, axis=0)) <= apart).all(axis=1)
    pairs = still[:-1] & still[1:] & follows
    if quantity == RATE and still.any():
        still &= _unturned(means, _steady(still, pairs), apart, _within(times, lying))
        pairs &= still[:-1] & still[1:]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], pairs, [False]]).astype(np.int8))).reshape(-1, 2)
    return tuple(Window(float(times[first, 0]), float(times[last, -1])) for first, last in edges.tolist())


def _unknocked(blocks: Array, noise: Array) -> tuple[Array, Array]:
    """Means and scatter (count, 3) of blocks (count, width, 3) without a few readings that a knock made.

    Before and after these it reads the same. Not of a gyroscope, for a knock may have turned the body.
    """
    before, after = np.concatenate([blocks[:1, 0], blocks[:-1, -1]]), np.concatenate([blocks[1:, 0], blocks[-1:, -1]])
    widened = np.concatenate([before[:, None], blocks, after[:, None]], axis=1)
    off = np.abs(widened - np.median(blocks, axis=1, keepdims=True))
    knocked: NDArray[np.bool_] = np.any(off > KNOCK * noise, axis=2)
    few = (knocked.sum(axis=1) <= blocks.shape[1] // 4) & ~knocked[:, 0] & ~knocked[:, -1]
    left = np.where((knocked[:, 1:-1] & few[:, None])[..., None], np.nan, blocks)
    return np.nanmean(left, axis=1), np.nanstd(left, axis=1)


def _steady(still: NDArray[np.bool_], pairs: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(count,) the blocks that read what a neighbour reads, if any does: one that turns ever faster does not."""
    steady = np.append(pairs, False) | np.append(False, pairs)
    return steady if steady.any() else still


def _within(times: Array, windows: Sequence[Window]) -> NDArray[np.bool_]:
    """(count,) the blocks, of times (count, width), that lie in one of the windows."""
    found = np.zeros(len(times), dtype=np.bool_)
    for window in windows:
        first, last = np.searchsorted(times[:, 0], window.start_s), np.searchsorted(times[:, -1], window.end_s, "right")
        found[first:last] = True
    return found


def _unturned(means: Array, steady: NDArray[np.bool_], apart: Array, lying: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(count,) blocks that read what a gyroscope reads at rest: the most frequent reading of those where it lies."""
    told = steady & lying
    pool = means[told if told.any() else steady]
    candidates = pool[:: -(-len(pool) // CANDIDATES)]
    often = np.array([np.count_nonzero((np.abs(pool - each) <= apart).all(axis=1)) for each in candidates])
    frequent = candidates[often == often.max() if told.any() else often >= NEARLY * often.max()]
    middle = frequent[np.argmin(np.linalg.norm(frequent, axis=1))]
    at_rest = np.median(pool[(np.abs(pool - middle) <= apart).all(axis=1)], axis=0)
    agreeing: NDArray[np.bool_] = (np.abs(means - at_rest) <= apart).all(axis=1)
    return agreeing
