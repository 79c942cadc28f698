"""The ways in which readings have been averaged: a recording keeps that of its time, so that its numbers stay.

They differ in how a mean allows for readings that are not independent: by their correlations, by an autoregression, or
beside what vibrates, which is taken out as lines.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.data.settings import RunSettings
from rig.estimation.arrays import Array
from rig.observation.beside_lines import FEWEST, colour_left, mean_beside_lines, rest_beside_lines, swinging
from rig.observation.coloured_noise import left_by_correlations, noise_left
from rig.observation.lines import BEATS
from rig.observation.mean import Mean, even_mean, mean_at_rest, mean_of
from rig.observation.windows import Window


@dataclass(frozen=True, slots=True)
class Passing:
    """What comes and goes in a turn of n readings.

    The arm's rate less its mean (n,), as the encoders have it where that is `covered` (n,); columns `turning` (n, k) of
    once and twice a turn and so on, of an arc less their means. Whole turns are `closed`. `beats` are a revolution's.
    """

    rate_rad_s: Array
    covered: NDArray[np.bool_]
    turning: Array
    closed: bool = True
    beats: int = BEATS


@dataclass(frozen=True, slots=True)
class Averaging:
    """One way of averaging readings (n, 3) in steps of a count.

    `turned(readings, count, passing)` is the mean over whole turns or an arc; `rested(readings, time_s, window, count)`
    that of an arm which stands, and from when to when it is said to last. Beside a harmonic `colour(residuals)` is the
    factor on the variance by residuals (n,) that are not white, `swings(residuals)` are the columns of what swings in
    residuals (n, 3), None where one line alone is looked for.
    """

    turned: Callable[[Array, float | Array, Passing], Mean]
    rested: Callable[[Array, Array, Window, float | Array], tuple[Mean, Window]]
    colour: Callable[[Array], float] = noise_left
    swings: Callable[[Array], Array] | None = None


def averaging_of(settings: RunSettings) -> Averaging:
    """The way a recording is averaged. The first is that of recordings which do not say where the arm stood."""
    if settings.site is None:
        return CORRELATED
    return BESIDE_LINES if settings.averages_beside_lines else AUTOREGRESSIVE


def dwelling_of(settings: RunSettings) -> Averaging:
    """The way a recording's dwells are averaged."""
    return BESIDE_LINES if settings.dwells_beside_lines else AUTOREGRESSIVE


def _turned_correlated(readings: Array, count: float | Array, passing: Passing) -> Mean:
    """Takes what comes once or twice in a turn for noise, and all that vibrates."""
    return mean_of(readings, count, passing.rate_rad_s[:, None], passing.covered, left_by_correlations)


def _rested_correlated(readings: Array, _: Array, window: Window, count: float | Array) -> tuple[Mean, Window]:
    return even_mean(readings, count, left_by_correlations), window


def _turned(readings: Array, count: float | Array, passing: Passing) -> Mean:
    """Leaves nothing in the mean of what comes once or twice in a turn: gravity, and the encoder's own error."""
    return mean_of(readings, count, np.column_stack([passing.rate_rad_s, passing.turning]), passing.covered)


def _turned_beside_lines(readings: Array, count: float | Array, passing: Passing) -> Mean:
    """Does so too, and few readings tell no lines."""
    if len(readings) >= FEWEST and passing.covered.all():
        return mean_beside_lines(
            readings, count, passing.turning, passing.rate_rad_s, closed=passing.closed, beats=passing.beats
        )
    return _turned(readings, count, passing)


def _rested_beside_lines(readings: Array, time_s: Array, window: Window, count: float | Array) -> tuple[Mean, Window]:
    found, lasting = mean_at_rest(readings, time_s, window, count)
    if len(readings) >= FEWEST and lasting != window:
        found = rest_beside_lines(readings, time_s, window, count)
    return found, lasting


CORRELATED = Averaging(_turned_correlated, _rested_correlated)
AUTOREGRESSIVE = Averaging(_turned, mean_at_rest)
BESIDE_LINES = Averaging(_turned_beside_lines, _rested_beside_lines, colour_left, swinging)
