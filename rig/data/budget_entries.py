"""The uncertainty's part of `result.json`."""

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field

from rig.data.result_types import Entry, Vector6

# Infinite degrees of freedom are null.
Freedom6 = Annotated[tuple[float | None, ...], Field(min_length=6, max_length=6)]


class ContributorEntry(Entry):
    """One line of the budget; `half_width` in `unit` is null where it was measured.

    Of a normal distribution it is the expanded uncertainty (k = 2) that somebody stated.
    `std` and `share` (of the variance) are those of kx ky kz bx by bz; units 1 and that of the biases.
    """

    name: str
    kind: Literal["A", "B"]
    distribution: Literal["normal", "rectangular"]
    half_width: float | None
    unit: str
    source: str
    freedom: float | None
    std: Vector6
    share: Vector6


class BudgetEntry(Entry):
    """What makes up `covariance_combined`; `expanded` is `coverage_factor` × `std`."""

    contributors: tuple[ContributorEntry, ...]
    std: Vector6
    coverage_factor: float
    expanded: Vector6
    freedom: Freedom6


def expanded_uncertainties(budget: BudgetEntry | None, covariance: Sequence[Sequence[float]]) -> Sequence[float]:
    """(6,) of scale and bias: U of the budget; without one, two standard deviations by the solution's covariance."""
    if budget is not None:
        return budget.expanded
    return [2 * covariance[i][i] ** 0.5 for i in range(len(covariance))]


class BiasProcessEntry(Entry):
    """How the bias wandered: it is the mean over `mean_over_s`, and an hour changes it by `hour_std_rad_s` (1σ)."""

    walk_rad_s_sqrt_s: float
    scatter_rad_s: float
    freedom: int
    mean_over_s: float
    hour_std_rad_s: float


class ClockComparisonEntry(Entry):
    """The controller's clock against another."""

    by: str
    error: float
    std: float


class ClockEntry(Entry):
    """How much too fast the controller's clock ran, a fraction, and by what it is known; speeds are corrected."""

    error: float
    std: float
    comparisons: tuple[ClockComparisonEntry, ...]
