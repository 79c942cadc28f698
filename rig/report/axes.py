"""What tables and entries of all three kinds of sensors share: three numbers in a line, three axes in a table."""

from collections.abc import Iterable, Sequence

import numpy as np
from rich.table import Table

from rig.estimation.arrays import Array
from rig.observation.acceleration import DwellReading
from rig.observation.field import FieldReading
from rig.report.entry import EntryT, entry
from rig.station.plain_text import plain

PARAMETERS = ("kx", "ky", "kz", "bx", "by", "bz")


def triple(values: Iterable[float], form: str) -> str:
    """Three numbers, each formatted so, with spaces between."""
    return " ".join(f"{value:{form}}" for value in values)


def axes_table(
    title: str,
    scale: Sequence[float],
    bias: Sequence[float],
    expanded: Sequence[float],
    *,
    unit: str,
    digits: int,
    known: bool,
) -> Table:
    """Scale factor and bias of each axis, ± twice their standard uncertainties (6,); bias and its own in `unit`.

    `known` where all that is known is in these, and not the solution's spread alone.
    """
    table = Table(title=plain(title, "table.title"), title_justify="left")
    spread = "± U" if known else "± 2σ"
    for heading in ("axis", "scale factor", spread, f"bias {unit}", f"{spread} {unit}"):
        table.add_column(heading, justify="left" if heading == "axis" else "right")
    for i, axis in enumerate("xyz"):
        table.add_row(
            axis, f"{scale[i]:.6f}", f"{expanded[i]:.6f}", f"{bias[i]:+.{digits}f}", f"{expanded[3 + i]:.{digits}f}"
        )
    return table


def dwell_entry(kind: type[EntryT], unit: str, dwell: DwellReading | FieldReading, residual: Array) -> EntryT:
    """A dwell as an entry whose names end with the `unit` of its readings; `residual` (3,) is what the model leaves."""
    return entry(
        kind, dwell, dwell.reading,
        duration_s=dwell.window.end_s - dwell.window.start_s,
        **{
            f"mean_{unit}": dwell.reading.mean,
            f"mean_std_{unit}": np.sqrt(dwell.reading.variance),
            f"noise_{unit}": dwell.reading.noise,
            f"residual_{unit}": residual,
        },
    )  # fmt: skip
