"""When a body lay still, as a reference's attitudes tell: long rows, and rows that follow each other without a turn."""

import numpy as np

from rig.estimation.arrays import Array, rotation_vectors
from rig.observation.windows import Window

DWELL_S = 0.5  # a row that is as long says that the body lay still in it
APART_S = 0.5  # between two rows that show whether it did
STILL_RAD_S = 0.02  # between them; a camera's errors look like half of it


def still_windows(windows_s: Array, attitudes: Array) -> list[Window]:
    """Return the times in which rows with windows (N, 2), in any order, say that the body lay still.

    `attitudes` (N, 3, 3) take body to table coordinates.
    """
    long = windows_s[:, 1] - windows_s[:, 0] >= DWELL_S
    found = [Window(start_s, end_s) for start_s, end_s in windows_s[long].tolist()]
    short = np.flatnonzero(~long)
    short = short[np.argsort(windows_s[short, 0])]
    middles_s = windows_s[short].mean(axis=1)
    later = np.searchsorted(middles_s, middles_s + APART_S)
    first = np.flatnonzero(later < len(short))
    last = later[first]
    lasts_s = middles_s[last] - middles_s[first]
    near = lasts_s <= 2 * APART_S  # else nobody looked in between
    first, last, lasts_s = first[near], last[near], lasts_s[near]
    if not len(first):
        return found
    turned = rotation_vectors(np.swapaxes(attitudes[short[first]], -1, -2) @ attitudes[short[last]])
    still = np.linalg.norm(turned, axis=1) <= STILL_RAD_S * lasts_s
    # Pairs of rows that overlap are one time.
    for begin, end in zip(middles_s[first[still]].tolist(), middles_s[last[still]].tolist(), strict=True):
        if found and found[-1].start_s <= begin <= found[-1].end_s:
            found[-1] = Window(found[-1].start_s, max(found[-1].end_s, end))
        else:
            found.append(Window(begin, end))
    return found
