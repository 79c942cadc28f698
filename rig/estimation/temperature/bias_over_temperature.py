"""The slope of a bias over temperature, from a run in which the sensor warmed and cooled by itself.

    b = b₀ + slope (T − T₀) + rate (t − t₀)

A sensor that only warms up does not separate temperature from time, so there is no result.
"""

from dataclasses import dataclass

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.refusals import check_count

MIN_RANGE_C = 3.0
MAX_CORRELATION = 0.9  # correlation of temperature and time, beyond which it more than doubles the slope's σ
MIN_REPEATS = 4  # for three parameters


@dataclass(frozen=True, slots=True)
class BiasOverTemperature:
    """The `slope` (3,) per °C, its standard deviation (3,), and the range of temperatures in which it is valid.

    `dof` (3,): degrees of freedom of the standard deviations, finite if the residuals determine them. `correlation` is
    that of temperature and time, whose slopes are estimated together.
    """

    slope: Array
    std: Array
    range_c: tuple[float, float]
    correlation: float
    dof: Array


def bias_over_temperature(bias: Array, std: Array, temperature_c: Array, time_s: Array) -> BiasOverTemperature:
    """Return the slope of biases (R, 3) with the standard deviations `std` at mean temperatures (R,) and times (R,).

    Larger residuals increase the standard deviations (Birge ratio). Raise Fault `too_few_observations`,
    `temperature_not_recorded`, `temperature_range_too_small`, `temperature_and_time_confounded`.
    """
    check_count(len(bias), MIN_REPEATS, 3)
    if np.isnan(temperature_c).any():
        raise Fault(
            "temperature_not_recorded",
            "the slope of a bias over temperature is requested, but the readings have no temperature",
            "Use a sensor that provides its temperature, or record a thermometer next to it",
        )
    low, high = float(temperature_c.min()), float(temperature_c.max())
    if high - low < MIN_RANGE_C:
        raise Fault(
            "temperature_range_too_small",
            f"the sensor was between {low:.1f} and {high:.1f} °C; a slope of its bias needs {MIN_RANGE_C:g} °C",
            "Begin while it is cold, or change the temperature of the room during the run",
        )
    correlation = float(np.corrcoef(temperature_c, time_s)[0, 1])
    if abs(correlation) > MAX_CORRELATION:
        raise Fault(
            "temperature_and_time_confounded",
            f"the temperature changed steadily with time (correlation {correlation:+.2f}), so the bias may "
            "follow either",
            "Let the sensor cool down and warm up again during the run, for example switched off between "
            "two parts of it (`rig resume`)",
        )
    columns = np.column_stack([np.ones(len(bias)), _standardise(temperature_c), _standardise(time_s)])
    slope, slope_std, dof = np.empty(3), np.empty(3), np.full(3, np.inf)
    residual_dof = len(bias) - columns.shape[1]
    for axis in range(3):
        weights = 1 / std[:, axis]
        design = columns * weights[:, None]
        coefficients, *_ = np.linalg.lstsq(design, bias[:, axis] * weights, rcond=None)
        residuals = bias[:, axis] * weights - design @ coefficients
        excess = max(1.0, float(np.sqrt(np.sum(residuals**2) / residual_dof)))  # Birge ratio
        dof[axis] = residual_dof if excess > 1.0 else np.inf
        slope[axis] = coefficients[1] / float(np.std(temperature_c))
        slope_std[axis] = excess * float(np.sqrt(np.linalg.inv(design.T @ design)[1, 1]) / np.std(temperature_c))
    return BiasOverTemperature(slope, slope_std, (low, high), correlation, dof)


def _standardise(values: Array) -> Array:
    scaled: Array = (values - values.mean()) / values.std()
    return scaled
