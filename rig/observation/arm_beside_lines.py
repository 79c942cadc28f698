"""The arm's rate without what it has of the lines that were taken out of a sensor's readings.

Over a whole turn 2π/T holds what the encoders see of a vibration: by how much its angle differs between both ends, over
T. So does an even mean of the readings. Where lines are taken out of that, as much is taken out of the rate as the
encoders see of the very same lines; what they do not see was in the readings alone.
"""

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from rig.observation.known_motion import KnownMotion
from rig.observation.lines import fitted, waves
from rig.observation.revolution import Revolution

FINER = 3.0  # than the arm's states follow each other, what its rate is looked at


def turned_beside(motion: KnownMotion, turn: Revolution, lines_hz: Array) -> tuple[float, Array]:
    """A revolution's mean speed, and the unit vector (3,) of its turn in the flange's frame, beside lines (k,).

    2π/T and the turn's own axis, but for what the encoders see of the lines: so the turn's ends are as well known as
    they were. Of an `uneven` turn they see nothing but how single readings scatter; its own lines come whole times a
    turn, and 2π/T holds nothing of them.
    """
    if not len(lines_hz) or turn.uneven:
        return turn.speed_rad_s, turn.axis_flange
    even, beside_them = (turned(motion, turn.start_s, turn.end_s, each, 1)[0] for each in (lines_hz[:0], lines_hz))
    rate = turn.speed_rad_s * turn.axis_flange + beside_them - even
    speed_rad_s = float(np.linalg.norm(rate))
    return speed_rad_s, rate / speed_rad_s


def turned(motion: KnownMotion, start_s: float, end_s: float, lines_hz: Array, parts: int) -> Array:
    """(parts, 3) mean rates of the flange from start to end beside lines of these frequencies (k,).

    All states count, where samples are farther apart than these: what one of them errs by the next takes back.
    """
    count = round(FINER * (end_s - start_s) / float(np.median(np.diff(motion.time_s))))
    share = (np.arange(count) + 0.5) / count
    columns = waves(lines_hz * (end_s - start_s), share)
    part = np.asarray(parts * share, dtype=np.intp)
    return beside(columns, motion.rate(start_s + share * (end_s - start_s)), part, parts)[0]


def beside(columns: Array, values: Array, part: NDArray[np.intp], parts: int) -> tuple[Array, Array]:
    """(parts, 3) means of values (n, 3) beside what `columns` (n, k) explain, and (n, 3) what neither does."""
    means, apart = means_of_parts(values, part, parts), means_of_parts(columns, part, parts)
    within, left = columns - apart[part], values - means[part]
    sizes = fitted(within, left)
    return means - apart @ sizes, left - within @ sizes


def means_of_parts(values: Array, part: NDArray[np.intp], parts: int) -> Array:
    """(parts, k) means of values (n, k) by part; zero where a part has none."""
    counts = np.maximum(np.bincount(part, minlength=parts), 1)
    sums = [np.bincount(part, values[:, column], minlength=parts) for column in range(values.shape[1])]
    means: Array = np.reshape(sums, (values.shape[1], parts)).T / counts[:, None]
    return means
