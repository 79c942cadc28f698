"""The ways in which readings at rest have been averaged: a recording keeps that of its time, so that its numbers stay.

They differ in how a mean allows for readings that are not independent: by their correlations, by an autoregression, or
beside what vibrates, which is taken out as lines.
"""

from collections.abc import Callable
from dataclasses import dataclass

from rig.data.settings import RunSettings
from rig.estimation.arrays import Array
from rig.estimation.rounding import Steps
from rig.observation.beside_lines import FEWEST, colour_left, rest_beside_lines, swinging
from rig.observation.coloured_noise import left_by_correlations, noise_left
from rig.observation.mean import Mean, even_mean, mean_at_rest
from rig.observation.windows import Window


@dataclass(frozen=True, slots=True)
class Averaging:
    """One way of averaging readings (n, 3) that come in `Steps`.

    `rested(readings, time_s, window, steps)` is the mean of an arm that stands, and from when to when it is said to
    last. Beside a harmonic `colour(residuals)` is the factor on the variance by residuals (n,) that are not white,
    `swings(residuals)` are the columns of what swings in residuals (n, 3), None where one line alone is looked for.
    """

    rested: Callable[[Array, Array, Window, Steps], tuple[Mean, Window]]
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


def _rested_correlated(readings: Array, _: Array, window: Window, steps: Steps) -> tuple[Mean, Window]:
    return even_mean(readings, steps, left_by_correlations), window


def _rested_beside_lines(readings: Array, time_s: Array, window: Window, steps: Steps) -> tuple[Mean, Window]:
    found, lasting = mean_at_rest(readings, time_s, window, steps)
    if len(readings) >= FEWEST and lasting != window:
        found = rest_beside_lines(readings, time_s, window, steps)
    return found, lasting


CORRELATED = Averaging(_rested_correlated)
AUTOREGRESSIVE = Averaging(mean_at_rest)
BESIDE_LINES = Averaging(_rested_beside_lines, colour_left, swinging)
