"""The common parts of tables of all kinds of sensors: three numbers in a line, three axes in a table."""

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from rich.table import Table

from rig.data.quantity import Quantity
from rig.estimation.arrays import Array
from rig.estimation.sensor_axes import SensorAxes
from rig.report.findings.characteristic import Term
from rig.report.words.expanded_uncertainty import factor_words
from rig.station.plain_text import build_number_table

MIN_DECIMALS = 5


def triple(values: Iterable[float], form: str) -> str:
    """Return three formatted numbers, separated by spaces."""
    return " ".join(f"{value:{form}}" for value in values)


def scale_and_bias_table(
    title: str,
    quantity: Quantity,
    scale: Sequence[float],
    bias: Sequence[float],
    expanded: Sequence[float],
    *,
    heading: str,
) -> Table:
    """Return scale factor and bias (SI) of each axis with their expanded uncertainties under `heading`.

    The number of decimals follows from the smallest uncertainty.
    """
    unit, size, axes = quantity.bias.name, quantity.bias.size, len(scale)
    table = build_number_table(("axis", "scale factor", heading, f"bias {unit}", f"± U {unit}"), title)
    biases, widths = ([float(value) / size for value in values] for values in (bias, expanded[axes:]))
    scale_decimals, bias_decimals = decimals(expanded[:axes]), decimals(widths, quantity.decimals)
    for i, axis in enumerate(quantity.axes):
        table.add_row(
            axis,
            f"{scale[i]:.{scale_decimals}f}",
            f"{expanded[i]:.{scale_decimals}f}",
            f"{biases[i]:+.{bias_decimals}f}",
            f"{widths[i]:.{bias_decimals}f}",
        )
    return table


def decimals(uncertainties: Sequence[float], fewest: int = MIN_DECIMALS) -> int:
    """Return the number of decimals that shows two digits of the smallest uncertainty, at least `fewest`."""
    smallest = min(uncertainties)
    return max(fewest, 1 - math.floor(math.log10(smallest))) if smallest > 0 else fewest


def line_of(term: Term, lead: str, form: str, width: str = ".2g") -> str:
    """Return a line: `lead`, a characteristic's numbers in the format `form`, their largest U in the format `width`."""
    _, values, widths = zip(*term.printed, strict=True)
    unit, words = term.units.shown.name, factor_words(term.numbers.dof)
    return f"{lead}: {triple(values, form)} {unit} (± {max(widths):{width}}, {words})"


def matrix_lines(matrix: Array, covariance: Array, factor: float) -> Iterator[str]:
    """Yield the rows of the sensor's `matrix` F (3, 3), then the angles between its axes, each ± U.

    `covariance` (9, 9) is that of the matrix, row by row. `factor` is the largest coverage factor of the scale factors.
    """
    widths = factor * np.sqrt(np.diag(covariance)).reshape(3, 3)
    for axis, row, row_widths in zip("xyz", matrix.tolist(), widths.tolist(), strict=True):
        elements = (f"{element:+.6f} ± {width:.1e}" for element, width in zip(row, row_widths, strict=True))
        yield f"F {axis}: " + "  ".join(elements)
    axes = SensorAxes.from_matrix(matrix)
    stds = axes.non_orthogonality_std_rad(covariance)
    angles = zip(1e3 * axes.non_orthogonality_rad, 1e3 * factor * stds, strict=True)
    printed = "  ".join(f"{angle:+.3f} ± {width:.2g}" for angle, width in angles)
    yield f"non-orthogonality yz zx xy: {printed} mrad (U, k = {factor:.3g})"
