"""The rests of a body as a reference's attitudes show them: a long row, or successive short rows of equal attitude.

A reference that stops for some time repeats its last attitude, which looks like a rest; the gyroscope shows that the
body turned.
"""

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array, rotation_vectors, runs_between
from rig.observation.false_readings import MIN_OTHER_CHANGE_RAD_S, MOTION_QUANTILES
from rig.observation.windows import Window, inside

MIN_DWELL_S = 0.5  # shortest row that declares that the body lay still
MIN_APART_S = 0.5  # between two short rows that show whether it did
MAX_TIME_ERROR_S = 0.2  # of a row's attitude
MAX_CLOCK_S = 0.3  # difference of two clocks: readings nearer to the ends of equal attitudes show no motion in them
MAX_STILL_RATE_RAD_S = 0.02  # between them; a camera's errors amount to half of it


def still_windows(windows_s: Array, attitudes: Array) -> list[Window]:
    """Return the windows in which a reference's rows show the body at rest.

    Rows have windows (N, 2), in any order, and `attitudes` (N, 3, 3), body to table coordinates.
    """
    long = windows_s[:, 1] - windows_s[:, 0] >= MIN_DWELL_S
    windows = [Window(start_s, end_s) for start_s, end_s in windows_s[long].tolist()]
    short = np.flatnonzero(~long)
    short = short[np.argsort(windows_s[short, 0])]
    middles_s = windows_s[short].mean(axis=1)
    later = np.searchsorted(middles_s, middles_s + MIN_APART_S)
    first = np.flatnonzero(later < len(short))
    last = later[first]
    lasts_s = middles_s[last] - middles_s[first]
    near = lasts_s <= 2 * MIN_APART_S  # else rows are missing in between
    first, last, lasts_s = first[near], last[near], lasts_s[near]
    if not len(first):
        return windows
    turned = rotation_vectors(np.swapaxes(attitudes[short[first]], -1, -2) @ attitudes[short[last]])
    still = np.linalg.norm(turned, axis=1) <= MAX_STILL_RATE_RAD_S * lasts_s
    # Pairs of rows that overlap are one time.
    for begin, end in zip(middles_s[first[still]].tolist(), middles_s[last[still]].tolist(), strict=True):
        if windows and windows[-1].start_s <= begin <= windows[-1].end_s:
            windows[-1] = Window(windows[-1].start_s, max(windows[-1].end_s, end))
        else:
            windows.append(Window(begin, end))
    return windows


def find_frozen(windows_s: Array, attitudes: Array, time_s: Array, rates: Array) -> NDArray[np.bool_]:
    """Return a mask (N,) of short, dense rows that repeat the attitude of an earlier row while the gyroscope turns.

    Rows have windows (N, 2), in any order, and `attitudes` (N, 3, 3). They are on the clock of the readings: rates
    (n, 3) at times (n,).
    """
    frozen = np.zeros(len(windows_s), dtype=np.bool_)
    short = np.flatnonzero(windows_s[:, 1] - windows_s[:, 0] < MIN_DWELL_S)
    order = short[np.argsort(windows_s[short, 0], kind="stable")]
    middles_s = windows_s[order].mean(axis=1)
    new = (np.diff(attitudes[order], axis=0) != 0).any(axis=(1, 2)) | (np.diff(middles_s) > MIN_APART_S)
    for first, end in runs_between(new, len(order)).tolist():
        window = Window(middles_s[first] + MAX_CLOCK_S, middles_s[end - 1] - MAX_CLOCK_S)
        within = rates[inside(time_s, window)]
        if len(within) and np.ptp(np.quantile(within, MOTION_QUANTILES, axis=0), axis=0).max() > MIN_OTHER_CHANGE_RAD_S:
            frozen[order[first + 1 : end]] = True
    return frozen
