"""An accelerometer's plots: what the model leaves in each attitude, and where gravity pointed in them."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.acceleration import AccelerometerResult
from rig.analysis.outcome import Outcome
from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.estimation.earth import MICRO_G_M_S2
from rig.estimation.residuals import dwell_residual_std_m_s2
from rig.report.figures import save
from rig.station.events import NotPlotted, Plotted, RunEvent
from rig.study.style import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def write_accelerometer_figures(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """Those of all accelerometers of a run, if it has any."""
    return (draw_accelerometers(outcome.accelerometers, folder),) if outcome.accelerometers else ()


def draw_accelerometers(found: Mapping[str, AccelerometerResult], folder: Path) -> Plotted | NotPlotted:
    """Draw `accelerometer_<sensor>`, as PNG and SVG, into `folder`; nothing where matplotlib is absent."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        return NotPlotted()
    from matplotlib.figure import Figure

    names = []
    for sensor, result in found.items():
        name = f"accelerometer_{sensor}"
        with style():
            figure = Figure(figsize=(10.0, 4.6), layout="constrained")
            draw_accelerometer(figure, result)
            figure.suptitle(f"{sensor}: accelerometer in {len(result.dwells)} attitudes")
            save(figure, folder, name)
        names.append(name)
    return Plotted(tuple(names))


def draw_accelerometer(figure: "Figure", result: AccelerometerResult) -> None:
    """Left: reading less model by attitude, with what noise and the arm's error let expect. Right: the sphere."""
    residuals, sphere = figure.subplots(1, 2, width_ratios=(3, 2))
    _draw_residuals(residuals, result)
    _draw_sphere(sphere, result)


def _draw_residuals(axes: "Axes", result: AccelerometerResult) -> None:
    count = np.arange(1, len(result.dwells) + 1)
    noise = np.sqrt([dwell.reading.variance for dwell in result.dwells])
    expected = 2 * dwell_residual_std_m_s2(result.solution, result.movement).max(axis=1) / MICRO_G_M_S2
    axes.fill_between(count, -expected, expected, color="0.9", label="expected, ± 2 σ", step="mid")
    for i, axis in enumerate("xyz"):
        left = result.solution.dwell_residuals_m_s2[:, i] / MICRO_G_M_S2
        axes.errorbar(count + 0.15 * (i - 1), left, 2 * noise[:, i] / MICRO_G_M_S2, fmt="o", ms=3, lw=0.8, label=axis)
    axes.locator_params("x", integer=True)
    axes.set_xlabel("attitude")
    axes.set_ylabel("reading − model   µg")
    axes.legend(frameon=False, ncols=4, fontsize=8)


def _draw_sphere(axes: "Axes", result: AccelerometerResult) -> None:
    """Where up was in the sensor's nominal axes, seen from above z (Lambert's equal-area map of both halves)."""
    up = np.array([dwell.attitude @ result.solution.reference_m_s2 for dwell in result.dwells])
    up = up @ np.array(result.sensor.mounting).T / np.linalg.norm(up, axis=1, keepdims=True)
    for centre, side in ((-1.1, 1.0), (1.1, -1.0)):
        half = up[np.sign(up[:, 2] + 1e-12) == side]
        x, y = _lambert(half * (1.0, 1.0, side))
        circle = np.linspace(0, 2 * np.pi, 200)
        axes.plot(centre + np.cos(circle), np.sin(circle), color="0.6", lw=0.8)
        axes.plot(centre + x, y, "o", ms=4)
        axes.text(centre, -1.25, "z upwards" if side > 0 else "z downwards", ha="center")
    axes.set_title("where up was in the sensor's axes, x to the right, y up the page", fontsize=8)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _lambert(unit: Array) -> tuple[Array, Array]:
    """Of unit vectors (n, 3) in the half z ≥ 0, into the unit circle."""
    size = np.sqrt(1 / (1 + np.clip(unit[:, 2], 0, 1)))
    return unit[:, 0] * size, unit[:, 1] * size
