"""Means of readings that vibrate: what vibrates is taken out as lines, and what is left tells the sensor's own noise.

A mean over a whole turn keeps of a vibration by how much its phase differs between both ends: 3 mrad/s at 8.5 Hz leave
20 µrad/s in six seconds, more than the noise of a good gyroscope does. And what scatters with it is no noise: the few
low frequencies that are free of it tell that badly, too little in one turn and too much in the next. Beside its lines
the noise is white more often than not, and then all readings tell it; else what they tell of each other does.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.observation.coloured_noise import MEMORIES, left_of
from rig.observation.lines import BEATS, fitted, lines, waves
from rig.observation.mean import Mean, rounding_left
from rig.observation.tapered_weights import weights
from rig.observation.windows import Window

FEWEST = 120  # readings, of which lines can be told from noise
STANDS_OUT = 16.0  # over the median power: one line in seventy that is none costs nothing
BRIEF = (1, 2)  # memories that know a colour, and nothing of what may be left of a line


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise of readings beside lines: the `scatter` (3,) variance of one, what of it counts `in_a_mean` (3,)
    over long, and with how many degrees of `freedom` (3,) that is known."""

    scatter: Array
    in_a_mean: Array
    freedom: Array


def mean_beside_lines(
    readings: Array, count: float | Array, turning: Array, rate: Array, *, closed: bool = True, beats: int = BEATS
) -> Mean:
    """The mean of readings (n, 3) in steps of `count`, evenly spaced, over whole turns (`closed`) or an arc.

    `turning` (n, k) comes and goes in a turn, each line with its `beats`: see `rig.observation.lines.waves`. `rate`
    (n,) is the arm's less its mean, as the encoders have it: they see not all that vibrates, and some that does not, so
    it counts only for what no line explains. What it has of the lines themselves is missing from the mean: see
    `rig.observation.arm_beside_lines`. Where a turn is not closed a ripple of it does not end where it began. So beside
    its lines the rate has a mean of its own, which is left out of the fit: it would be told from the readings' mean
    badly.
    """
    steady = np.column_stack([np.ones(len(readings)), turning])
    cycles = lines(readings - steady @ fitted(steady, readings), STANDS_OUT, beats=beats)
    shaking = _columns(cycles, len(readings), beats)
    if shaking.size and not closed:
        others = np.column_stack([steady, shaking])
        rate = rate - others @ fitted(others, rate[:, None])[:, 0]
    columns = np.column_stack([steady, shaking, rate])
    coefficients, _, rank, _ = np.linalg.lstsq(columns, readings, rcond=None)
    noise = noise_of(readings - columns @ coefficients, int(rank), count, BRIEF if shaking.size else MEMORIES)
    of_the_mean = np.linalg.pinv(columns.T @ columns, hermitian=True)[0, 0]
    return Mean(
        mean=coefficients[0],
        variance=noise.in_a_mean * of_the_mean + rounding_left(noise.scatter, count),
        noise=np.sqrt(noise.scatter),
        samples=len(readings),
        freedom=noise.freedom,
        cycles=cycles,
    )


def rest_beside_lines(readings: Array, time_s: Array, window: Window, count: float | Array) -> Mean:
    """The mean at rest as `tapered_mean`, whose weights leave nothing of a vibration, by the noise beside its lines."""
    left = readings - readings.mean(axis=0)
    shaking = swinging(left)
    columns = np.column_stack([np.ones(len(left)), shaking])
    noise = noise_of(
        left - columns @ fitted(columns, left), columns.shape[1], count, BRIEF if shaking.size else MEMORIES
    )
    shares = weights(time_s, window.start_s, window.end_s)
    return Mean(
        mean=shares @ readings,
        variance=noise.in_a_mean * float(shares @ shares) + rounding_left(noise.scatter, count),
        noise=np.sqrt(noise.scatter),
        samples=len(readings),
        freedom=noise.freedom,
    )


def swinging(residuals: Array) -> Array:
    """(n, 8 k) columns of the k lines in residuals (n, 3)."""
    return _columns(lines(residuals, STANDS_OUT), len(residuals))


def colour_left(residuals: Array) -> float:
    """The factor of `noise_left`, of residuals (n,) that may hold what is left of a line."""
    return left_of(residuals, BRIEF).factor


def _columns(cycles: Array, count: int, beats: int = BEATS) -> Array:
    """(n, w k) columns of k lines in n readings."""
    return waves(cycles, np.arange(count) / count, beats)


def noise_of(residuals: Array, taken: int, count: float | Array, memories: Sequence[int]) -> Noise:
    """The noise in residuals (n, 3) of readings in steps of `count`, less so many `taken` columns: see `left_of`."""
    scatter = np.maximum(np.sum(residuals**2, axis=0) / (len(residuals) - taken), count**2 / 12)
    left = [left_of(each, memories) for each in residuals.T]
    return Noise(
        scatter=scatter,
        in_a_mean=scatter * np.array([each.factor for each in left]),
        freedom=np.array([min(each.freedom, len(residuals) - taken) for each in left]),
    )
