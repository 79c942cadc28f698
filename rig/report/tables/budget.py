"""The uncertainty budget at the terminal."""

from collections.abc import Iterator, Sequence

from rich.table import Table

from rig.data.entries.budget import BudgetEntry
from rig.data.quantity import DisplayUnit
from rig.estimation.statistics.coverage import COVERAGE_FACTOR
from rig.report.words.printed_budget import Line, lay_out_budget
from rig.station.plain_text import build_number_table, plain


def heading_for(budget: BudgetEntry | None) -> str:
    """Return the heading of a column of U, with the budget's largest coverage factor, or 2 without a budget."""
    return heading_of((COVERAGE_FACTOR,) if budget is None else budget.coverage_factors)


def heading_of(factors: Sequence[float]) -> str:
    """Return the heading of a column of U, which states the largest of the coverage `factors`."""
    printed = sorted({round(factor, 2) for factor in factors})
    return f"± U (k {'=' if len(printed) == 1 else '≤'} {printed[-1]:g})"


def list_assumptions(budget: BudgetEntry) -> Iterator[str]:
    """Yield the assumptions for values that the configuration does not give."""
    from rig.estimation.gyroscope.budget import NOT_GIVEN_SUFFIX

    for line in budget.contributors:
        if line.half_width is not None and line.source.endswith(NOT_GIVEN_SUFFIX):
            yield f"{line.name}: ± {line.half_width:.3g} {line.unit} is assumed: {line.source}"


def budget_table(budget: BudgetEntry, scale: Sequence[float], bias: DisplayUnit) -> Table:
    """Return the budget of one scale factor and one bias, in unit `bias`, as on the certificate."""
    printed = lay_out_budget(budget, scale, bias)
    k, b = printed.columns
    title = f"uncertainty budget of the scale factor of {k.axis} and of the bias of {b.axis}, which have the largest U"
    small = "; ".join(line.name for line in printed.lines if not line.kind)
    headings = ("contributor", "type", "ν", f"u(k{k.axis}) {k.unit}", "share", f"u(b{b.axis}) {b.unit}", "share")
    table = build_number_table(headings, title, texts=headings[:2], caption=small or None, caption_justify="left")
    for line in printed.lines:
        cells = (cell for part in line.parts for cell in part)
        table.add_row(plain(_label(line)), line.kind, line.dof, *cells, end_section=line is printed.lines[-1])
    table.add_row("combined u", "", "", k.combined, f"ν\u00a0{k.dof}", b.combined, f"ν\u00a0{b.dof}")
    table.add_row("expanded U", "", "", k.expanded, f"× {k.factor}", b.expanded, f"× {b.factor}")
    return table


def _label(line: Line) -> str:
    """Return a contributor's name, with its half-width if assumed."""
    if not line.kind:
        return line.name.partition(":")[0]
    assumed = " ".join(line.assumed.split())  # a terminal shows no-break spaces as codes
    return f"{line.name} {assumed}" if assumed.startswith("±") else line.name
