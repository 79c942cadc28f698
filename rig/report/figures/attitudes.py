"""Plots of calibrations by attitudes: the residuals of each attitude, and the directions of gravity or the field."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.outcome import Outcome
from rig.data.entries.result_types import ErrorEntry
from rig.data.quantity import ACCELERATION, FIELD, Quantity
from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.report.figures.verification import Picture, write_pictures
from rig.report.findings.finding import Finding
from rig.report.findings.unexplained import find_attitude_residuals
from rig.station.events import RunEvent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True)
class AttitudePlot:
    """The data of a sensor's plots: `residuals` (N, 3) of the mean readings in N attitudes.

    `expected` (N, 3) are the standard deviations of the residuals due to all known errors, `noise` (N, 3) those of the
    mean readings due to noise. `towards` (N, 3) is the reference (gravity or field) in the sensor's nominal axes.
    """

    quantity: Quantity
    residuals: Array
    expected: Array
    noise: Array
    towards: Array


def write_attitude_figures(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """Draw `accelerometer_<sensor>` and `magnetometer_<sensor>`; return the event that names them."""
    return write_pictures(
        [
            Picture(
                f"{sensor_plot.quantity.sensor}_{sensor}",
                f"{sensor}: {sensor_plot.quantity.sensor} in {len(sensor_plot.residuals)} attitudes",
                (10.0, 4.6),
                partial(draw, sensor_plot=sensor_plot),
            )
            for sensor, sensor_plot in _plots(outcome, document)
        ],
        folder,
    )


def draw(figure: "Figure", sensor_plot: AttitudePlot) -> None:
    """Draw the residuals by attitude with their expected range on the left, the reference on a sphere on the right."""
    residuals, sphere = figure.subplots(1, 2, width_ratios=(3, 2))
    _draw_residuals(residuals, sensor_plot)
    _draw_sphere(sphere, sensor_plot)


def plot_of(finding: Finding[Any], mounting: Array) -> AttitudePlot:
    """Return the data of a sensor's plots; `mounting` (3, 3) takes the attitudes' frame to the sensor's axes."""
    entry, quantity, unexplained = finding.entry, finding.quantity, find_attitude_residuals(finding)
    noise = np.array([getattr(dwell, quantity.file_key("mean_std")) for dwell in entry.dwells])
    reference = entry.reference_m_s2 if quantity == ACCELERATION else entry.field_base_t
    towards = np.array([np.array(dwell.attitude) @ reference for dwell in entry.dwells]) @ mounting.T
    return AttitudePlot(quantity, unexplained.values, unexplained.stds, noise, towards)


def _plots(outcome: Outcome, document: ResultDocument) -> Iterator[tuple[str, AttitudePlot]]:
    for quantity, entries in ((ACCELERATION, document.accelerometers), (FIELD, document.magnetometers)):
        for name, entry in entries.items():
            if not isinstance(entry, ErrorEntry):
                yield name, plot_of(Finding(name, quantity, entry), _mounting(outcome, name))


def _mounting(outcome: Outcome, sensor: str) -> Array:
    """Return the rotation (3, 3) from flange to the sensor's nominal axes, or the identity for a file's attitudes."""
    if sensor in outcome.external:
        return np.eye(3)
    return np.array(outcome.recordings[0].run.sensors[sensor].mounting)


def _draw_residuals(axes: "Axes", sensor_plot: AttitudePlot) -> None:
    """Draw the residuals of each attitude with noise bars and their expected range."""
    unit, count = sensor_plot.quantity.drift, np.arange(1, len(sensor_plot.residuals) + 1)
    expected = 2 * sensor_plot.expected.max(axis=1) / unit.size
    axes.fill_between(count, -expected, expected, color="0.9", label="expected, ± 2 σ", step="mid")
    for i, axis in enumerate("xyz"):
        residuals, noise = sensor_plot.residuals[:, i] / unit.size, 2 * sensor_plot.noise[:, i] / unit.size
        axes.errorbar(count + 0.15 * (i - 1), residuals, noise, fmt="o", ms=3, lw=0.8, label=axis)
    axes.locator_params("x", integer=True)
    axes.set_xlabel("attitude")
    axes.set_ylabel(f"reading − model   {unit.name}")
    axes.legend(frameon=False, ncols=4, fontsize=8)


def _draw_sphere(axes: "Axes", sensor_plot: AttitudePlot) -> None:
    """Draw the reference in the sensor's nominal axes, seen from +z (Lambert's equal-area map of both halves)."""
    towards = sensor_plot.towards / np.linalg.norm(sensor_plot.towards, axis=1, keepdims=True)
    for centre, side in ((-1.1, 1.0), (1.1, -1.0)):
        half = towards[np.sign(towards[:, 2] + 1e-12) == side]
        x, y = _lambert(half * (1.0, 1.0, side))
        circle = np.linspace(0, 2 * np.pi, 200)
        axes.plot(centre + np.cos(circle), np.sin(circle), color="0.6", lw=0.8)
        axes.plot(centre + x, y, "o", ms=4)
        axes.text(centre, -1.25, "z upwards" if side > 0 else "z downwards", ha="center")
    reference = sensor_plot.quantity.towards
    axes.set_title(f"{reference} in the sensor's axes: x right, y up", fontsize=8)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _lambert(unit: Array) -> tuple[Array, Array]:
    """Return x and y (n,) of Lambert's projection of unit vectors (n, 3) with z ≥ 0 into the unit circle."""
    size = np.sqrt(1 / (1 + np.clip(unit[:, 2], 0, 1)))
    return unit[:, 0] * size, unit[:, 1] * size
