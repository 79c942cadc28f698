"""The rests of a body, from its sensors' readings alone.

A recording is divided into blocks of a quarter of a second. A block is at rest if its readings scatter at most a few
times as much as in the quietest tenth of all blocks, and if a gyroscope reads its bias, that is, the most frequent
reading of quiet blocks. A steady turn is as quiet as a rest, so of several nearly equally frequent readings the
smallest is taken as the bias. Adjacent blocks whose mean readings agree form one rest, which a few missing readings do
not end.

If there is a gyroscope, it alone decides, because it measures every turn, and hardly reacts to a knock against the
table. Other sensors do react to knocks, so the few readings of a knock are left out.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rig.data.installed_kinds import quantities
from rig.data.quantity import RATE, Quantity
from rig.estimation.arrays import Array, equal_runs
from rig.observation.by_hand.knocks import KNOCK_STDS, smallest_steps
from rig.observation.by_hand.steadiness import MAX_NOISE_STDS
from rig.observation.time_stamps.sampling import find_sampling
from rig.observation.windows import Window

BLOCK_S, MIN_BLOCK_SAMPLES = 0.25, 5
ROUNDING_TOLERANCE = 1e-6  # tolerance of a whole number of intervals
# Fraction of the blocks that determine the noise; ratio to that noise up to which a block is at rest.
QUIETEST_FRACTION, QUIET_RATIO = 0.1, 3.0
MIN_SCATTER_FRACTION = 0.2  # of `Quantity.steady`: always allowed, because noise may be below the resolution
TOGGLE_STEPS = 0.5  # scatter of readings that alternate between two values
FIRST_BLOCKS = 4  # blocks in the first second
MIN_GAP_INTERVALS = 2.5  # longer than one missing reading
MIN_BLOCK_RATIO = 0.5  # of a rest's blocks to the most frequent reading's
CANDIDATES = 400  # number of blocks whose mean is tried as the reading at rest


def find_rests(
    time_s: Array, readings: Mapping[Quantity, Array], *, still_at_first: bool = False, lying: Sequence[Window] = ()
) -> tuple[Window, ...]:
    """Return the rests of a body, from readings (n, 3) of one or several quantities at rising times (n,).

    A rest lasts at least two blocks. A block lasts `BLOCK_S`, or longer if it would contain too few readings.
    `still_at_first`: whether the first second scatters like a rest. `lying`: windows in which the body lies still for
    at least a part of the time, as the file of the motion states.
    """
    quantity = next(quantity for quantity in quantities().values() if quantity in readings)
    if len(time_s) < 2 * MIN_BLOCK_SAMPLES:
        return ()
    interval_s = find_sampling(time_s).interval_s
    width = max(MIN_BLOCK_SAMPLES, int(np.ceil(BLOCK_S / interval_s - ROUNDING_TOLERANCE)))
    count = len(time_s) // width
    if count < 2:
        return ()
    times = time_s[: count * width].reshape(count, width)
    blocks = readings[quantity][: count * width].reshape(count, width, -1)
    means, scatter = blocks.mean(axis=1), blocks.std(axis=1)
    least = np.maximum(MIN_SCATTER_FRACTION * quantity.steady, TOGGLE_STEPS * smallest_steps(readings[quantity]))
    noise = np.maximum(np.quantile(scatter, QUIETEST_FRACTION, axis=0), least)
    if still_at_first:
        noise = np.maximum(noise, np.median(scatter[:FIRST_BLOCKS], axis=0))
    if quantity != RATE:
        means, scatter = _average_unknocked(blocks, noise)
    tolerance = quantity.steady + MAX_NOISE_STDS * noise * np.sqrt(2 / width)
    gap_s = max(MIN_GAP_INTERVALS * interval_s, BLOCK_S)  # a body is not moved away and back within a shorter gap
    still = (scatter <= QUIET_RATIO * noise).all(axis=1) & (np.diff(times, axis=1).max(axis=1) <= gap_s)
    follows = (times[1:, 0] - times[:-1, -1] <= gap_s) & (np.abs(np.diff(means, axis=0)) <= tolerance).all(axis=1)
    pairs = still[:-1] & still[1:] & follows
    if quantity == RATE and still.any():
        still &= _find_unturned(means, _find_steady_blocks(still, pairs), tolerance, _mask_blocks(times, lying))
        pairs &= still[:-1] & still[1:]
    runs = equal_runs(pairs)
    return tuple(
        Window(float(times[first, 0]), float(times[last, -1])) for first, last in runs[pairs[runs[:, 0]]].tolist()
    )


def _average_unknocked(blocks: Array, noise: Array) -> tuple[Array, Array]:
    """Return means and scatter (count, 3) of blocks (count, width, 3), each without the few readings of a knock.

    A knock is a disturbance with equal readings before and after. The function must not be used for a gyroscope's
    readings, because a knock may turn the body.
    """
    before, after = np.concatenate([blocks[:1, 0], blocks[:-1, -1]]), np.concatenate([blocks[1:, 0], blocks[-1:, -1]])
    extended = np.concatenate([before[:, None], blocks, after[:, None]], axis=1)
    deviations = np.abs(extended - np.median(blocks, axis=1, keepdims=True))
    knocked: NDArray[np.bool_] = np.any(deviations > KNOCK_STDS * noise, axis=2)
    few = (knocked.sum(axis=1) <= blocks.shape[1] // 4) & ~knocked[:, 0] & ~knocked[:, -1]
    masked = np.where((knocked[:, 1:-1] & few[:, None])[..., None], np.nan, blocks)
    return np.nanmean(masked, axis=1), np.nanstd(masked, axis=1)


def _find_steady_blocks(still: NDArray[np.bool_], pairs: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask (count,) of the still blocks that agree with a neighbour; all still blocks if no two agree.

    `still` (count,) marks the still blocks. `pairs` (count - 1,) says of each block whether it agrees with the next
    one.
    """
    steady = np.append(pairs, False) | np.append(False, pairs)
    return steady if steady.any() else still


