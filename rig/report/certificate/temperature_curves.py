"""Picture and table of a calibration over temperature in the certificate."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.entries.temperature import OverTemperatureEntry
from rig.data.quantity import DisplayUnit, Quantity
from rig.estimation.arrays import Array
from rig.report.certificate.svg_plots import LEFT_MARGIN, RIGHT_MARGIN, WIDTH, UprightAxis
from rig.report.tables.certificate import Pair, pair
from rig.report.words.temperature_words import shown_rows

FRACTION_UNITS = (DisplayUnit("%", 1e-2), DisplayUnit("ppm", 1e-6))


@dataclass(frozen=True, slots=True)
class Curves:
    """A picture of curves: `axes` has, for each sensor axis, the points of its band and of its line, as SVG text.

    `ticks` are labelled heights, `marks` labelled abscissas of temperatures, in pixels.
    """

    axes: tuple[tuple[str, str], ...]
    ticks: tuple[tuple[float, str], ...]
    marks: tuple[tuple[float, str], ...]
    unit: str


@dataclass(frozen=True, slots=True)
class TemperatureRow:
    """A row of the temperature table: the scale factors of the three axes, then the biases."""

    temperature: str
    values: tuple[Pair, ...]


def temperature_rows(entry: OverTemperatureEntry, unit: DisplayUnit) -> list[TemperatureRow]:
    """Return the rows of the entry's temperature table with U, and with biases in `unit`."""
    return [
        TemperatureRow(
            f"{row.temperature_c:.1f}",
            (
                *map(pair, row.scale, row.expanded_scale),
                *(pair(b / unit.size, u / unit.size) for b, u in zip(row.bias, row.expanded_bias, strict=True)),
            ),
        )
        for row in shown_rows(entry)
    ]


def scale_curves(entry: OverTemperatureEntry) -> Curves:
    """Return curves of the change of the scale factors relative to the reference temperature."""
    first = np.array(entry.scale[0])
    values = np.array([row.scale for row in entry.table]) / first - 1
    return _curves(entry, values, np.array([row.expanded_scale for row in entry.table]) / first, FRACTION_UNITS)


def bias_curves(entry: OverTemperatureEntry, quantity: Quantity) -> Curves:
    """Return curves of the change of the biases relative to the reference temperature."""
    values = np.array([row.bias for row in entry.table]) - np.array(entry.bias[0])
    return _curves(entry, values, np.array([row.expanded_bias for row in entry.table]), quantity.residuals)


def _curves(entry: OverTemperatureEntry, values: Array, widths: Array, units: Sequence[DisplayUnit]) -> Curves:
    """Return curves of values (n, 3) ± widths (n, 3) at the temperatures of the entry's table."""
    upright = UprightAxis.fit(float((np.abs(values) + widths).max()), units)
    low, high = entry.range_c

    def points(temperatures: Sequence[float], heights: Array) -> str:
        return " ".join(
            f"{_x_pixel(t, low, high)},{upright.height(y)}" for t, y in zip(temperatures, heights, strict=True)
        )

    warm_c = [row.temperature_c for row in entry.table]
    axes = tuple(
        (
            points(
                [*warm_c, *reversed(warm_c)],
                np.r_[values[:, i] + widths[:, i], (values[:, i] - widths[:, i])[::-1]],
            ),
            points(warm_c, values[:, i]),
        )
        for i in range(3)
    )
    marks = tuple((_x_pixel(row.temperature_c, low, high), f"{row.temperature_c:.1f} °C") for row in shown_rows(entry))
    return Curves(axes, upright.ticks, marks, upright.unit.name)


def _x_pixel(temperature_c: float, low: float, high: float) -> float:
    return round(LEFT_MARGIN + 12 + (WIDTH - LEFT_MARGIN - RIGHT_MARGIN - 30) * (temperature_c - low) / (high - low), 1)
