"""The certificate's pictures as geometry; the page draws them as inline SVG."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.accelerometer_entries import AccelerometerEntry
from rig.data.budget_entries import BudgetEntry
from rig.data.drift_entries import DriftEntry
from rig.data.magnetometer_entries import MagnetometerEntry
from rig.data.result_file import AverageEntry, ObservationEntry, SensorEntry
from rig.data.result_types import ErrorEntry
from rig.estimation.arrays import Array

WIDTH, LEFT, RIGHT = 340.0, 42.0, 8.0
TOP, HEIGHT = 18.0, 104.0
NAMES, ROW, DECADES = 106.0, 13.0, 4
RATES = ((1e3, "mrad/s"), (1e6, "µrad/s"))
ACCELERATIONS = ((1.0, "m/s²"), (1e3, "mm/s²"), (1e6, "µm/s²"))
FIELDS = ((1e6, "µT"), (1e9, "nT"))


@dataclass(frozen=True, slots=True)
class Point:
    """A residual and its bar, in pixels."""

    x: float
    y: float
    low: float
    high: float
    axis: int


@dataclass(frozen=True, slots=True)
class Residuals:
    """Three values of each sweep, attitude or repeat; `ticks` are heights with their labels, rests begin at `split`."""

    points: tuple[Point, ...]
    ticks: tuple[tuple[float, str], ...]
    zero: float
    split: float | None
    unit: str
    within: int


@dataclass(frozen=True, slots=True)
class Contributions:
    """How much each contributor makes of the combined uncertainty, on a logarithmic axis: (name, y, x of k, x of b)."""

    rows: tuple[tuple[str, float, float, float], ...]
    ticks: tuple[tuple[float, str], ...]
    end: float


def residuals(sensor: SensorEntry) -> Residuals | None:
    """None where the vector model has no solution, or its residuals are not those of the sweeps and rests here."""
    vector = sensor.vector_model
    averages: list[ObservationEntry | AverageEntry] = [*sensor.observations, *sensor.rests]
    if isinstance(vector, ErrorEntry) or len(vector.residuals_rad_s) != len(averages) or not averages:
        return None
    # Not the average's own standard deviation, which counts as drift of the bias what gravity does to the rests.
    std = np.array([each.noise_rad_s for each in averages]) / np.sqrt([[each.samples] for each in averages])
    split = len(sensor.observations) if sensor.rests else None
    return _marked(np.array(vector.residuals_rad_s), std, RATES, split)


def acceleration_residuals(found: AccelerometerEntry) -> Residuals:
    """What the model leaves of each attitude."""
    left, std = ([getattr(each, name) for each in found.dwells] for name in ("residual_m_s2", "mean_std_m_s2"))
    return _marked(np.array(left), np.array(std), ACCELERATIONS)


def field_residuals(found: MagnetometerEntry) -> Residuals:
    """The same of a magnetometer."""
    left, std = ([getattr(each, name) for each in found.dwells] for name in ("residual_t", "mean_std_t"))
    return _marked(np.array(left), np.array(std), FIELDS)


def biases_by_repeat(quantity: str, found: DriftEntry) -> Residuals:
    """Less their mean over the repeats."""
    bias = np.array([each.held.bias for each in found.repeats])
    std = np.array([each.held.std for each in found.repeats])
    return _marked(bias - bias.mean(axis=0), std, RATES if quantity == "rate" else ACCELERATIONS)


def _marked(left: Array, std: Array, units: Sequence[tuple[float, str]], split: int | None = None) -> Residuals:
    """Values (n, 3) side by side, their bars two standard deviations, in a unit that suits the largest."""
    bars = 2 * std
    reach, unit, factor = _scale(float((np.abs(left) + bars).max()), units)
    across = (WIDTH - LEFT - RIGHT) / len(left)

    def height(value: float) -> float:
        return round(TOP + HEIGHT / 2 * (1 - value * factor / reach), 1)

    def point(place: int, axis: int) -> Point:
        value, bar = left[place, axis], bars[place, axis]
        x = LEFT + across * (place + 0.5 + 0.22 * (axis - 1))
        return Point(round(x, 1), height(value), height(value - bar), height(value + bar), axis)

    points = tuple(point(place, axis) for place in range(len(left)) for axis in range(3))
    ticks = tuple((height(at / factor), f"{at:g}".replace("-", "−")) for at in (-reach / 1.1, 0.0, reach / 1.1))
    begins = None if split is None else round(LEFT + across * split, 1)
    return Residuals(points, ticks, height(0.0), begins, unit, int((np.abs(left) <= bars).sum()))


def _scale(largest: float, units: Sequence[tuple[float, str]]) -> tuple[float, str, float]:
    """A round reach above it, the unit's prefix, and what takes SI there: the first unit in which it is above 1."""
    factor, unit = next((each for each in units if largest * each[0] >= 1), units[-1])
    decade = 10 ** np.floor(np.log10(max(largest * factor, 1e-9)))
    reach = next(step * decade for step in (1, 2, 3, 4, 5, 6, 8, 10) if step * decade >= largest * factor)
    return 1.1 * float(reach), unit, factor


def contributions(budget: BudgetEntry) -> Contributions:
    """Standard uncertainty over the combined one, of the axis for which that is the largest; at least 1e-4 is drawn."""
    across = (WIDTH - NAMES - RIGHT) / DECADES

    def place(share: float) -> float:
        return round(NAMES + across * (DECADES + float(np.log10(np.clip(np.sqrt(share), 10.0**-DECADES, 1.0)))), 1)

    lines = sorted(budget.contributors, key=lambda line: -max(line.share))
    rows = tuple(
        (line.name, TOP + ROW * (i + 0.5), place(max(line.share[:3])), place(max(line.share[3:])))
        for i, line in enumerate(lines)
    )
    labels = ("0.01 %", "0.1 %", "1 %", "10 %", "100 %")
    ticks = tuple((NAMES + across * i, label) for i, label in enumerate(labels))
    return Contributions(rows, ticks, TOP + ROW * len(rows))
