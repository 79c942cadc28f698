"""How a bias depends on temperature, from a run in which the sensor warmed and cooled by itself.

    b = b₀ + slope (T − T₀) + rate (t − t₀)

A sensor that only warms up tells temperature and time apart as little as one that only ages: then nothing is said.
"""

from dataclasses import dataclass

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.refusals import check_count

MIN_RANGE_C = 3.0
MAX_CORRELATION = 0.9  # of temperature and time: beyond, the slope's σ is more than doubled by not knowing which it was
FEWEST = 4  # repeats, for three parameters


@dataclass(frozen=True, slots=True)
class BiasOverTemperature:
    """`slope` (3,) per °C, its standard deviation (3,), and the range of temperatures it was seen in, and holds in.

    `freedom` (3,) of the deviations: those of the residuals where these made them, else infinite.

    `correlation` is that of temperature and time, which are found together.
    """

    slope: Array
    std: Array
    range_c: tuple[float, float]
    correlation: float
    freedom: Array


def bias_over_temperature(bias: Array, std: Array, temperature_c: Array, time_s: Array) -> BiasOverTemperature:
    """The slope of the bias of R repeats (R, 3), known to `std` (R, 3), their mean temperatures (R,) and times (R,).

    Deviations are as large as the residuals say, where these are larger. Raises Fault `too_few_observations`,
    `temperature_not_recorded`, `temperature_range_too_small`, `temperature_and_time_confounded`.
    """
    check_count(len(bias), FEWEST, 3)
    if np.isnan(temperature_c).any():
        raise Fault(
            "temperature_not_recorded",
            "the slope of a bias over temperature is asked for, and the readings have no temperature",
            "Use a sensor that provides its temperature, or record a thermometer beside it",
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
    columns = np.column_stack([np.ones(len(bias)), _scaled(temperature_c), _scaled(time_s)])
    slope, known, freedom = np.empty(3), np.empty(3), np.full(3, np.inf)
    left_over = len(bias) - columns.shape[1]
    for axis in range(3):
        white = 1 / std[:, axis]
        design = columns * white[:, None]
        found, *_ = np.linalg.lstsq(design, bias[:, axis] * white, rcond=None)
        left = bias[:, axis] * white - design @ found
        excess = max(1.0, float(np.sqrt(np.sum(left**2) / left_over)))
        freedom[axis] = left_over if excess > 1.0 else np.inf
        slope[axis] = found[1] / float(np.std(temperature_c))
        known[axis] = excess * float(np.sqrt(np.linalg.inv(design.T @ design)[1, 1]) / np.std(temperature_c))
    return BiasOverTemperature(slope, known, (low, high), correlation, freedom)


def _scaled(values: Array) -> Array:
    scaled: Array = (values - values.mean()) / values.std()
    return scaled
