"""U of values without a budget, from standard deviations and degrees of freedom, and coverage factors in words."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.entries.result_types import Freedom
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, coverage_factors, coverage_probability


@dataclass(frozen=True, slots=True)
class Expanded:
    """Expanded uncertainties U with coverage factors and probabilities, one for each U or one for all."""

    widths: Sequence[float]
    factors: Sequence[float]
    probabilities: Sequence[float]


def expanded(stds: Sequence[float], counted: Sequence[Freedom] | None) -> Expanded:
    """Return U = k u of uncertainties u (`stds`): k is Student's t for the degrees of freedom `counted`, else 2."""
    dofs = [np.inf if dof is None else dof for dof in counted or [None] * len(stds)]
    factors = coverage_factors(dofs)
    return Expanded((factors * np.array(stds)).tolist(), factors.tolist(), coverage_probability(factors, dofs).tolist())


def factor_words(dof: Sequence[Freedom] | None) -> str:
    """Return the coverage factors k for degrees of freedom as printed: a single number, or the smallest and largest."""
    if dof is None:
        return f"k = {COVERAGE_FACTOR:g}, degrees of freedom not counted"
    return spell_factors(expanded([1.0] * len(dof), dof).factors)


def spell_factors(factors: Sequence[float]) -> str:
    """Return coverage factors as printed: one number if all are equal, else the smallest and the largest."""
    low, high = f"{min(factors):.3g}", f"{max(factors):.3g}"
    return f"k = {low}" if low == high else f"k = {low} to {high}"
