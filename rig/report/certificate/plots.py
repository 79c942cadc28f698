"""The certificate's pictures as geometry; the page draws them as inline SVG."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.data.accelerometer_entries import AccelerometerEntry
from rig.data.budget_entries import BudgetEntry
from rig.data.drift_entries import DriftEntry
from rig.data.magnetometer_entries import MagnetometerEntry
from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity, Unit
from rig.data.result_file import AverageEntry, ObservationEntry, SensorEntry
from rig.data.result_types import ErrorEntry
from rig.estimation.arrays import Array
from rig.report.certificate.tables import AXES
from rig.report.printed_budget import shown_places

WIDTH, LEFT, RIGHT = 340.0, 42.0, 8.0
TOP, HEIGHT = 18.0, 104.0
NAMES, ROW, DECADES = 106.0, 13.0, 4
EXPECTED = "what noise, a wandering bias and the ends of turns are expected to leave"
EXPECTED_IN_ATTITUDES = {
    ACCELERATION: "what noise, the arm's attitudes and a sensor within its data sheet are expected to leave",
    FIELD: "what noise and the arm's attitudes are expected to leave",
}
EXPECTED_OF_FILES = "what noise and the file's attitudes are expected to leave"
OF_SAMPLES = "the samples' scatter over the root of their number, which holds vibration that a mean leaves out"
OF_ATTITUDES = "noise and of the arm's attitudes"
OF_REPEATS = "what differs between repeats"
FROM_MEAN = "less its mean"


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
    """Three values of each sweep, attitude or repeat; `ticks` are heights with their labels, rests begin at `split`.

    `shown` is what the points are, `of` what the bars, two standard deviations, are of.
    """

    points: tuple[Point, ...]
    ticks: tuple[tuple[float, str], ...]
    zero: float
    split: float | None
    unit: str
    within: int
    shown: str
    of: str


@dataclass(frozen=True, slots=True)
class Contributions:
    """How much each contributor makes of the combined uncertainty, on a logarithmic axis: (name, y, x of k, x of b).

    Of the values the budget is printed for, their `axes`.
    """

    axes: tuple[str, str]
    rows: tuple[tuple[str, float, float, float], ...]
    ticks: tuple[tuple[float, str], ...]
    end: float


def residuals(sensor: SensorEntry) -> Residuals | None:
    """A gyroscope's residuals; None where the vector model has none, or they are of other sweeps and rests."""
    vector = sensor.vector_model
    averages: list[ObservationEntry | AverageEntry] = [*sensor.observations, *sensor.rests]
    if isinstance(vector, ErrorEntry) or len(vector.residuals_rad_s) != len(averages) or not averages:
        return None
    split = len(sensor.observations) if sensor.rests else None
    left = np.array(vector.residuals_rad_s)
    if vector.residuals_std_rad_s is not None:
        return _marked(left, np.array(vector.residuals_std_rad_s), RATE, EXPECTED, split=split)
    # Not the average's own standard deviation, which counts as drift of the bias what gravity does to the rests.
    std = np.array([each.noise_rad_s for each in averages]) / np.sqrt([[each.samples] for each in averages])
    return _marked(left, std, RATE, OF_SAMPLES, split=split)


def attitude_residuals(quantity: Quantity, found: AccelerometerEntry | MagnetometerEntry) -> Residuals:
    """What the model leaves of each attitude, with what was expected of that."""

    def of(dwell: object, what: str) -> Any:
        return getattr(dwell, quantity.named(what))

    left = np.array([of(dwell, "residual") for dwell in found.dwells])
    expected = [told for dwell in found.dwells if (told := of(dwell, "residual_std")) is not None]
    if len(expected) == len(left):
        what = EXPECTED_OF_FILES if found.laid_down is not None else EXPECTED_IN_ATTITUDES[quantity]
        return _marked(left, np.array(expected), quantity, what)
    std, mean = (np.array([of(dwell, name) for dwell in found.dwells]) for name in ("mean_std", "mean"))
    turned = _turned(np.array(found.matrix), mean - np.array(of(found, "bias")), found.attitude_error_rad)
    return _marked(left, np.hypot(std, turned), quantity, OF_ATTITUDES)


