"""The uncertainty budget of one scale factor and one bias in print, with lines that add up to U.

Terminal and certificate print the same budget; `result.json` has the budgets of all six values.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.entries.budget import INCLUDED_IN_U, BudgetEntry, ContributorEntry
from rig.data.quantity import DisplayUnit
from rig.estimation.arrays import MIN_SIZE, divide_or_infinity
from rig.report.words.printed_values import figures, percent, power_of_ten, small

MIN_FRACTION = 0.001  # contributors below it in both variances share one line
STD_DIGITS = 3  # of a combined standard uncertainty: its parts are printed to the same decimal


@dataclass(frozen=True, slots=True)
class BudgetColumn:
    """The printed uncertainty of one value in `unit`; the value is at position `index` of (kx, ky, kz, bx, by, bz)."""

    index: int
    unit: str
    combined: str
    dof: str
    factor: str
    expanded: str

    @property
    def axis(self) -> str:
        """The axis: x, y or z."""
        return "xyz"[self.index % 3]


@dataclass(frozen=True, slots=True)
class Line:
    """One contributor. `parts` has, for each column, its standard uncertainty and its fraction of the variance."""

    name: str
    kind: str
    distribution: str
    assumed: str
    dof: str
    parts: tuple[tuple[str, str], tuple[str, str]]


@dataclass(frozen=True, slots=True)
class PrintedBudget:
    """The budgets of the scale factor with the largest relative U and of the bias with the largest U."""

    columns: tuple[BudgetColumn, BudgetColumn]
    lines: tuple[Line, ...]


def lay_out_budget(budget: BudgetEntry, scale: Sequence[float], bias: DisplayUnit) -> PrintedBudget:
    """Return the printed budget: largest contributions first, negligible ones in one line, biases in unit `bias`.

    `scale` are the sensor's scale factors, to which the printed scale factor's U is relative.
    """
    indices = find_printed_indices(budget, scale)
    sizes = [
        _Size.choose(budget.std[indices[0]], 1.0, ""),
        _Size.choose(budget.std[indices[1]], 1 / bias.size, bias.name),
    ]
    lines = sorted(budget.contributors, key=lambda line: -max(line.variance_fraction[index] for index in indices))
    significant = [line for line in lines if max(line.variance_fraction[index] for index in indices) >= MIN_FRACTION]
    printed = [_line(line, indices, sizes) for line in significant]
    if len(significant) < len(lines):
        small_ones = [line for line in lines if line not in significant]
        std = np.sqrt(np.sum(np.square([line.std for line in small_ones]), axis=0)).tolist()
        names = f"below 0.1 %: {', '.join(line.name for line in small_ones)}"
        fractions = divide_or_infinity(std, budget.std) ** 2
        printed.append(Line(names, "", "", "", "", _parts(std, fractions.tolist(), indices, sizes)))
    first, second = (_column(budget, index, size) for index, size in zip(indices, sizes, strict=True))
    return PrintedBudget((first, second), tuple(printed))


def find_printed_indices(budget: BudgetEntry, scale: Sequence[float]) -> tuple[int, int]:
    """Return the positions of the printed scale factor and bias in (kx, ky, kz, bx, by, bz)."""
    return int(np.argmax(np.divide(budget.expanded[:3], scale))), 3 + int(np.argmax(budget.expanded[3:]))


@dataclass(frozen=True, slots=True)
class _Size:
    """The form of a column's standard uncertainties, which are printed in `unit`, times `factor`, with `decimals`."""

    unit: str
    factor: float
    decimals: int

    @classmethod
    def choose(cls, std: float, per_unit: float, unit: str) -> "_Size":
        if not std > MIN_SIZE:
            return cls(unit or "1", per_unit, 0)
        power = 3 * math.floor(math.log10(std * per_unit) / 3)
        factor = per_unit * 10.0**-power
        decimals = max(STD_DIGITS - 1 - math.floor(math.log10(std * factor)), 0)
        name = " ".join(filter(None, (power_of_ten(power) if power else "", unit)))
        return cls(name or "1", factor, decimals)

    def text(self, std: float) -> str:
        return f"{std * self.factor:.{self.decimals}f}"


def _column(budget: BudgetEntry, index: int, size: _Size) -> BudgetColumn:
    return BudgetColumn(
        index,
        size.unit,
        size.text(budget.std[index]),
        dof_text(budget.effective_dof[index]),
        f"{budget.coverage_factors[index]:.2f}",
        size.text(budget.expanded[index]),
    )


def _line(line: ContributorEntry, indices: tuple[int, int], sizes: Sequence[_Size]) -> Line:
    stated = " (k = 2)" if line.distribution == "normal" else ""
    source = "evaluated" if line.kind == "A" else "–"
    assumed = source if line.half_width is None else f"±{figures(line.half_width)} {line.unit}{stated}"
    dof = _explain_missing_dof(line) if line.degrees_of_freedom is None else dof_text(line.degrees_of_freedom)
    return Line(
        line.name, line.kind, line.distribution, assumed, dof, _parts(line.std, line.variance_fraction, indices, sizes)
    )


def _explain_missing_dof(line: ContributorEntry) -> str:
    """Return the words for degrees of freedom that have no number: infinite, included in u, or unknown."""
    if line.kind == "B":
        return "∞"
    return "in\u00a0u" if line.source.endswith(INCLUDED_IN_U) else "–"


def _parts(
    std: Sequence[float], fractions: Sequence[float], indices: tuple[int, int], sizes: Sequence[_Size]
) -> tuple[tuple[str, str], tuple[str, str]]:
    first, second = (
        (size.text(std[index]), percent(fractions[index])) for index, size in zip(indices, sizes, strict=True)
    )
    return first, second


def dof_text(dof: float) -> str:
    """Return degrees of freedom as text, rounded down to an integer; large numbers have two digits."""
    if not math.isfinite(dof):
        return "∞"
    return f"{math.floor(dof)}" if dof < 1e4 else small(dof)
