"""The uncertainty as entries of `result.json`."""

import numpy as np

from rig.analysis.clock import ClockCheck
from rig.data.entries.budget import (
    BiasProcessEntry,
    BudgetEntry,
    ClockComparisonEntry,
    ClockEntry,
    ContributorEntry,
)
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.gyroscope.vector_fit import Explained
from rig.estimation.statistics.coverage import covered
from rig.report.entry import entry

HOUR_S = 3600.0


def budget_entry(budget: Budget) -> BudgetEntry:
    """The combined uncertainty and all it is made of."""
    lines = [
        entry(ContributorEntry, each, variance_fraction=share, degrees_of_freedom=_finite(each.freedom))
        for each, share in zip(budget.contributors, budget.shares, strict=True)
    ]
    factors = budget.coverage_factors
    return entry(
        BudgetEntry,
        budget,
        contributors=lines,
        coverage_factor=float(factors.max()),
        degrees_of_freedom=[_finite(each) for each in budget.freedom.tolist()],
        coverage_probabilities=covered(factors, budget.freedom),
    )


def bias_process_entry(explained: Explained) -> BiasProcessEntry:
    """How the bias wandered, and for how long it was averaged."""
    return entry(
        BiasProcessEntry,
        explained.bias,
        averaging_time_s=float(np.ptp(explained.seen.windows_s)),
        hour_std_rad_s=explained.bias.wandered_rad_s(HOUR_S),
    )


def clock_entry(check: ClockCheck) -> ClockEntry:
    """The controller's clock."""
    return entry(ClockEntry, check, comparisons=[entry(ClockComparisonEntry, each) for each in check.comparisons])


def _finite(freedom: float) -> float | None:
    return freedom if np.isfinite(freedom) else None
