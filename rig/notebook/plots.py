"""Pictures of readings, residuals and comparisons. Needs matplotlib, which the extra `study` brings."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.comparison import Comparison
from rig.data.result_file import SensorEntry, VectorEntry
from rig.errors import Refused
from rig.errors.extras import missing_extra
from rig.estimation.arrays import Array
from rig.estimation.coverage import COVERAGE_FACTOR
from rig.observation.windows import Window
from rig.report.figures import draw_comparison

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 110


@dataclass(frozen=True)
class Plot:
    """A picture that a notebook shows by itself; `figure` is matplotlib's, to go on with."""

    figure: "Figure"

    def save(self, path: str | Path) -> None:
        """Write the figure into a file; its ending says which format."""
        self.figure.savefig(path, dpi=DPI)

    def _repr_png_(self) -> bytes:
        picture = BytesIO()
        self.figure.savefig(picture, format="png", dpi=DPI)
        return picture.getvalue()


def plot_readings(time_s: Array, values: Mapping[str, Array], sweeps: Iterable[Window], title: str) -> Plot:
    """Values (n,) of each axis over the arm's time (n,), the sweeps shaded; the title says what in which unit."""
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


def plot_residuals(sensors: Mapping[str, SensorEntry]) -> Plot:
    """Reading less vector model of every sweep and rest, with U of each mean. Raises Refused `nothing_to_plot`."""
    solved = {
        name: (found, model)
        for name, found in sensors.items()
        if isinstance(model := found.vector_model, VectorEntry) and (found.observations or found.rests)
    }
    if not solved:
        raise Refused(
            "nothing_to_plot",
            "no sweeps were solved by the vector model here",
            "The result says why, sensor by sensor",
        )
    figure = _figure(10, 3 * len(solved))
    panels = figure.subplots(len(solved), sharex=True, squeeze=False)[:, 0]
    for axes, (name, (found, model)) in zip(panels, solved.items(), strict=True):
        stds = [turn.mean_std_rad_s for turn in found.observations] + [rest.mean_std_rad_s for rest in found.rests]
        expanded = COVERAGE_FACTOR * np.array(stds)
        residuals = np.array(model.residuals_rad_s)
        for i, axis in enumerate("xyz"):
            places = np.arange(len(expanded)) + (i - 1) * 0.15
            axes.errorbar(places, residuals[:, i], expanded[:, i], fmt="o", ms=3, lw=0.8, label=axis)
        axes.axhline(0, color="0.5", lw=0.8)
        axes.set(ylabel="residual rad/s")
        axes.set_xticks(
            range(len(expanded)),
            [f"{o.joint} {o.direction}" for o in found.observations] + ["rest"] * len(found.rests),
            rotation=60,
            ha="right",
        )
        _finish(axes, f"{name}: reading − model, ± U of the mean (k = 2)")
    return Plot(figure)


def plot_comparison(comparison: Comparison, sensor: str, reference: str) -> Plot:
    """Readings of both on the left, their difference on the right."""
    figure = _figure(10, 7.5)
    draw_comparison(figure, comparison, sensor, reference)
    return Plot(figure)


def _finish(axes: "Axes", title: str) -> None:
    """A title on the left, the axes' names on the right of it."""
    axes.set_title(title, loc="left")
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0, ncols=3, frameon=False)


def _figure(width: float, height: float) -> "Figure":
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise missing_extra(error, "study") from error
    return Figure(figsize=(width, height), layout="constrained")
