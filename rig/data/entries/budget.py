"""The uncertainty in `result.json`."""

import math
from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field

from rig.data.entries.result_types import Entry, Vector6
from rig.estimation.statistics.coverage import COVERAGE_FACTOR

# Ends the source of an estimate if the degrees of freedom are unknown but their effect is included in u.
INCLUDED_IN_U = "how well is in u"
# Infinite degrees of freedom are null.
Freedom6 = Annotated[tuple[float | None, ...], Field(min_length=6, max_length=6)]


class ContributorEntry(Entry):
    """One line of the budget; `half_width`, in `unit`, is null for a contributor estimated from readings.

    For a normal distribution, `half_width` is the stated expanded uncertainty (k = 2). `std` and `variance_fraction`
    are in the order kx ky kz bx by bz; scale factors have the unit 1.
    """

    name: str
    kind: Literal["A", "B"]
    distribution: Literal["normal", "rectangular"]
    half_width: float | None
    unit: str
    source: str
    degrees_of_freedom: float | None
    std: Vector6
    variance_fraction: Vector6


class BudgetEntry(Entry):
    """The contributors to `covariance_combined`; `expanded` is `coverage_factors` × `std`.

    The factors are Student's t for the effective `degrees_of_freedom`, with the `coverage_probabilities` of the
    intervals. `coverage_factor` is the largest factor.
    """

    contributors: tuple[ContributorEntry, ...]
    std: Vector6
    coverage_factor: float
    expanded: Vector6
    degrees_of_freedom: Freedom6
    coverage_factors: Vector6
    coverage_probabilities: Vector6

    @property
    def effective_dof(self) -> tuple[float, ...]:
        """Effective degrees of freedom, with inf for null."""
        return tuple(math.inf if dof is None else dof for dof in self.degrees_of_freedom)


def expand_uncertainties(budget: BudgetEntry | None, covariance: Sequence[Sequence[float]]) -> Sequence[float]:
    """Return U (6,) of scale and bias from the budget, or else two standard deviations from the covariance."""
    if budget is not None:
        return budget.expanded
    return [COVERAGE_FACTOR * covariance[i][i] ** 0.5 for i in range(len(covariance))]


class BiasProcessEntry(Entry):
    """The random walk of the bias, from means over `averaging_time_s`; `hour_std_rad_s`: its change (1σ) in an hour."""

    random_walk_rad_s_sqrt_s: float
    scatter_rad_s: float
    degrees_of_freedom: int
    averaging_time_s: float
    hour_std_rad_s: float


class ClockComparisonEntry(Entry):
    """The error of the controller's clock by comparison with one other `clock`."""

    clock: str
    error: float
    std: float


class ClockEntry(Entry):
    """The relative frequency error of the controller's clock, and its comparisons with other clocks.

    Speeds are corrected for this error.
    """

    error: float
    std: float
    comparisons: tuple[ClockComparisonEntry, ...]
