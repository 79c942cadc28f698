"""The result and the truth of a simulated laboratory, as tables for the terminal."""

from collections.abc import Iterator, Sequence

from rich.table import Table

from rig.report.simulated_truth import TrueValues, TruthRow
from rig.report.words.printed_values import format_signed, format_with_u
from rig.station.plain_text import build_number_table


def truth_tables(rows: Sequence[TruthRow], sensor: str | None = None) -> Iterator[Table]:
    """Yield a table for each row of the result whose true values are known, for all sensors or for one."""
    for row in rows:
        if sensor not in (None, row.row.sensor):
            continue
        columns = {f"{row.row.noun} {row.row.unit.name}": row.bias}
        if row.scale is not None:
            columns = {"scale factor": row.scale, **columns}
        headings = (heading for name in columns for heading in (name, "truth", "d"))
        title = f"{row.row.name} with its simulated truth, d = (result − truth)/U"
        table = build_number_table(("axis", *headings), title)
        cells = zip(*(cell for values in columns.values() for cell in _cells(values)), strict=True)
        for label, numbers in zip(row.row.labels, cells, strict=True):
            table.add_row(label, *numbers)
        yield table


def _cells(values: TrueValues) -> Iterator[list[str]]:
    """Yield three columns: the results, their true values to the same decimals, and the deviations."""
    numbers = values.result
    yield [format_with_u(value, u)[0] for value, u in zip(numbers.values, numbers.expanded, strict=True)]
    yield values.truth_texts
    yield [format_signed(deviation, 2) for deviation in values.deviations]
