"""The uncertainty budget as a person reads it in the terminal."""

from collections.abc import Iterator, Sequence

from rich.table import Table

from rig.data.entries.budget import BudgetEntry
from rig.data.quantity import Unit
from rig.estimation.gyroscope.budget import NOT_GIVEN
from rig.estimation.statistics.coverage import COVERAGE_FACTOR
from rig.report.words.printed_budget import Line, printed_budget
from rig.station.plain_text import plain


def expanded_heading(budget: BudgetEntry | None) -> str:
    """The heading of a column of U by a budget; without one U is two standard deviations."""
    return heading_of((COVERAGE_FACTOR,) if budget is None else budget.coverage_factors)


def heading_of(factors: Sequence[float]) -> str:
    """The heading of a column of U: with its coverage factor, or with the largest where they differ as printed."""
    printed = sorted({round(each, 2) for each in factors})
    return f"± U (k {'=' if len(printed) == 1 else '≤'} {printed[-1]:g})"


def assumed_lines(budget: BudgetEntry) -> Iterator[str]:
    """What was assumed because the configuration does not say it."""
    for line in budget.contributors:
        if line.half_width is not None and line.source.endswith(NOT_GIVEN):
            yield f"{line.name}: ± {line.half_width:.3g} {line.unit} is assumed, for {line.source}"


def budget_table(budget: BudgetEntry, scale: Sequence[float], bias: Unit) -> Table:
    """The budget of one scale factor and of one bias, in that unit, as the certificate has it: lines add up squared."""
    found = printed_budget(budget, scale, bias)
    k, b = found.columns
    title = f"uncertainty budget of the scale factor of {k.axis} and of the bias of {b.axis}, whose U are the largest"
    small = "; ".join(line.name for line in found.lines if not line.kind)
    table = Table(title=title, title_justify="left", caption=small or None, caption_justify="left")
    headings = ("contributor", "type", "ν", f"u(k{k.axis}) {k.unit}", "share", f"u(b{b.axis}) {b.unit}", "share")
    for heading in headings:
        table.add_column(heading, justify="left" if heading in ("contributor", "type") else "right")
    for line in found.lines:
        cells = (cell for part in line.parts for cell in part)
        table.add_row(plain(_named(line)), line.kind, line.freedom, *cells, end_section=line is found.lines[-1])
    table.add_row("combined u", "", "", k.combined, f"ν {k.freedom}", b.combined, f"ν {b.freedom}")
    table.add_row("expanded U", "", "", k.expanded, f"× {k.factor}", b.expanded, f"× {b.factor}")
    return table


def _named(line: Line) -> str:
    """The line's name with what it was assumed to be; all that are negligible stand below the table."""
    if not line.kind:
        return line.name.partition(":")[0]
    assumed = " ".join(line.assumed.split())  # a terminal shows blanks that do not break by their number
    return f"{line.name} {assumed}" if assumed.startswith("±") else line.name
