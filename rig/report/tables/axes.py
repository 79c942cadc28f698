"""What tables of all three kinds of sensors share: three numbers in a line, three axes in a table."""

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from rich.table import Table

from rig.data.quantity import Quantity
from rig.estimation.arrays import Array
from rig.estimation.sensor_axes import SensorAxes
from rig.report.findings.characteristic import Term
from rig.report.words.expanded import factor_words
from rig.station.plain_text import plain

FEWEST_DECIMALS = 5


def triple(values: Iterable[float], form: str) -> str:
    """Three numbers, each formatted so, with spaces between."""
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
    """Scale factor and bias (SI) of each axis, ± their expanded uncertainties, which are headed so.

    With as many decimals as the smallest uncertainty warrants.
    """
    unit, size, axes = quantity.bias.name, quantity.bias.size, len(scale)
    table = Table(title=plain(title, "table.title"), title_justify="left")
    for each in ("axis", "scale factor", heading, f"bias {unit}", f"± U {unit}"):
        table.add_column(each, justify="left" if each == "axis" else "right")
    biases, widths = ([float(each) / size for each in values] for values in (bias, expanded[axes:]))
    of_scale, of_bias = decimals(expanded[:axes]), decimals(widths, quantity.decimals)
    for i, axis in enumerate(quantity.axes):
        table.add_row(
            axis,
            f"{scale[i]:.{of_scale}f}",
            f"{expanded[i]:.{of_scale}f}",
            f"{biases[i]:+.{of_bias}f}",
            f"{widths[i]:.{of_bias}f}",
        )
    return table


def decimals(uncertainties: Sequence[float], fewest: int = FEWEST_DECIMALS) -> int:
    """How many the smallest of them warrants, which is printed with two digits; so many at least."""
    smallest = min(uncertainties)
    return max(fewest, 1 - math.floor(math.log10(smallest))) if smallest > 0 else fewest


def line_of(term: Term, lead: str, form: str, width: str = ".2g") -> str:
    """A characteristic's numbers in a line behind what it is called there, with the largest U."""
    _, values, widths = zip(*term.printed, strict=True)
    unit, words = term.units.shown.name, factor_words(term.known.freedom)
    return f"{lead}: {triple(values, form)} {unit} (± {max(widths):{width}}, {words})"


def matrix_lines(matrix: Array, covariance: Array, factor: float) -> Iterator[str]:
    """F row by row and the angles between its axes, ± U; `covariance` (9, 9) is that of F, row by row.

    The coverage `factor` is that of the scale factors, the largest of them.
    """
    spread = factor * np.sqrt(np.diag(covariance)).reshape(3, 3)
    for axis, row, known in zip("xyz", matrix.tolist(), spread.tolist(), strict=True):
        elements = (f"{element:+.6f} ± {each:.1e}" for element, each in zip(row, known, strict=True))
        yield f"F {axis}: " + "  ".join(elements)
    axes = SensorAxes.of(matrix)
    stds = axes.non_orthogonality_std_rad(covariance)
    angles = zip(1e3 * axes.non_orthogonality_rad, 1e3 * factor * stds, strict=True)
    told = "  ".join(f"{angle:+.3f} ± {known:.2g}" for angle, known in angles)
    yield f"non-orthogonality yz zx xy: {told} mrad (U, k = {factor:.3g})"
