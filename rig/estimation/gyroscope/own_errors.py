"""What a gyroscope may do beside the vector model, of which only the likely size is known: its data sheet says it.

It is not quite linear, and it feels how warm it is. Each is an error that many readings have in common
(`rig.estimation.gyroscope.common_errors`): what sweeps and rests tell of it is taken out of the result, what they do
not tell is a line of the budget.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.nonlinearity import CUBE_MISSED, SQUARE_MISSED, bending

NONLINEARITY = "nonlinearity"
BIAS_OVER_TEMPERATURE, SCALE_OVER_TEMPERATURE = "bias over temperature", "scale over temperature"
OF_THE_PART = "what is known of the part"
ROUNDING = "rounding of the readings"
NOTHING_BESIDE = 1e-3  # of a mean's variance, that what means have in common by their rounding may be


@dataclass(frozen=True, slots=True)
class KnownSensor:
    """Half-widths as its data sheet states them, and how warm it was in each of N averages.

    `nonlinearity` is how far a reading may be off the best straight line, as a share of `full_scale_rad_s`: by its odd
    part, and by its even part. `bias_rad_s_per_k` and `scale_per_k` are changes with temperature, `temperature_c` (N,)
    is recorded in steps of `temperature_step_k`, NaN if nothing tells it; `temperature_words` say how it is known, if
    no thermometer tells it. `instability_rad_s` is the least Allan deviation of its bias.
    """

    nonlinearity: float
    full_scale_rad_s: float
    bias_rad_s_per_k: float
    scale_per_k: float
    instability_rad_s: float
    temperature_c: Array
    temperature_step_k: float
    temperature_words: str = ""


@dataclass(frozen=True, slots=True)
class OwnError:
    """A line of the budget: `patterns` (P, N, 3) rad/s in the readings for the `half_width`, which is in `unit`.

    `source` says how that is known.
    """

    name: str
    half_width: float
    unit: str
    patterns: Array
    source: str = OF_THE_PART


def own_errors(
    known: KnownSensor, matrix: Array, turns_rad_s: Array, windows_s: Array, speeds_rad_s: tuple[float, ...]
) -> Iterator[OwnError]:
    """Errors of a sensor of F (3, 3) on a flange turning at `turns_rad_s` (N, 3), zero at rest, in `windows_s` (N, 2).

    Swept at one speed, scale is what it is at that speed along an axis: one that turned obliquely was slower, and so
    its scale may differ. Several speeds tell the nonlinearity, whatever is known of it.
    """
    if len(speeds_rad_s) == 1:
        bent = bending(matrix, turns_rad_s, known.full_scale_rad_s, speeds_rad_s[0])
        sizes = known.nonlinearity / np.repeat([CUBE_MISSED, SQUARE_MISSED], 3)[:, None, None]
        yield OwnError(NONLINEARITY, 100 * known.nonlinearity, "% of full scale", sizes * bent)
    lasting = np.diff(windows_s)[:, 0]
    source = "; ".join(filter(None, (OF_THE_PART, known.temperature_words)))
    warmer_k = _warmer_k(known, windows_s, lasting)
    patterns = known.bias_rad_s_per_k * np.einsum("kn,ij->kinj", warmer_k, np.eye(3))
    by_k = float(np.degrees(known.bias_rad_s_per_k))
    yield OwnError(BIAS_OVER_TEMPERATURE, by_k, "°/s/K", patterns.reshape(6, -1, 3), source)
    warmer_k = _warmer_k(known, windows_s, lasting * turns_rad_s.any(axis=1))
    patterns = known.scale_per_k * np.einsum("kn,ni,ij->kinj", warmer_k, turns_rad_s @ matrix.T, np.eye(3))
    yield OwnError(SCALE_OVER_TEMPERATURE, 1e6 * known.scale_per_k, "ppm/K", patterns.reshape(6, -1, 3), source)


def rounding_errors(means_rad_s: Array, roundings_rad_s: Array | float, variances_rad2_s2: Array) -> Iterator[OwnError]:
    """What rounding to steps does to means (N, 3) alike, by the standard uncertainty (N, 3) that it leaves in each.

    Means that are nearer to each other than the steps hide err together, such as those of all rests: no number of them
    makes their rounding less. So an axis has an error for each group of such means, beside what each has for itself,
    which is part of its variance (N, 3). What is nothing beside that is left out.
    """
    roundings = np.broadcast_to(roundings_rad_s, means_rad_s.shape)
    patterns = []
    for axis in range(3):
        half_widths = np.sqrt(3) * roundings[:, axis]
        order = np.argsort(means_rad_s[:, axis])
        apart = np.diff(means_rad_s[order, axis]) > half_widths[order][1:] + half_widths[order][:-1]
        for group in np.split(order, np.flatnonzero(apart) + 1):
            size = np.zeros(means_rad_s.shape)
            size[group, axis] = roundings[group, axis]
            if np.any(size[group, axis] ** 2 > NOTHING_BESIDE * variances_rad2_s2[group, axis]):
                patterns.append(np.sqrt(3) * size)
    if patterns:
        largest = float(np.degrees(np.max(patterns)))
        yield OwnError(ROUNDING, largest, "°/s", np.array(patterns), "the steps in which the readings come")


def _warmer_k(known: KnownSensor, windows_s: Array, weights: Array) -> Array:
    """(2, N) K above the mean by these weights: as recorded, and what the steps of that may hide."""
    recorded = from_their_mean(known.temperature_c, weights)
    return np.array([recorded, unseen_k(known.temperature_step_k, windows_s, weights)])


def unseen_k(step_k: float, windows_s: Array, weights: Array) -> Array:
    """(N,) K by which temperature may have changed evenly in the course of the run while its recorded steps did not.

    By half a step either way, from the mean over the windows (N, 2) by their weights (N,).
    """
    middle = windows_s.mean(axis=1)
    return np.asarray(step_k * from_their_mean(middle, weights) / np.ptp(middle), dtype=np.float64)


def from_their_mean(values: Array, weights: Array) -> Array:
    """(N,) values less their mean by these weights; zero where they are not known, which is NaN."""
    away: Array = np.nan_to_num(values - np.average(values, weights=weights))
    return away
