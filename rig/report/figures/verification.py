"""Plots of a verification, as in the paper SIX, Figs. 7–10: sensor and reference over time, before and after."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from rig.analysis.gyroscope.comparison import Comparison
from rig.analysis.gyroscope.verification import Verification
from rig.analysis.outcome import Outcome
from rig.config.files.safe_writing import new_file
from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.station.events import NotPlotted, Plotted, RunEvent
from rig.study.style import use_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PIXEL_COLUMNS = 600  # about as many as a panel has pixels across
# Fractions of the figure's width and height. An automatic layout takes as long as the drawing itself.
MARGINS = {"left": 0.06, "right": 0.985, "bottom": 0.065, "top": 0.915, "wspace": 0.16, "hspace": 0.14}


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure for a run folder: name of its file, heading, width and height in inches, and drawing function."""

    name: str
    title: str
    size: tuple[float, float]
    draw: Callable[["Figure"], None]
    layout: Literal["constrained"] | None = "constrained"


def write_pictures(pictures: Sequence[Picture], folder: Path) -> tuple[RunEvent, ...]:
    """Draw each picture as PNG and SVG into `folder`, and return the event of the pictures drawn.

    Without matplotlib draw nothing, and return the event that says so.
    """
    if not pictures:
        return ()
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        return (NotPlotted(),)
    from matplotlib.figure import Figure

    for picture in pictures:
        with use_style():
            figure = Figure(figsize=picture.size, layout=picture.layout)
            picture.draw(figure)
            figure.suptitle(picture.title)
            save(figure, folder, picture.name)
    return (Plotted(tuple(picture.name for picture in pictures)),)


def write_figures(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """Draw the verifications of a run into `folder`, and return the event that names the pictures."""
    return draw_verifications(outcome.verifications.values(), folder)


def draw_verifications(verifications: Iterable[Verification], folder: Path) -> tuple[RunEvent, ...]:
    """Draw each comparison with the reference, before (if recorded) and after calibration; return the pictures' event.

    The files are called `verification_<sensor>_before` and `verification_<sensor>_after`.
    """
    pictures = [
        Picture(
            f"verification_{verification.sensor}_{when}",
            f"{verification.sensor} {when} calibration, with {verification.reference.name}; RMS of sweeps and rests",
            (10.0, 7.5),
            partial(
                draw_comparison,
                comparison=comparison,
                sensor=verification.sensor,
                reference=verification.reference.name,
            ),
            None,
        )
        for verification in verifications
        for when, comparison in (("before", verification.before), ("after", verification.after))
        if comparison is not None
    ]
    return write_pictures(pictures, folder)


def save(figure: "Figure", folder: Path, name: str) -> list[Path]:
    """Save a figure as PNG and as SVG; return both paths."""
    paths = [folder / f"{name}.png", folder / f"{name}.svg"]
    with new_file(paths[0]) as png, new_file(paths[1]) as svg:
        figure.savefig(png, format="png", dpi=110)
        figure.savefig(svg, format="svg", dpi=110, metadata={"Date": None})
    return paths


def draw_comparison(figure: "Figure", comparison: Comparison, sensor: str, reference: str) -> None:
    """Draw x, y and z in rows: the readings on the left, their enlarged difference on the right."""
    rows = figure.subplots(3, 2, sharex=True, sharey="col", width_ratios=(3, 2), gridspec_kw=MARGINS)
    elapsed_s = comparison.time_s - comparison.time_s[0]
    error = comparison.reading_rad_s - comparison.reference_rad_s
    # Titles have a given height `y`: matplotlib would measure all labels for it, a sixth of the time of drawing.
    for i, (readings, difference) in enumerate(rows):
        readings.plot(*envelope(elapsed_s, comparison.reading_rad_s[:, i]), lw=0.7, color="C0", label=sensor)
        readings.plot(*envelope(elapsed_s, comparison.reference_rad_s[:, i]), lw=0.7, color="C1", label=reference)
        readings.set_ylabel(f"{'xyz'[i]}   rad/s")
        difference.plot(*envelope(elapsed_s, error[:, i]), lw=0.5, color="C3")
        difference.set_title(f"RMS {comparison.movement.rms_rad_s[i]:.4f} rad/s", loc="right", y=1.0, fontsize=9)
    reach = 1.05 * float(np.abs(error).max())
    rows[0, 1].set_ylim(-reach, reach)
    rows[0, 0].legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0, ncols=2, frameon=False)
    rows[0, 0].set_title("readings", loc="left", y=1.0, fontsize=9)
    rows[0, 1].set_title("reading − reference", loc="left", y=1.0, fontsize=9)
    for axes in rows[2]:
        axes.set_xlabel("time s")


def envelope(time_s: Array, values: Array) -> tuple[Array, Array]:
    """Return times and values of a long curve (n,) reduced to the lowest and highest value in each column of pixels."""
    if len(values) <= 2 * PIXEL_COLUMNS:
        return time_s, values
    starts = np.linspace(0, len(values), PIXEL_COLUMNS, endpoint=False).astype(np.intp)
    ends = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    return np.repeat(time_s[starts], 2), np.stack(ends, axis=1).ravel()
