"""The coverage statements of a certificate: the factors k beside the values, and the sentence of EA-4/02 below."""

import math
from collections.abc import Sequence

from rig.data.entries.budget import BudgetEntry
from rig.estimation.statistics.coverage import PROBABILITY, find_ellipsoid_factor
from rig.report.tables.certificate import AXES
from rig.report.words.printed_budget import dof_text

QUANTITIES = ("scale factors", "biases")


def factor_note(budget: BudgetEntry) -> str:
    """Return the note on U: the coverage factor k, if it is the same for all values, or else that k is stated below."""
    printed = {f"{factor:.2f}" for factor in budget.coverage_factors}
    return f"k\u00a0=\u00a0{_short(printed.pop())}" if len(printed) == 1 else "k as stated below"


def joint_factor(budget: BudgetEntry) -> float:
    """Return the factor of the ellipsoid that contains all six values at once with a probability of 95 %."""
    return find_ellipsoid_factor(len(budget.std), budget.effective_dof)


def coverage_sentence(budget: BudgetEntry) -> str:
    """Return the statement on k that EA-4/02 M:2022 requires: in 6.4, or, for few degrees of freedom, in annex E."""
    begins = (
        "The reported expanded uncertainty of measurement is the standard uncertainty of measurement multiplied by the "
        "coverage factor k"
    )
    factors = [f"{factor:.2f}" for factor in budget.coverage_factors]
    covers = min(budget.coverage_probabilities)
    if len(set(factors)) > 1:
        groups = [_group(budget, factors, 3 * i, name) for i, name in enumerate(QUANTITIES)]
        return (
            f"{begins}, which for a t-distribution with ν_eff effective degrees of freedom corresponds to a coverage "
            f"probability of approximately {_percent(covers)}: {'; '.join(groups)}."
        )
    k, fewest = _short(factors[0]), min(budget.effective_dof)
    if k == "2" and round(100 * covers) == round(100 * PROBABILITY):
        return (
            f"{begins}\u00a0=\u00a0{k}, which for a normal distribution corresponds to a coverage probability of "
            f"approximately {_percent(covers)}."
        )
    return (
        f"{begins}\u00a0=\u00a0{k}, which for a t-distribution with ν_eff\u00a0=\u00a0{dof_text(fewest)} effective "
        f"degrees of freedom, the fewest of any value here, corresponds to a coverage probability of approximately "
        f"{_percent(covers)}."
    )


def _group(budget: BudgetEntry, factors: Sequence[str], first: int, name: str) -> str:
    """Return the coverage factors of three axes, from the index `first`, with degrees of freedom, in words.

    Equal factors are given once.
    """
    axis_factors, dofs = factors[first : first + 3], budget.effective_dof[first : first + 3]
    if len(set(axis_factors)) == 1:
        return f"{name} k\u00a0=\u00a0{axis_factors[0]} (ν_eff\u00a0≥\u00a0{dof_text(min(dofs))})"
    texts = (f"{axis} {k} ({dof_text(dof)})" for axis, k, dof in zip(AXES, axis_factors, dofs, strict=True))
    return f"{name} k (ν_eff): {', '.join(texts)}"


def _percent(probability: float) -> str:
    """Return a probability as whole percent, or with all its digits if it defines the coverage factor."""
    full = f" ({100 * PROBABILITY:.2f} %)" if math.isclose(probability, PROBABILITY, abs_tol=5e-5) else ""
    return f"{100 * probability:.0f} %{full}"


def _short(factor: str) -> str:
    return "2" if factor == "2.00" else factor
