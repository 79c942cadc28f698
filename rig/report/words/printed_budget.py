"""The uncertainty budget as it is printed: for one axis, its lines adding up to the U that stands beside the value.

The same at the terminal and on the certificate; all six budgets are in `result.json`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.entries.budget import IN_U, BudgetEntry, ContributorEntry
from rig.data.quantity import Unit
from rig.estimation.arrays import SMALLEST_SIZE, divide_or_infinity
from rig.report.words.rounding import figures, percent, power_of_ten, small

NEGLIGIBLE = 0.001  # of both variances: lines below are summed up in one
DIGITS = 3  # of a combined standard uncertainty: its parts are printed to the same decimal


@dataclass(frozen=True, slots=True)
class Column:
    """What makes up one value's uncertainty: its `place` among kx ky kz bx by bz, and the `unit` of all numbers."""

    place: int
    unit: str
    combined: str
    freedom: str
    factor: str
    expanded: str

    @property
    def axis(self) -> str:
        """The axis that the column is of."""
        return "xyz"[self.place % 3]


@dataclass(frozen=True, slots=True)
class Line:
    """One contributor; of each column the standard uncertainty it makes, and its share of the variance."""

    name: str
    kind: str
    distribution: str
    assumed: str
    freedom: str
    parts: tuple[tuple[str, str], tuple[str, str]]


@dataclass(frozen=True, slots=True)
class PrintedBudget:
    """One scale factor's budget and one bias': of the axes with the largest U, scale factors' relative to them."""

    columns: tuple[Column, Column]
    lines: tuple[Line, ...]


def printed_budget(budget: BudgetEntry, scale: Sequence[float], bias: Unit) -> PrintedBudget:
    """The budget with the largest shares first, all negligible lines in one, and what makes up a bias in that unit."""
    places = shown_places(budget, scale)
    sizes = [_Size.of(budget.std[places[0]], 1.0, ""), _Size.of(budget.std[places[1]], 1 / bias.size, bias.name)]
    lines = sorted(budget.contributors, key=lambda line: -max(line.variance_fraction[place] for place in places))
    kept = [line for line in lines if max(line.variance_fraction[place] for place in places) >= NEGLIGIBLE]
    printed = [_line(line, places, sizes) for line in kept]
    if len(kept) < len(lines):
        small_ones = [line for line in lines if line not in kept]
        std = np.sqrt(np.sum(np.square([line.std for line in small_ones]), axis=0)).tolist()
        names = f"below 0.1 %: {', '.join(line.name for line in small_ones)}"
        share = divide_or_infinity(std, budget.std) ** 2
        printed.append(Line(names, "", "", "", "", _parts(std, share.tolist(), places, sizes)))
    first, second = (_column(budget, place, size) for place, size in zip(places, sizes, strict=True))
    return PrintedBudget((first, second), tuple(printed))


def shown_places(budget: BudgetEntry, scale: Sequence[float]) -> tuple[int, int]:
    """Places of the scale factor and the bias that the budget is printed for, among kx ky kz bx by bz."""
    return int(np.argmax(np.divide(budget.expanded[:3], scale))), 3 + int(np.argmax(budget.expanded[3:]))


@dataclass(frozen=True, slots=True)
class _Size:
    """The unit of a column's numbers, so printed that they can be added up: times `factor`, with so many decimals."""

    unit: str
    factor: float
    decimals: int

    @classmethod
    def of(cls, std: float, per_unit: float, unit: str) -> "_Size":
        if not std > SMALLEST_SIZE:
            return cls(unit or "1", per_unit, 0)
        power = 3 * math.floor(math.log10(std * per_unit) / 3)
        factor = per_unit * 10.0**-power
        decimals = max(DIGITS - 1 - math.floor(math.log10(std * factor)), 0)
        said = " ".join(filter(None, (power_of_ten(power) if power else "", unit)))
        return cls(said or "1", factor, decimals)

    def text(self, std: float) -> str:
        return f"{std * self.factor:.{self.decimals}f}"


def _column(budget: BudgetEntry, place: int, size: _Size) -> Column:
    return Column(
        place,
        size.unit,
        size.text(budget.std[place]),
        freedom_text(budget.effective_dof[place]),
        f"{budget.coverage_factors[place]:.2f}",
        size.text(budget.expanded[place]),
    )


def _line(line: ContributorEntry, places: tuple[int, int], sizes: Sequence[_Size]) -> Line:
    stated = " (k = 2)" if line.distribution == "normal" else ""
    found = "found" if line.kind == "A" else "–"
    assumed = found if line.half_width is None else f"±{figures(line.half_width)} {line.unit}{stated}"
    freedom = _uncounted(line) if line.degrees_of_freedom is None else freedom_text(line.degrees_of_freedom)
    return Line(
        line.name,
        line.kind,
        line.distribution,
        assumed,
        freedom,
        _parts(line.std, line.variance_fraction, places, sizes),
    )


def _uncounted(line: ContributorEntry) -> str:
    """Why there is no number: it is known, it is in u already, or nobody counted it."""
    if line.kind == "B":
        return "∞"
    return "in u" if line.source.endswith(IN_U) else "–"


def _parts(
    std: Sequence[float], share: Sequence[float], places: tuple[int, int], sizes: Sequence[_Size]
) -> tuple[tuple[str, str], tuple[str, str]]:
    first, second = ((size.text(std[place]), percent(share[place])) for place, size in zip(places, sizes, strict=True))
    return first, second


def freedom_text(freedom: float) -> str:
    """Degrees of freedom, the next lower whole number; of many two digits."""
    if not math.isfinite(freedom):
        return "∞"
    return f"{math.floor(freedom)}" if freedom < 1e4 else small(freedom)
