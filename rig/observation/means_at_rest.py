"""What a gyroscope reads while readings and a reference's attitudes both say that the body lies still."""

import numpy as np

from rig.data.quantity import RATE
from rig.estimation.arrays import Array, rotation_vectors
from rig.observation.fixes import Turning
from rig.observation.rests import find_rests
from rig.observation.still_attitudes import still_windows
from rig.observation.windows import inside

FEWEST_S = 1.0  # of rests in all
STILL_RAD_S = 5e-3  # a body that turns no faster between the first and the last attitude of a rest may lie still


def means_at_rest(turning: Turning, clock_s: float, fix_std_rad: float) -> tuple[Array, float]:
    """Return the mean readings (k, 3) of the rests, and how fast the body may turn in them unseen, rad/s.

    None if the rests are too short in all. `clock_s` takes the times of the rows to the clock of the readings;
    `fix_std_rad` is the standard deviation of one attitude.
    """
    rows_s = turning.rows_s.mean(axis=1) + clock_s
    lying = still_windows(turning.rows_s + clock_s, turning.attitudes)
    means, lengths_s = [], []
    for rest in find_rests(turning.time_s, {RATE: turning.readings_rad_s}, lying=lying):
        rows = np.flatnonzero((rows_s >= rest.start_s) & (rows_s <= rest.end_s))
        if not len(rows):
            continue
        first, last = turning.attitudes[rows[np.argsort(rows_s[rows])[[0, -1]]]]
        turned = float(np.linalg.norm(rotation_vectors((first.T @ last)[None])))
        length_s = rest.end_s - rest.start_s
        if turned <= STILL_RAD_S * length_s + 3 * np.sqrt(2) * fix_std_rad:
            means.append(turning.readings_rad_s[inside(turning.time_s, rest)].mean(axis=0))
            lengths_s.append(length_s)
    if sum(lengths_s) < FEWEST_S:
        return np.zeros((0, 3)), 0.0
    return np.array(means), float(np.sqrt(2) * fix_std_rad / np.median(lengths_s))
