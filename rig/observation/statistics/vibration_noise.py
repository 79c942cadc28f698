"""The noise of readings that vibrate, from the residuals of a model of the vibration by spectral lines.

A vibration's scatter is not noise, and one turn has too few low frequencies to show the noise itself. The residuals are
usually white, so that their scatter determines the noise of a mean; otherwise their correlations do.
"""

from collections.abc import Sequence

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps
from rig.observation.statistics.coloured_noise import ORDERS, fit_autoregression
from rig.observation.statistics.mean import Mean, MeanNoise, compute_weighted_means, mean_at_rest, whole
from rig.observation.statistics.spectral_lines import LineSearch, find_lines, fit_columns, waves
from rig.observation.statistics.tapered_weights import weights
from rig.observation.windows import Window

MIN_READINGS = 120  # that separate spectral lines from noise
SHORT_ORDERS = (1, 2)  # orders of autoregression that fit coloured noise, but not the remainder of a spectral line


def average_rest(readings: Array, time_s: Array, window: Window, steps: Steps) -> Mean:
    """Return the mean of readings at rest with weights that cancel a vibration, which then does not count as noise."""
    residuals = readings - readings.mean(axis=0)
    shaking = _columns(residuals, LineSearch(sidebands=0))
    columns = np.column_stack([np.ones(len(residuals)), shaking])
    smooth = columns @ fit_columns(columns, residuals)
    noise = estimate_noise(residuals - smooth, columns.shape[1], steps, SHORT_ORDERS if shaking.size else ORDERS)
    tapered = weights(time_s, window.start_s, window.end_s)[None]
    (mean,) = compute_weighted_means(readings, whole(readings), tapered, smooth=smooth, noise=noise, steps=steps)
    return mean


def average_standstill(readings: Array, time_s: Array, window: Window, steps: Steps) -> tuple[Mean, Window]:
    """Return the mean of readings (n, 3) at times (n,) of an arm at rest, and the window that it represents."""
    mean, averaged_window = mean_at_rest(readings, time_s, window, steps)
    if len(readings) >= MIN_READINGS and averaged_window != window:
        mean = average_rest(readings, time_s, window, steps)
    return mean, averaged_window


def line_columns(residuals: Array) -> Array:
    """Return columns (n, 8 k) of the k spectral lines in residuals (n, 3) of a rotating sensor, eight for each line."""
    return _columns(residuals, LineSearch())


def fit_inflation(residuals: Array) -> float:
    """Return a factor like `fit_noise_factor`, but for residuals (n,) that may contain a part of a spectral line."""
    return fit_autoregression(residuals, SHORT_ORDERS).factor


def _columns(residuals: Array, search: LineSearch) -> Array:
    return waves(find_lines(residuals, search), np.arange(len(residuals)) / len(residuals), search.sidebands)


def estimate_noise(residuals: Array, parameters: int, steps: Steps, memories: Sequence[int]) -> MeanNoise:
    """Return the noise from residuals (n, 3) after a fit of `parameters` columns.

    `memories` are the orders of the autoregressive model (`fit_autoregression`) to choose from.
    """
    scatter = np.maximum(np.sum(residuals**2, axis=0) / (len(residuals) - parameters), steps.variance)
    inflations = [fit_autoregression(axis, memories) for axis in residuals.T]
    return MeanNoise(
        scatter=scatter,
        in_a_mean=scatter * np.array([axis.factor for axis in inflations]),
        dof=np.array([min(axis.dof, len(residuals) - parameters) for axis in inflations]),
    )