def _mask_blocks(times: Array, windows: Sequence[Window]) -> NDArray[np.bool_]:
    """Return a mask (count,) of blocks inside any window; `times` (count, width) are the times of all readings."""
    mask = np.zeros(len(times), dtype=np.bool_)
    for window in windows:
        first, last = np.searchsorted(times[:, 0], window.start_s), np.searchsorted(times[:, -1], window.end_s, "right")
        mask[first:last] = True
    return mask


def _find_unturned(
    means: Array, steady: NDArray[np.bool_], tolerance: Array, lying: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return a mask (count,) of the blocks whose `means` (count, 3) agree with the gyroscope's bias.

    The bias is the most frequent mean among the `steady` blocks (count,), within `tolerance` (3,). A steady turn may
    last nearly as long as the rests, so of nearly equally frequent means the smallest is taken. `lying` (count,) marks
    the blocks in declared rests, in which the body mostly lies still. If any of these are steady, only they are
    searched, and the most frequent mean is taken, however large it is.
    """
    declared = steady & lying
    searched = means[declared if declared.any() else steady]
    candidates = searched[:: -(-len(searched) // CANDIDATES)]  # evenly chosen, because all pairs would take long
    agreeing_counts = np.array(
        [np.count_nonzero((np.abs(searched - candidate) <= tolerance).all(axis=1)) for candidate in candidates]
    )
    most = agreeing_counts.max()
    is_frequent = agreeing_counts == most if declared.any() else agreeing_counts >= MIN_BLOCK_RATIO * most
    frequent = candidates[is_frequent]
    rough_bias = frequent[np.argmin(np.linalg.norm(frequent, axis=1))]
    bias = np.median(searched[(np.abs(searched - rough_bias) <= tolerance).all(axis=1)], axis=0)
    reads_bias: NDArray[np.bool_] = (np.abs(means - bias) <= tolerance).all(axis=1)
    return reads_bias
