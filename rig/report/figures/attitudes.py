"""Plots of what attitudes calibrate: what the model leaves in each of them, and where gravity or the field pointed."""

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
from rig.report.findings.unexplained import of_attitudes
from rig.station.events import RunEvent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True)
class HeldStill:
    """A sensor in N attitudes, (N, 3) each: what the model leaves, is expected to leave (one deviation), the noise.

    `towards` (N, 3): where the reference pointed, in the sensor's nominal axes.
    """

    quantity: Quantity
    residuals: Array
    expected: Array
    noise: Array
    towards: Array


def write_attitude_figures(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """`accelerometer_<sensor>`, `magnetometer_<sensor>` of a run that has any, PNG and SVG; none without matplotlib."""
    return write_pictures(
        [
            Picture(
                f"{held.quantity.sensor}_{sensor}",
                f"{sensor}: {held.quantity.sensor} in {len(held.residuals)} attitudes",
                (10.0, 4.6),
                partial(draw, held=held),
            )
            for sensor, held in _held_still(outcome, document)
        ],
        folder,
    )


def draw(figure: "Figure", held: HeldStill) -> None:
    """Draw, left, reading less model by attitude, with what noise and the arm's error let expect; right, the sphere."""
    residuals, sphere = figure.subplots(1, 2, width_ratios=(3, 2))
    _draw_residuals(residuals, held)
    _draw_sphere(sphere, held)


def held_still(finding: Finding[Any], mounting: Array) -> HeldStill:
    """What the plots of a sensor are made of; `mounting` (3, 3) leads from the frame of its attitudes to its axes."""
    entry, quantity, left = finding.entry, finding.quantity, of_attitudes(finding)
    noise = np.array([getattr(dwell, quantity.named("mean_std")) for dwell in entry.dwells])
    reference = entry.reference_m_s2 if quantity == ACCELERATION else entry.field_base_t
    towards = np.array([np.array(dwell.attitude) @ reference for dwell in entry.dwells]) @ mounting.T
    return HeldStill(quantity, left.values, left.stds, noise, towards)


def _held_still(outcome: Outcome, document: ResultDocument) -> Iterator[tuple[str, HeldStill]]:
    for quantity, entries in ((ACCELERATION, document.accelerometers), (FIELD, document.magnetometers)):
        for name, entry in entries.items():
            if not isinstance(entry, ErrorEntry):
                yield name, held_still(Finding(name, quantity, entry), _mounting(outcome, name))


def _mounting(outcome: Outcome, sensor: str) -> Array:
    """From the flange to the sensor's nominal axes; attitudes of a file are those of the sensor."""
    if sensor in outcome.elsewhere:
        return np.eye(3)
    return np.array(outcome.recordings[0].run.sensors[sensor].mounting)


def _draw_residuals(axes: "Axes", held: HeldStill) -> None:
    unit, count = held.quantity.drift, np.arange(1, len(held.residuals) + 1)
    expected = 2 * held.expected.max(axis=1) / unit.size
    axes.fill_between(count, -expected, expected, color="0.9", label="expected, ± 2 σ", step="mid")
    for i, axis in enumerate("xyz"):
        left, noise = held.residuals[:, i] / unit.size, 2 * held.noise[:, i] / unit.size
        axes.errorbar(count + 0.15 * (i - 1), left, noise, fmt="o", ms=3, lw=0.8, label=axis)
    axes.locator_params("x", integer=True)
    axes.set_xlabel("attitude")
    axes.set_ylabel(f"reading − model   {unit.name}")
    axes.legend(frameon=False, ncols=4, fontsize=8)


def _draw_sphere(axes: "Axes", held: HeldStill) -> None:
    """The reference in the sensor's nominal axes, seen from above z (Lambert's equal-area map of both halves)."""
    towards = held.towards / np.linalg.norm(held.towards, axis=1, keepdims=True)
    for centre, side in ((-1.1, 1.0), (1.1, -1.0)):
        half = towards[np.sign(towards[:, 2] + 1e-12) == side]
        x, y = _lambert(half * (1.0, 1.0, side))
        circle = np.linspace(0, 2 * np.pi, 200)
        axes.plot(centre + np.cos(circle), np.sin(circle), color="0.6", lw=0.8)
        axes.plot(centre + x, y, "o", ms=4)
        axes.text(centre, -1.25, "z upwards" if side > 0 else "z downwards", ha="center")
    of = held.quantity.towards
    axes.set_title(f"where {of} was in the sensor's axes: x right, y up", fontsize=8)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _lambert(unit: Array) -> tuple[Array, Array]:
    """Lambert's projection of unit vectors (n, 3) in the half z ≥ 0, into the unit circle."""
    size = np.sqrt(1 / (1 + np.clip(unit[:, 2], 0, 1)))
    return unit[:, 0] * size, unit[:, 1] * size