def _turned(matrix: Array, readings: Array, attitude_error_rad: float | None) -> Array:
    """(n, 3) what readings (n, 3), the bias taken out, change by for attitudes off by that about each axis."""
    reference = readings @ np.linalg.inv(matrix).T  # in the sensor's own frame
    turns = (attitude_error_rad or 0.0) * np.cross(np.eye(3)[None], reference[:, None])  # (n, 3 axes, 3)
    found: Array = np.linalg.norm(turns @ matrix.T, axis=1)
    return found


def biases_by_repeat(quantity: Quantity, found: DriftEntry) -> Residuals:
    """The biases by repeat, less their mean over the repeats."""
    bias = np.array([each.held.bias for each in found.repeats])
    std = np.array([each.held.std for each in found.repeats])
    return _marked(bias - bias.mean(axis=0), std, quantity, OF_REPEATS, shown=FROM_MEAN)


def _marked(
    left: Array,
    std: Array,
    quantity: Quantity,
    of: str,
    *,
    shown: str = "mean reading less model",
    split: int | None = None,
) -> Residuals:
    """Values (n, 3) side by side, their bars two standard deviations, in a unit that suits the largest."""
    bars = 2 * std
    reach, unit = reach_in(float((np.abs(left) + bars).max()), quantity.residuals)
    across = (WIDTH - LEFT - RIGHT) / len(left)

    def height(value: float) -> float:
        return round(TOP + HEIGHT / 2 * (1 - value / unit.size / reach), 1)

    def point(place: int, axis: int) -> Point:
        value, bar = left[place, axis], bars[place, axis]
        x = LEFT + across * (place + 0.5 + 0.22 * (axis - 1))
        return Point(round(x, 1), height(value), height(value - bar), height(value + bar), axis)

    points = tuple(point(place, axis) for place in range(len(left)) for axis in range(3))
    ticks = tuple((height(at * unit.size), f"{at:g}".replace("-", "−")) for at in (-reach / 1.1, 0.0, reach / 1.1))
    begins = None if split is None else round(LEFT + across * split, 1)
    return Residuals(points, ticks, height(0.0), begins, unit.name, int((np.abs(left) <= bars).sum()), shown, of)


def reach_in(largest: float, units: Sequence[Unit]) -> tuple[float, Unit]:
    """A round reach above it, and the unit that is in: the first in which it is above 1."""
    unit = next((each for each in units if largest >= each.size), units[-1])
    shown = largest / unit.size
    decade = 10 ** np.floor(np.log10(max(shown, 1e-9)))
    reach = next(step * decade for step in (1, 2, 3, 4, 5, 6, 8, 10) if step * decade >= shown)
    return 1.1 * float(reach), unit


def contributions(budget: BudgetEntry, scale: Sequence[float]) -> Contributions:
    """Standard uncertainty over the combined one, for the values of the printed budget; at least 1e-4 is drawn."""
    k, b = shown_places(budget, scale)
    across = (WIDTH - NAMES - RIGHT) / DECADES

    def place(share: float) -> float:
        return round(NAMES + across * (DECADES + float(np.log10(np.clip(np.sqrt(share), 10.0**-DECADES, 1.0)))), 1)

    lines = sorted(budget.contributors, key=lambda line: -max(line.share[k], line.share[b]))
    rows = tuple(
        (line.name, TOP + ROW * (i + 0.5), place(line.share[k]), place(line.share[b])) for i, line in enumerate(lines)
    )
    labels = ("0.01 %", "0.1 %", "1 %", "10 %", "100 %")
    ticks = tuple((NAMES + across * i, label) for i, label in enumerate(labels))
    return Contributions((AXES[k], AXES[b - 3]), rows, ticks, TOP + ROW * len(rows))
