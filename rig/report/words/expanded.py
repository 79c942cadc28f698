"""U of what has no budget: from standard deviations and their degrees of freedom, and what U is, in words."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.entries.result_types import Freedom
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, coverage_factors, covered


@dataclass(frozen=True, slots=True)
class Expanded:
    """Expanded uncertainties U with coverage factors and probabilities: one of these for each U, or one for all."""

    widths: Sequence[float]
    factors: Sequence[float]
    probabilities: Sequence[float]


def expanded(stds: Sequence[float], freedom: Sequence[Freedom] | None) -> Expanded:
    """U = k u of each by Student's t; two standard deviations where nobody counted."""
    known = [np.inf if each is None else each for each in freedom or [None] * len(stds)]
    factors = coverage_factors(known)
    return Expanded((factors * np.array(stds)).tolist(), factors.tolist(), covered(factors, known).tolist())


def factor_words(freedom: Sequence[Freedom] | None) -> str:
    """What k is, one for all or from the smallest to the largest, as it is printed."""
    if freedom is None:
        return f"k = {COVERAGE_FACTOR:g}, degrees of freedom not counted"
    factors = expanded([1.0] * len(freedom), freedom).factors
    low, high = f"{min(factors):.3g}", f"{max(factors):.3g}"
    return f"k = {low}" if low == high else f"k = {low} to {high}"
