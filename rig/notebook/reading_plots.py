"""Pictures of readings, residuals and comparisons. They need matplotlib, which the extra `study` installs."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.gyroscope.comparison import Comparison
from rig.errors import Refused
from rig.errors.extras import requiring
from rig.estimation.arrays import Array
from rig.estimation.statistics.coverage import COVERAGE_FACTOR
from rig.observation.windows import Window
from rig.report.certificate.svg_plots import UprightAxis
from rig.report.figures.verification import draw_comparison
from rig.report.findings.unexplained import Unexplained

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 110


@dataclass(frozen=True)
class Plot:
    """A picture that a notebook displays; `figure` is matplotlib's, for further changes."""

    figure: "Figure"

    def save(self, path: str | Path) -> None:
        """Write the figure into the file `path`, whose extension determines the format."""
        self.figure.savefig(path, dpi=DPI)

    def _repr_png_(self) -> bytes:
        picture = BytesIO()
        self.figure.savefig(picture, format="png", dpi=DPI)
        return picture.getvalue()


def plot_readings(time_s: Array, values: Mapping[str, Array], sweeps: Iterable[Window], title: str) -> Plot:
    """Return a plot of the axes' values (n,) over the arm's time (n,), with the sweeps shaded."""
    figure = _figure(10, 3.5)
    axes = figure.subplots()
    begin_s = float(time_s[0]) if len(time_s) else 0.0
    for window in sweeps:
        axes.axvspan(window.start_s - begin_s, window.end_s - begin_s, color="0.92", lw=0)
    for axis, column in values.items():
        axes.plot(time_s - begin_s, column, lw=0.7, label=axis)
    axes.set(xlabel="time s")
    _finish(axes, title)
    return Plot(figure)


def plot_residuals(panels: Sequence[tuple[str, Unexplained]]) -> Plot:
    """Return a plot with a panel of residuals for each name. Raise Refused `nothing_to_plot`."""
    if not panels:
        raise Refused(
            "nothing_to_plot",
            "the result keeps no residual of a sweep, rest, attitude or repeat",
            "A solution by turned angles keeps none, nor does one that failed; print the result to see which it is",
        )
    figure = _figure(10, 3 * len(panels))
    for axes, (name, unexplained) in zip(figure.subplots(len(panels), squeeze=False)[:, 0], panels, strict=True):
        positions, largest = np.arange(len(unexplained.values)), float(np.abs(unexplained.values).max())
        unit = UprightAxis.fit(largest, unexplained.quantity.residuals).unit
        values, bars = unexplained.values / unit.size, COVERAGE_FACTOR * unexplained.stds / unit.size
        for i, axis in enumerate(unexplained.quantity.axes):
            shifted = positions + (i - 1) * 0.15
            axes.errorbar(shifted, values[:, i], bars[:, i], fmt="o", ms=3, lw=0.8, label=axis)
        axes.axhline(0, color="0.5", lw=0.8)
        axes.set(ylabel=unit.name)
        axes.set_xticks(positions, unexplained.labels, rotation=60, ha="right")
        _finish(axes, f"{name}: {unexplained.shown}\n")
        note = f"± 2 σ: {unexplained.expectation}"
        axes.text(0, 1.02, note, transform=axes.transAxes, fontsize="x-small", color="0.4")
    return Plot(figure)


def plot_comparison(comparison: Comparison, sensor: str, reference: str) -> Plot:
    """Return a plot of both sensors' readings on the left, and their difference on the right."""
    figure = _figure(10, 7.5)
    draw_comparison(figure, comparison, sensor, reference)
    return Plot(figure)


def _finish(axes: "Axes", title: str) -> None:
    """Write the title at the left, and the axes' names to the right of it."""
    axes.set_title(title, loc="left")
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0, ncols=3, frameon=False)


def _figure(width: float, height: float) -> "Figure":
    with requiring("study"):
        from matplotlib.figure import Figure
    return Figure(figsize=(width, height), layout="constrained")
