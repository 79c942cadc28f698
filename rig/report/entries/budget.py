"""The uncertainty as entries of `result.json`."""

import numpy as np

from rig.analysis.clock_comparison import ClockCheck
from rig.data.entries.budget import BiasProcessEntry, BudgetEntry, ClockComparisonEntry, ClockEntry, ContributorEntry
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.gyroscope.vector_fit import VectorFit
from rig.estimation.statistics.coverage import coverage_probability
from rig.report.entry import entry, finite_or_none, list_dof

HOUR_S = 3600.0


def budget_entry(budget: Budget) -> BudgetEntry:
    """Return the combined uncertainty and its contributors."""
    lines = [
        entry(ContributorEntry, line, variance_fraction=fraction, degrees_of_freedom=finite_or_none(line.dof))
        for line, fraction in zip(budget.contributors, budget.variance_fractions, strict=True)
    ]
    factors = budget.coverage_factors
    return entry(
        BudgetEntry,
        budget,
        contributors=lines,
        coverage_factor=float(factors.max()),
        degrees_of_freedom=list_dof(budget.dof),
        coverage_probabilities=coverage_probability(factors, budget.dof),
    )


def bias_process_entry(fit: VectorFit) -> BiasProcessEntry:
    """Return the entry of the bias process fitted to the rests, with the time over which the bias was averaged."""
    return entry(
        BiasProcessEntry,
        fit.bias,
        averaging_time_s=float(np.ptp(fit.inputs.windows_s)),
        hour_std_rad_s=fit.bias.drift_std_rad_s(HOUR_S),
    )


def clock_entry(check: ClockCheck) -> ClockEntry:
    """Return the entry of the controller's clock: its error, and its comparisons with other clocks."""
    return entry(
        ClockEntry, check, comparisons=[entry(ClockComparisonEntry, comparison) for comparison in check.comparisons]
    )
