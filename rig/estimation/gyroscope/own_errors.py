"""A gyroscope's errors outside the vector model, whose likely size the data sheet states.

These are nonlinearity and sensitivity to temperature. Each is an error common to many readings
(`rig.estimation.gyroscope.common_errors`). The result is corrected for the part that sweeps and rests determine; the
other part is a contributor of the budget.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.nonlinearity import CUBE_DEVIATION, SQUARE_DEVIATION, nonlinear_effects

NONLINEARITY = "nonlinearity"
BIAS_OVER_TEMPERATURE, SCALE_OVER_TEMPERATURE = "bias over temperature", "scale over temperature"
PART_SOURCE = "stated properties of the part"
ROUNDING = "rounding of the readings"
NEGLIGIBLE_FRACTION = 1e-3  # fraction of a mean's variance below which a common rounding error is ignored


@dataclass(frozen=True, slots=True)
class SensorProperties:
    """Half-widths of errors from the data sheet, and the temperature of N averages.

    - `nonlinearity`: largest distance from the best straight line that the odd or the even part alone may cause, as a
      fraction of `full_scale_rad_s`.
    - `bias_rad_s_per_k`, `scale_per_k`: changes with temperature.
    - `temperature_c` (N,): recorded in steps of `temperature_step_k`, NaN if not recorded.
    - `temperature_words`: source of the temperature, if it is not a thermometer.
    - `instability_rad_s`: the least Allan deviation of the bias.
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
    """A contributor of the budget: an error of `half_width` adds `patterns` (P, N, 3), rad/s, to the readings.

    `half_width` is in `unit`; `source` explains it.
    """

    name: str
    half_width: float
    unit: str
    patterns: Array
    source: str = PART_SOURCE


def list_own_errors(
    sensor: SensorProperties, matrix: Array, turns_rad_s: Array, windows_s: Array, speeds_rad_s: tuple[float, ...]
) -> Iterator[OwnError]:
    """Yield the errors due to nonlinearity and temperature in the means of N windows (N, 2) of sweeps and rests.

    `matrix` (3, 3) is the gyroscope's; `turns_rad_s` (N, 3) are the rates, zero in a rest. If all sweeps have one
    speed, the scale refers to this speed along an axis. An oblique rotation has a lower rate along the axis, for which
    the scale may differ. With several speeds the vector model estimates the nonlinearity, so it is not yielded. The
    change of temperature is relative to the mean over all windows for the bias, and to the mean over the sweeps for the
    scale. The first three of the temperature's patterns (6, N, 3) are for the recorded change, the others for the
    change that the thermometer hides.
    """
    if len(speeds_rad_s) == 1:
        unit_curves = nonlinear_effects(matrix, turns_rad_s, sensor.full_scale_rad_s, speeds_rad_s[0])
        coefficients = sensor.nonlinearity / np.repeat([CUBE_DEVIATION, SQUARE_DEVIATION], 3)[:, None, None]
        yield OwnError(NONLINEARITY, 100 * sensor.nonlinearity, "% of full scale", coefficients * unit_curves)
    duration_s = np.diff(windows_s)[:, 0]
    source = "; ".join(filter(None, (PART_SOURCE, sensor.temperature_words)))
    warmer_k = _temperature_deviations_k(sensor, windows_s, duration_s)
    patterns = sensor.bias_rad_s_per_k * np.einsum("kn,ij->kinj", warmer_k, np.eye(3))
    bias_deg_s_k = float(np.degrees(sensor.bias_rad_s_per_k))
    yield OwnError(BIAS_OVER_TEMPERATURE, bias_deg_s_k, "°/s/K", patterns.reshape(6, -1, 3), source)
    warmer_k = _temperature_deviations_k(sensor, windows_s, duration_s * turns_rad_s.any(axis=1))
    patterns = sensor.scale_per_k * np.einsum("kn,ni,ij->kinj", warmer_k, turns_rad_s @ matrix.T, np.eye(3))
    yield OwnError(SCALE_OVER_TEMPERATURE, 1e6 * sensor.scale_per_k, "ppm/K", patterns.reshape(6, -1, 3), source)


def rounding_errors(means_rad_s: Array, roundings_rad_s: Array | float, variances_rad2_s2: Array) -> Iterator[OwnError]:
    """Yield the rounding errors that means (N, 3) share; `roundings_rad_s` are the standard uncertainties of rounding.

    Means that differ by less than a step, such as those of all rests, share one error, which averaging does not reduce.
    The variances (N, 3) contain the independent part of rounding. Negligible errors are omitted.
    """
    roundings = np.broadcast_to(roundings_rad_s, means_rad_s.shape)
    matters = roundings**2 > NEGLIGIBLE_FRACTION * variances_rad2_s2
    patterns = []
    for axis in np.flatnonzero(matters.any(axis=0)):
        half_widths = np.sqrt(3) * roundings[:, axis]
        order = np.argsort(means_rad_s[:, axis])
        apart = np.diff(means_rad_s[order, axis]) > half_widths[order][1:] + half_widths[order][:-1]
        for group in np.split(order, np.flatnonzero(apart) + 1):
            if matters[group, axis].any():
                size = np.zeros(means_rad_s.shape)
                size[group, axis] = roundings[group, axis]
                patterns.append(np.sqrt(3) * size)
    if patterns:
        largest = float(np.degrees(np.max(patterns)))
        yield OwnError(ROUNDING, largest, "°/s", np.array(patterns), "the steps in which the readings come")


def _temperature_deviations_k(sensor: SensorProperties, windows_s: Array, weights: Array) -> Array:
    """Return the deviations (2, N), K, from the mean temperature: those recorded, then those that may be hidden."""
    recorded = subtract_mean(sensor.temperature_c, weights)
    return np.array([recorded, unseen_k(sensor.temperature_step_k, windows_s, weights)])


def unseen_k(step_k: float, windows_s: Array, weights: Array) -> Array:
    """Return the temperature deviations (N,), K, in a linear drift that the thermometer hides.

    The drift is `step_k` from the first window to the last; the deviations are from the mean with `weights` (N,).
    """
    middle = windows_s.mean(axis=1)
    return np.asarray(step_k * subtract_mean(middle, weights) / np.ptp(middle), dtype=np.float64)


def subtract_mean(values: Array, weights: Array) -> Array:
    """Return values (N,) minus their weighted mean; zero for values that are NaN."""
    deviation = values - weights @ values / weights.sum()
    return np.where(np.isnan(deviation), 0.0, deviation)
