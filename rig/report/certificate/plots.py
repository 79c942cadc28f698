"""The certificate's pictures as geometry; the page draws them as inline SVG."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.data.entries.budget import BudgetEntry
from rig.data.entries.drift import DriftEntry
from rig.data.quantity import Unit
from rig.data.result_file import GyroscopeEntry
from rig.report.findings.finding import Finding
from rig.report.findings.unexplained import Unexplained, of_attitudes, of_repeats, of_sweeps_and_rests
from rig.report.tables.certificate import AXES
from rig.report.words.printed_budget import shown_places

WIDTH, LEFT, RIGHT = 340.0, 42.0, 8.0
TOP, HEIGHT = 18.0, 104.0
NAMES, ROW, DECADES = 106.0, 13.0, 4


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


def residuals(finding: Finding[GyroscopeEntry]) -> Residuals | None:
    """What is left of a gyroscope's sweeps and rests; None where nothing is."""
    left = of_sweeps_and_rests(finding)
    return None if left is None else _drawn(left)


def attitude_residuals(finding: Finding[Any]) -> Residuals:
    """What is left of each attitude."""
    return _drawn(of_attitudes(finding))


def biases_by_repeat(finding: Finding[DriftEntry]) -> Residuals:
    """The biases by repeat, less their mean over the repeats."""
    return _drawn(of_repeats(finding))


def _drawn(unexplained: Unexplained) -> Residuals:
    """Values (n, 3) side by side, their bars two standard deviations, in a unit that suits the largest."""
    left, bars, split = unexplained.values, 2 * unexplained.stds, unexplained.split
    reach, unit = reach_in(float((np.abs(left) + bars).max()), unexplained.quantity.residuals)
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
    within = int((np.abs(left) <= bars).sum())
    return Residuals(points, ticks, height(0.0), begins, unit.name, within, unexplained.shown, unexplained.of)


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

    lines = sorted(budget.contributors, key=lambda line: -max(line.variance_fraction[k], line.variance_fraction[b]))
    rows = tuple(
        (line.name, TOP + ROW * (i + 0.5), place(line.variance_fraction[k]), place(line.variance_fraction[b]))
        for i, line in enumerate(lines)
    )
    labels = ("0.01 %", "0.1 %", "1 %", "10 %", "100 %")
    ticks = tuple((NAMES + across * i, label) for i, label in enumerate(labels))
    return Contributions((AXES[k], AXES[b - 3]), rows, ticks, TOP + ROW * len(rows))
