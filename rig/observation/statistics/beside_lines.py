"""The noise of readings that vibrate: what vibrates is taken out as lines, and what is left tells the sensor's own.

What scatters with a vibration is no noise: the few low frequencies that are free of it tell that badly, too little in
one turn and too much in the next. Beside its lines the noise is white more often than not, and then all readings tell
it; else what they tell of each other does.
"""

from collections.abc import Sequence

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps
from rig.observation.statistics.coloured_noise import MEMORIES, left_of
from rig.observation.statistics.lines import LineSearch, find_lines, fitted, waves
from rig.observation.statistics.mean import Mean, Noise, mean_at_rest, weighted_means, whole
from rig.observation.statistics.tapered_weights import weights
from rig.observation.windows import Window

FEWEST = 120  # readings, of which lines can be told from noise
BRIEF = (1, 2)  # memories that know a colour, and nothing of what may be left of a line


def rest_beside_lines(readings: Array, time_s: Array, window: Window, steps: Steps) -> Mean:
    """The mean at rest as `tapered_mean`, whose weights leave nothing of a vibration, by the noise beside its lines."""
    left = readings - readings.mean(axis=0)
    shaking = _columns(left, LineSearch(beats=0))
    columns = np.column_stack([np.ones(len(left)), shaking])
    smooth = columns @ fitted(columns, left)
    noise = noise_of(left - smooth, columns.shape[1], steps, BRIEF if shaking.size else MEMORIES)
    tapered = weights(time_s, window.start_s, window.end_s)[None]
    (mean,) = weighted_means(readings, whole(readings), tapered, smooth=smooth, noise=noise, steps=steps)
    return mean


def mean_of_standing(readings: Array, time_s: Array, window: Window, steps: Steps) -> tuple[Mean, Window]:
    """Return the mean of readings (n, 3) of an arm that stands, and from when to when it is said to last."""
    found, lasting = mean_at_rest(readings, time_s, window, steps)
    if len(readings) >= FEWEST and lasting != window:
        found = rest_beside_lines(readings, time_s, window, steps)
    return found, lasting


def swinging(residuals: Array) -> Array:
    """(n, 8 k) columns of the k lines in residuals (n, 3) of a sensor that makes a turn."""
    return _columns(residuals, LineSearch())


def colour_left(residuals: Array) -> float:
    """The factor of `noise_left`, of residuals (n,) that may hold what is left of a line."""
    return left_of(residuals, BRIEF).factor


def _columns(residuals: Array, search: LineSearch) -> Array:
    return waves(find_lines(residuals, search), np.arange(len(residuals)) / len(residuals), search.beats)


def noise_of(residuals: Array, taken: int, steps: Steps, memories: Sequence[int]) -> Noise:
    """The noise in residuals (n, 3) of readings in these steps, less so many `taken` columns: see `left_of`."""
    scatter = np.maximum(np.sum(residuals**2, axis=0) / (len(residuals) - taken), steps.variance)
    left = [left_of(each, memories) for each in residuals.T]
    return Noise(
        scatter=scatter,
        in_a_mean=scatter * np.array([each.factor for each in left]),
        freedom=np.array([min(each.freedom, len(residuals) - taken) for each in left]),
    )
