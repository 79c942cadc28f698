"""The uncertainty budget as a person reads it in the terminal."""

from collections.abc import Iterator, Sequence

from rich.table import Table

from rig.data.budget_entries import BudgetEntry
from rig.estimation.budget import NOT_GIVEN
from rig.estimation.coverage import COVERAGE_FACTOR
from rig.station.plain_text import plain

NEGLIGIBLE = 0.001  # of every variance: such lines are in result.json alone


def expanded_heading(budget: BudgetEntry | None) -> str:
    """Of a column of U: with its coverage factor, or with the largest where they differ as they are printed."""
    factors = _printed((COVERAGE_FACTOR,) if budget is None else budget.factors)
    return f"± U (k {'=' if len(factors) == 1 else '≤'} {factors[-1]:g})"


def _times(factors: Sequence[float]) -> str:
    printed = _printed(factors)
    return f"{printed[0]:g} ×" if len(printed) == 1 else f"{printed[0]:.2f} to {printed[-1]:.2f} ×"


def _printed(factors: Sequence[float]) -> list[float]:
    """The different ones, rounded, the smallest first."""
    return sorted({round(each, 2) for each in factors})


def assumed_lines(budget: BudgetEntry | None) -> Iterator[str]:
    """What was assumed because the configuration does not say it."""
    for line in () if budget is None else budget.contributors:
        if line.half_width is not None and line.source.endswith(NOT_GIVEN):
            yield f"{line.name}: ± {line.half_width:.3g} {line.unit} is assumed, for {line.source}"


def budget_table(budget: BudgetEntry, unit: str = "rad/s", per_unit: float = 1.0) -> Table:
    """What matters of the budget: the standard uncertainty of the axis it matters most to, and its share there.

    That of the biases times `per_unit`, in `unit`.
    """
    coverage = f"U = {_times(budget.factors)} the combined standard uncertainty, about 95 %"
    table = Table(title="uncertainty budget", title_justify="left", caption=coverage, caption_justify="left")
    for heading in ("contributor", "type", "scale u", "share", f"bias u {unit}", "share"):
        table.add_column(heading, justify="left" if heading in ("contributor", "type") else "right")
    for line in sorted(budget.contributors, key=lambda each: -max(each.share)):
        if max(line.share) < NEGLIGIBLE:
            continue
        assumed = "" if line.half_width is None else f" ±{line.half_width:.3g} {line.unit}"
        table.add_row(
            plain(line.name + assumed),
            line.kind,
            f"{max(line.std[:3]):.1e}",
            f"{100 * max(line.share[:3]):.0f} %",
            f"{per_unit * max(line.std[3:]):.1e}",
            f"{100 * max(line.share[3:]):.0f} %",
        )
    return table
