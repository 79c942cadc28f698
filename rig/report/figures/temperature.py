"""Scale and bias over temperature, with their uncertainty as a band."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.outcome import Outcome
from rig.data.entries.temperature import OverTemperatureEntry
from rig.data.installed_kinds import quantities
from rig.data.result_file import ResultDocument
from rig.report.figures.verification import Picture, write_pictures
from rig.station.events import RunEvent

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_temperature_figures(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """Draw `over_temperature_<sensor>` for each sensor with polynomials; return the event that names them."""
    return write_pictures(
        [
            Picture(
                f"over_temperature_{sensor}",
                f"{sensor}: change from {next(iter(entries.values())).reference_c:g} °C",
                (11.0, 4.2 * len(entries)),
                partial(_draw, entries=entries),
            )
            for sensor, entries in document.over_temperature.items()
        ],
        folder,
    )


def _draw(figure: "Figure", entries: Mapping[str, OverTemperatureEntry]) -> None:
    """Draw the changes of scale and bias over temperature with ± U, one row of panels for each quantity."""
    panels = figure.subplots(len(entries), 2, squeeze=False)
    for (scale_axes, bias_axes), (quantity, entry) in zip(panels, entries.items(), strict=True):
        unit = quantities()[quantity].drift
        temperatures_c = np.array([row.temperature_c for row in entry.table])
        scales = np.array([row.scale for row in entry.table]) / np.array(entry.scale[0]) - 1
        biases = np.array([row.bias for row in entry.table]) - np.array(entry.bias[0])
        widths = [np.array([getattr(row, name) for row in entry.table]) for name in ("expanded_scale", "expanded_bias")]
        for axes, values, width, size, label in (
            (scale_axes, scales, widths[0], 1e-6, "scale factor   ppm"),
            (bias_axes, biases, widths[1], unit.size, f"bias   {unit.name}"),
        ):
            for i, axis in enumerate("xyz"):
                axes.plot(temperatures_c, values[:, i] / size, color=f"C{i}", lw=1.0, label=axis)
                low, high = ((values[:, i] + sign * width[:, i]) / size for sign in (-1, 1))
                axes.fill_between(temperatures_c, low, high, color=f"C{i}", alpha=0.25, lw=0)
            axes.set(xlabel="°C", ylabel=label, title=f"{quantities()[quantity].sensor}; band: ± U")
        scale_axes.legend(frameon=False, ncols=3, fontsize=8)
