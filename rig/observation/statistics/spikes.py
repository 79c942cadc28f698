"""Single readings of a gyroscope far from those before and after: bit errors, dropped digits, markers of a logger.

A body needs several readings to turn there and back, so a single deviating reading is not a motion, however large it
is. A vibration, or a knock that rings, also moves the neighbouring readings, and is kept.

A reading is compared with the cubic through two readings on either side. A spike of size 1 leaves deviations of 1/6,
−2/3, 1, −2/3, 1/6, while a step leaves −1/6, 1/2, −1/2, 1/6. A motion or a vibration, unlike a spike, also leaves
deviations at readings farther away.
"""

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array, median_step

MAX_STEP_S = 0.02  # between readings: in a longer one a hand starts and stops
MIN_SPIKE_RAD_S = 0.1  # over one such step a smaller one turns by less than a body may move at rest
MIN_DEVIATION_RATIO = 16.0  # to the largest deviation of the readings around, one other spike left out
MIN_CHANGE_RATIO = 3.0  # to any axis' change between the next readings: a body that is stopped moves about all axes
# readings on either side whose deviations are the usual ones; the most of them that one other spike affects
SIDE_READINGS, SPIKE_READINGS = 10, 5
# deviation of a spike's neighbours from their cubics, relative to the spike's own; its tolerance
NEIGHBOUR_RATIO, NEIGHBOUR_TOLERANCE = -2 / 3, 0.2
PASSES = 3  # spikes that are close together hide each other
MIN_MARKERS = 5  # readings of one value
MIN_MARKER_RATIO = 5.0  # of their number to that of each of the nearest values, and of the usual one
NEAREST, USUAL_QUANTILE = 2, 0.9  # values on either side; of the numbers of readings of all values
MIN_ALONE = 0.5  # fraction of them that the reading before differs from
SAME_SPAN_FRACTION = 1e-9  # of an axis' span: values that are closer are equal but for rounding
SHIFTS = [shift for shift in range(2 * NEAREST + 1) if shift != NEAREST]


def find_spikes(time_s: Array, rates: Array) -> NDArray[np.intp]:
    """Return the indices (k,) of the spikes in rates (n, 3), rad/s, at rising times (n,)."""
    none = np.zeros(0, dtype=np.intp)
    if len(rates) < 2 * SIDE_READINGS + 1 or median_step(time_s) > MAX_STEP_S:
        return none
    spikes, bridged = none, rates
    for _ in range(PASSES):
        changes = _changes_around(bridged)
        more = np.concatenate([_find_lone(axis, changes) for axis in bridged.T])
        if not len(more):
            break
        spikes = np.union1d(spikes, more)
        bridged = bridge_spikes(time_s, rates, spikes)
    return spikes


def find_markers(rates: Array) -> NDArray[np.intp]:
    """Return the indices (k,) of rates (n, 3) that repeat one value of an axis far more often than those near it.

    Such rates come from a logger that writes 0, for example, for a missing value. Other causes are excluded: a sensor
    with coarse steps repeats its values evenly, and a sensor that is stuck, or at the end of its range, repeats them
    one after the other.
    """
    marked = np.zeros(len(rates), dtype=np.bool_)
    for axis in rates.T if len(rates) else ():
        merged = np.rint(axis / max(SAME_SPAN_FRACTION * float(np.ptp(axis)), np.finfo(np.float64).tiny))
        values, index, counts = np.unique(merged, return_inverse=True, return_counts=True)
        starts = np.append(True, merged[1:] != merged[:-1])[: len(axis)]  # of runs of equal readings
        alone = np.bincount(index[starts], minlength=len(values))
        padded = np.pad(counts, NEAREST)
        usual = float(np.quantile(counts, USUAL_QUANTILE))
        near = np.max([padded[shift : shift + len(values)] for shift in SHIFTS], axis=0, initial=usual)
        is_marker = (counts >= np.maximum(MIN_MARKERS, MIN_MARKER_RATIO * near)) & (alone >= MIN_ALONE * counts)
        marked |= is_marker[index]
    return np.flatnonzero(marked)


def bridge_spikes(time_s: Array, rates: Array, spikes: NDArray[np.intp]) -> Array:
    """Return the rates (n, 3) with those at the indices `spikes` (k,) interpolated from their neighbours."""
    others = np.setdiff1d(np.arange(len(rates)), spikes)
    bridged = rates.copy()
    bridged[spikes] = np.column_stack([np.interp(time_s[spikes], time_s[others], axis[others]) for axis in rates.T])
    return bridged


def _changes_around(rates: Array) -> Array:
    """Return how much the rates around each of the rates (n, 3) change, as an array (n,).

    It is the largest difference, on any axis, from one to the next of the two rates before and the two rates after. The
    result is 0 for the first two and the last two rates.
    """
    steps, across = np.abs(np.diff(rates, axis=0)).max(axis=1), np.abs(rates[2:] - rates[:-2]).max(axis=1)
    changes = np.zeros(len(rates))
    changes[2:-2] = np.maximum(np.maximum(steps[:-3], steps[3:]), across[1:-1])
    return changes


def _find_lone(axis: Array, changes: Array) -> NDArray[np.intp]:
    """Return the indices of the readings (n,) that deviate from their neighbours as a spike does.

    `changes` (n,): how much the readings before and after each one differ, the largest of all axes.
    """
    deviation = np.zeros(len(axis))
    # The deviation from the cubic through the two readings before and the two after.
    before, after = axis[:-4] + axis[4:], axis[1:-3] + axis[3:-1]
    deviation[2:-2] = axis[2:-2] - (4 * after - before) / 6
    candidates = np.flatnonzero(np.abs(deviation) > np.maximum(MIN_SPIKE_RAD_S, MIN_CHANGE_RATIO * changes))
    size = deviation[candidates]
    alone = np.ones(len(candidates), dtype=np.bool_)
    # A lone spike deflects the cubics of its neighbours by a known fraction; a motion does not.
    for side in (-1, 1):
        of_next = deviation[np.clip(candidates + side, 0, len(axis) - 1)]
        alone &= np.abs(of_next - NEIGHBOUR_RATIO * size) < NEIGHBOUR_TOLERANCE * np.abs(size)
    candidates, size = candidates[alone], size[alone]
    farther = np.r_[-SIDE_READINGS:-2, 3 : SIDE_READINGS + 1]
    around = np.abs(deviation[np.clip(candidates[:, None] + farther, 0, len(axis) - 1)])
    usual = np.sort(around, axis=1)[:, -1 - SPIKE_READINGS]
    return candidates[np.abs(size) > MIN_DEVIATION_RATIO * usual]
