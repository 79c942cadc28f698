"""Pictures of a sensor's series: each calibration with U, the drift, and the control chart below. Needs matplotlib."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig.history.series import Change, Subject, Trend
from rig.history.statistics.charts import SHEWHART_LIMIT
from rig.history.terminal.history_tables import title_of
from rig.report.exports.columns import plain_names
from rig.report.figures.verification import save
from rig.report.findings.characteristics import every_characteristic
from rig.report.findings.history_records import BIASES, SCALES
from rig.study.style import use_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Fractions of the figure's width and height. An automatic layout takes as long as the drawing itself.
MARGINS = {"left": 0.07, "right": 0.985, "bottom": 0.06, "top": 0.93, "wspace": 0.3, "hspace": 0.25}
PLOT_COLUMNS = 3


def draw_trends(subjects: Mapping[Subject, Mapping[str, Trend]], folder: Path) -> list[Path]:
    """Draw `history_<serial number>_<quantity>` as PNG and SVG for each subject into `folder`; return the paths."""
    from matplotlib.figure import Figure

    names = set[str]()
    written = list[Path]()
    for subject, trends in subjects.items():
        (name,) = plain_names([f"history_{subject[1]}_{subject[2]}{'_simulated' * subject[4]}"]).values()
        while name in names:  # the same sensor at another range
            name += "_"
        names.add(name)
        shown = [trends[name] for name in _drawn_names() if name in trends]
        if not shown:
            continue
        with use_style():
            down = 2 * math.ceil(len(shown) / PLOT_COLUMNS)
            figure = Figure(figsize=(4.6 * PLOT_COLUMNS, 2.6 * down))
            rows = figure.subplots(down, PLOT_COLUMNS, sharex=True, squeeze=False, gridspec_kw=MARGINS)
            for i, trend in enumerate(shown):
                row, column = 2 * (i // PLOT_COLUMNS), i % PLOT_COLUMNS
                _draw_values(rows[row, column], trend)
                _draw_chart(rows[row + 1, column], trend)
            figure.suptitle(f"{title_of(subject)}; bars are U, the band holds the line with 95 %")
            for axes in rows[-1]:
                axes.tick_params(axis="x", rotation=30)
            written += save(figure, folder, name)
    return written


def draw_changes(title: str, changes: Sequence[Change], folder: Path, name: str) -> list[Path]:
    """Draw the differences of two calibrations, each divided by its U, as PNG and SVG `name`; return the paths.

    The band of a parameter is the limit beyond which it has changed; a changed parameter is red.
    """
    from matplotlib.figure import Figure

    with use_style():
        figure = Figure(figsize=(7.0, 1.2 + 0.28 * len(changes)), layout="constrained")
        axes = figure.subplots()
        for i, change in enumerate(changes):
            ratio = math.copysign(change.normalised_error, change.now.value - change.before.value)
            axes.barh(i, 2 * change.limit, left=-change.limit, height=0.8, color="0.9")
            colour = "C3" if change.has_changed else "C0"
            axes.errorbar(ratio, i, xerr=1.0, fmt="o", ms=4, lw=1, capsize=2, color=colour)
        axes.axvline(0.0, color="0.5", lw=0.8)
        axes.use_sticky_edges = False  # a bar's end would be the end of the picture
        axes.set_yticks(range(len(changes)), [change.name for change in changes])
        axes.invert_yaxis()
        axes.set_xlabel("(now − before) / U of the difference; grey: what chance explains")
        axes.set_title(title)
        return save(figure, folder, name)


def _drawn_names() -> list[str]:
    """Return the parameters that are drawn, in their order."""
    drawn = (row.parameters for row in every_characteristic() if row.series is not None and row.series.drawn)
    return list(dict.fromkeys([*SCALES[1:], *BIASES, *(name for names in drawn for name in names)]))


def _draw_values(axes: "Axes", trend: Trend) -> None:
    times = np.array(trend.times)
    expanded = [parameter.expanded for parameter in trend.parameters]
    axes.errorbar(times, trend.values, yerr=expanded, fmt="o", ms=3, lw=0.8, capsize=2, color="C0")
    axes.set_title(f"{trend.name}   {trend.unit}", loc="left")
    if trend.line is not None:
        rows = np.stack([np.ones(trend.count), trend.days], axis=1)
        value, std = trend.line.predict(rows)
        reach = trend.line.coverage_factor * std
        axes.plot(times, value, color="C3", lw=1)
        axes.fill_between(times, value - reach, value + reach, color="C3", alpha=0.15, lw=0)


def _draw_chart(axes: "Axes", trend: Trend) -> None:
    axes.set_ylabel("σ from earlier results")
    if trend.chart is None:
        axes.text(0.5, 0.5, "too few calibrations", ha="center", transform=axes.transAxes)
        return
    chart, times = trend.chart, np.array(trend.times)
    axes.plot(times, chart.deviation, ".", ms=4, color="C0", label="single")
    axes.plot(times, chart.ewma, color="C1", lw=1.2, label="EWMA")
    for sign in (1, -1):
        axes.plot(times, sign * chart.limit, color="C1", lw=0.8, ls="--")
        axes.axhline(sign * SHEWHART_LIMIT, color="C0", lw=0.8, ls="--")
    alarms = chart.alarm
    if alarms.any():
        axes.plot(times[alarms], chart.deviation[alarms], "o", ms=8, mfc="none", color="C3", label="alarm")
    axes.legend(frameon=False, fontsize=7, ncols=3, loc="lower left")
