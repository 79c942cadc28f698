"""Geometry of the certificate's pictures; the page draws them as inline SVG."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.data.entries.bias_drift import DriftEntry
from rig.data.entries.budget import BudgetEntry
from rig.data.quantity import DisplayUnit
from rig.data.result_file import GyroscopeEntry
from rig.report.findings.finding import Finding
from rig.report.findings.unexplained import (
    Unexplained,
    find_attitude_residuals,
    find_repeat_residuals,
    find_sweep_residuals,
)
from rig.report.tables.certificate import AXES
from rig.report.words.printed_budget import find_printed_indices

WIDTH, LEFT_MARGIN, RIGHT_MARGIN = 340.0, 42.0, 8.0
TOP, HEIGHT = 18.0, 104.0
NAMES, ROW, DECADES = 150.0, 13.0, 4


@dataclass(frozen=True, slots=True)
class UprightAxis:
    """The upright axis of a picture, from −`reach` to `reach` in its `unit`."""

    reach: float
    unit: DisplayUnit

    @classmethod
    def fit(cls, largest: float, units: Sequence[DisplayUnit]) -> "UprightAxis":
        """Return an axis that ends a tenth beyond the next round number above `largest`, in one of `units`.

        The unit is the first in which `largest` is at least 1, or else the last.
        """
        unit = next((unit for unit in units if largest >= unit.size), units[-1])
        shown = largest / unit.size
        decade = 10 ** np.floor(np.log10(max(shown, 1e-9)))
        reach = next(step * decade for step in (1, 2, 3, 4, 5, 6, 8, 10) if step * decade >= shown)
        return cls(1.1 * float(reach), unit)

    def height(self, value: float) -> float:
        """Return the height, in pixels, of a value in SI units."""
        return round(TOP + HEIGHT / 2 * (1 - value / self.unit.size / self.reach), 1)

    @property
    def ticks(self) -> tuple[tuple[float, str], ...]:
        """The heights of three ticks, and their labels."""
        values = (-self.reach / 1.1, 0.0, self.reach / 1.1)
        return tuple((self.height(value * self.unit.size), f"{value:g}".replace("-", "−")) for value in values)


@dataclass(frozen=True, slots=True)
class PlotPoint:
    """A point of a plot in pixels: a residual of the axis number `axis`, and its bar from `low` to `high`."""

    x: float
    y: float
    low: float
    high: float
    axis: int


@dataclass(frozen=True, slots=True)
class Residuals:
    """A plot of residuals: three points with bars for each sweep and rest, for each attitude, or for each repeat.

    `ticks` are heights with their labels. `split` is the abscissa at which the rests begin, if there are any. `within`
    is the number of bars that contain zero. `shown` describes the points, `expectation` the bars of two standard
    deviations.
    """

    points: tuple[PlotPoint, ...]
    ticks: tuple[tuple[float, str], ...]
    zero: float
    split: float | None
    unit: str
    within: int
    shown: str
    expectation: str


@dataclass(frozen=True, slots=True)
class Contributions:
    """Contributions to the combined uncertainties of one scale factor and one bias, on a logarithmic axis.

    Each of `rows` is a contributor's name, the height at which it is drawn, and its abscissas for the scale factor and
    for the bias. `axes` are the sensor axes of both, which are those of the printed budget.
    """

    axes: tuple[str, str]
    rows: tuple[tuple[str, float, float, float], ...]
    ticks: tuple[tuple[float, str], ...]
    end: float


def residuals(finding: Finding[GyroscopeEntry]) -> Residuals | None:
    """Return the plot of the residuals of a gyroscope's sweeps and rests; None without residuals."""
    unexplained = find_sweep_residuals(finding)
    return None if unexplained is None else _draw(unexplained)


def attitude_residuals(finding: Finding[Any]) -> Residuals:
    """Return the plot of the residuals of each attitude."""
    return _draw(find_attitude_residuals(finding))


def biases_by_repeat(finding: Finding[DriftEntry]) -> Residuals:
    """Return the plot of the bias in each repeat of the attitudes, minus the mean over all repeats."""
    return _draw(find_repeat_residuals(finding))


def _draw(unexplained: Unexplained) -> Residuals:
    """Return a plot of values (n, 3) with bars of two standard deviations, in a unit that suits the largest value."""
    values, bars, split = unexplained.values, 2 * unexplained.stds, unexplained.split
    upright = UprightAxis.fit(float((np.abs(values) + bars).max()), unexplained.quantity.residuals)
    across, height = (WIDTH - LEFT_MARGIN - RIGHT_MARGIN) / len(values), upright.height

    def point(index: int, axis: int) -> PlotPoint:
        value, bar = values[index, axis], bars[index, axis]
        x = LEFT_MARGIN + across * (index + 0.5 + 0.22 * (axis - 1))
        return PlotPoint(round(x, 1), height(value), height(value - bar), height(value + bar), axis)

    points = tuple(point(index, axis) for index in range(len(values)) for axis in range(3))
    begins = None if split is None else round(LEFT_MARGIN + across * split, 1)
    within, words = int((np.abs(values) <= bars).sum()), (unexplained.shown, unexplained.expectation)
    return Residuals(points, upright.ticks, height(0.0), begins, upright.unit.name, within, *words)


def contributions(budget: BudgetEntry, scale: Sequence[float]) -> Contributions:
    """Return the plot of each contributor's standard uncertainty divided by the combined one, from 1e-4 to 1."""
    k, b = find_printed_indices(budget, scale)
    across = (WIDTH - NAMES - RIGHT_MARGIN) / DECADES

    def position(fraction: float) -> float:
        return round(NAMES + across * (DECADES + float(np.log10(np.clip(np.sqrt(fraction), 10.0**-DECADES, 1.0)))), 1)

    lines = sorted(budget.contributors, key=lambda line: -max(line.variance_fraction[k], line.variance_fraction[b]))
    rows = tuple(
        (line.name, TOP + ROW * (i + 0.5), position(line.variance_fraction[k]), position(line.variance_fraction[b]))
        for i, line in enumerate(lines)
    )
    labels = ("0.01 %", "0.1 %", "1 %", "10 %", "100 %")
    ticks = tuple((NAMES + across * i, label) for i, label in enumerate(labels))
    return Contributions((AXES[k], AXES[b - 3]), rows, ticks, TOP + ROW * len(rows))
