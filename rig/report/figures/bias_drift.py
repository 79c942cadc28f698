"""The bias in each repeat of the attitudes, drawn as in the paper TRIAX, Figs. 4 and 6."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.outcome import Outcome
from rig.analysis.temperature.bias_drift import BiasDrift
from rig.data.quantity import Quantity
from rig.data.result_file import ResultDocument
from rig.report.entry import dof_or_none
from rig.report.figures.verification import Picture, write_pictures
from rig.report.words.expanded_uncertainty import expanded, factor_words
from rig.station.events import RunEvent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def write_drift_figures(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """Draw `bias_drift_<sensor>` for each sensor with biases by repeat; return the event that names them."""
    return write_pictures(
        [
            Picture(
                f"bias_drift_{sensor}",
                f"{sensor}: bias by repeat",
                (5.5 * len(drifts), 4.6),
                partial(_draw_all, drifts=drifts),
            )
            for sensor, drifts in outcome.drifts.items()
        ],
        folder,
    )


def _draw_all(figure: "Figure", drifts: Mapping[Quantity, BiasDrift]) -> None:
    panels = np.ravel(figure.subplots(1, len(drifts)))
    for axes, (quantity, drift) in zip(panels, drifts.items(), strict=True):
        draw_drift(axes, quantity, drift)


def draw_drift(axes: "Axes", quantity: Quantity, drift: BiasDrift) -> None:
    """Draw the bias in each repeat of the attitudes, with dotted lines at its abrupt changes.

    Dots are biases estimated with scale and axes fixed, crosses those estimated together with scale and axes.
    """
    size = quantity.drift.size
    repeat = np.arange(1, len(drift.scale_fixed.bias) + 1)
    free_solutions = [(index + 1, solution) for index, solution in drift.scale_free.results.items()]
    factors = expanded((1.0, 1.0, 1.0), dof_or_none(drift.dof)).factors
    for i, axis in enumerate("xyz"):
        bias, std = drift.scale_fixed.bias[:, i] / size, drift.scale_fixed.std[:, i] / size
        axes.errorbar(repeat, bias, factors[i] * std, fmt="o-", ms=3, lw=0.8, color=f"C{i}", label=axis)
        if free_solutions:
            biases, stds = (
                [getattr(solution, name)[i] / size for _, solution in free_solutions] for name in ("bias", "std")
            )
            axes.errorbar(
                [number + 0.15 for number, _ in free_solutions],
                biases,
                factors[i] * np.array(stds),
                fmt="x",
                ms=4,
                lw=0.6,
                alpha=0.6,
                color=f"C{i}",
            )
    for move in drift.scale_fixed.moves:
        axes.axvline(move.repeat + 0.5, color="0.5", ls=":", lw=0.8)
    axes.locator_params("x", integer=True)
    axes.set(
        xlabel="repeat",
        ylabel=f"bias   {quantity.drift.name}",
        title=f"{quantity.sensor}; ± U ({factor_words(dof_or_none(drift.dof))}), × all solved again",
    )
    axes.legend(frameon=False, ncols=3, fontsize=8)
