"""Tests of residuals against alternative hypotheses: the common form of all checks of consistency.

An alternative is a matrix of columns, the effects of one possible fault on the readings. The sum of squares of the
residuals that the columns explain is distributed as χ² if there is no such fault, with as many degrees of freedom as
there are columns outside the span of the model (Teunissen, Testing Theory, 2000).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

import numpy as np

from rig.estimation.arrays import Array

MIN_INDEPENDENT_PART = 1e-3  # of a unit column, outside the model
MIN_VISIBLE_PART = 1e-6  # least projection of a fault, relative to its norm: a smaller one is rounding
DETECTION_PROBABILITY = 0.95  # for a fault of the minimal detectable size
CHI_SQUARE_MARGIN = 10.0  # difference to the best alternative, up to which another one may also be the cause

Subject = TypeVar("Subject")
Statistic = tuple[float, float]  # a value and its critical value
Alternative = tuple[Array, Callable[[int], float]]  # whitened columns; the critical value by their number
Alternatives = Mapping[str, Array | None]  # by the check's name; None: all residuals


@dataclass(frozen=True, slots=True)
class FaultMode(Generic[Subject]):
    """A possible fault `what`, the `check` that detects it, and the `unit` of its size, None for the readings' unit.

    `patterns` returns the changes of the readings by one unit of the fault: a column for each form that it may have,
    such as on each axis. A change half-way through the recording is −½ before and ½ after, because the calibration
    would absorb a mean.
    """

    what: str
    check: str
    unit: str | None
    patterns: Callable[[Subject], Array]


@dataclass(frozen=True, slots=True)
class TestResults:
    """The `statistics` of one sensor by the name of their check, each with its critical value.

    - `worst`: the statistic of the sweep or dwell that differs most from the others.
    - `disturbed`: the statistics of all outlying sweeps or dwells, by index.
    - `detection_limits`: the minimal detectable sizes by fault mode, empty if not computed.
    """

    statistics: dict[str, Statistic]
    worst: Statistic
    disturbed: dict[int, Statistic]
    detection_limits: dict[str, float] = field(default_factory=dict)


class WhitenedModel(Protocol):
    """Readings and their model, whitened by all modelled errors."""

    def chi_square_of(self, alternatives: Sequence[Array], nuisance: Sequence[Array]) -> list[float]:
        """Return the χ² that each alternative explains, after a fit of the model and the `nuisance` columns."""

    def test(
        self, columns: Array | None, nuisance: Sequence[Array], false_alarm_probability: float
    ) -> Statistic | None:
        """Return the χ² that `columns` explain after a fit of the model and the `nuisance`, and its critical value.

        If `columns` is None, the χ² is that of all residuals. Return None if the fit already explains all that
        `columns` can.
        """


def test_alternatives(
    model: WhitenedModel, alternatives: Alternatives, false_alarm_probability: float
) -> dict[str, Statistic]:
    """Return the statistic of every alternative that the model does not contain, by the alternative's name."""
    statistics = {name: model.test(columns, (), false_alarm_probability) for name, columns in alternatives.items()}
    return {name: statistic for name, statistic in statistics.items() if statistic is not None}


def find_outliers(
    model: WhitenedModel, segments: Iterable[int], columns: Callable[[int], Array], false_alarm_probability: float
) -> list[tuple[int, Statistic]]:
    """Return the outlying segments with their statistics, or the worst segment alone if all segments agree.

    `columns` returns the effects by which one segment may differ from the model. Outliers are removed one by one until
    the remaining segments agree or half of all are removed. If only two segments determine a parameter, either may be
    the outlier, so both are returned.
    """
    remaining, nuisance = list(segments), list[Array]()
    outliers = list[tuple[int, Statistic]]()
    per_segment, most = false_alarm_probability / len(remaining), (len(remaining) + 1) // 2
    while len(outliers) < most:
        chi_square_of = dict(zip(remaining, model.chi_square_of(list(map(columns, remaining)), nuisance), strict=True))
        worst = max(remaining, key=lambda segment: chi_square_of[segment])
        statistic = model.test(columns(worst), nuisance, per_segment) or (0.0, 0.0)
        if statistic[0] <= statistic[1]:
            return outliers or [(worst, statistic)]
        alike = [segment for segment in remaining if chi_square_of[segment] > chi_square_of[worst] - CHI_SQUARE_MARGIN]
        outliers += [(segment, statistic) for segment in alike]
        remaining = [segment for segment in remaining if segment not in alike]
        nuisance.append(columns(worst))
    return outliers


def orthonormal_basis(columns: Array) -> Array:
    """Return an orthonormal basis of the span of columns."""
    sizes = np.linalg.norm(columns, axis=0)
    directions, singular, _ = np.linalg.svd(columns / np.where(sizes > 0, sizes, 1.0), full_matrices=False)
    basis: Array = directions[:, singular > 1e-6 * singular[0]]
    return basis


def remaining_directions(model_basis: Array, columns: Array) -> Array:
    """Return an orthonormal basis (n, k) of the parts of `columns` orthogonal to the basis `model_basis` (n, p)."""
    sizes = np.linalg.norm(columns, axis=0)
    new = columns / np.where(sizes > 0, sizes, 1.0)
    new = new - model_basis @ (model_basis.T @ new)
    directions, singular, _ = np.linalg.svd(new, full_matrices=False)
    basis: Array = directions[:, singular > MIN_INDEPENDENT_PART]
    return basis


def chi_square_of(readings: Array, model_basis: Array, columns: Array | None) -> tuple[float, int]:
    """Return the χ² of readings (n,) that columns (n, k) explain after a fit of the model, and its dof.

    `model_basis` (n, p) is orthonormal. If `columns` is None, the χ² is that of all residuals.
    """
    unexplained = readings - model_basis @ (model_basis.T @ readings)
    if columns is None:  # without a decomposition, which would be slow and might not converge
        return float(unexplained @ unexplained), len(readings) - model_basis.shape[1]
    new = remaining_directions(model_basis, columns)
    projections = new.T @ unexplained
    return float(projections @ projections), new.shape[1]


def minimal_detectable_size(model_basis: Array, patterns: Array, alternatives: Iterable[Alternative]) -> float:
    """Return the smallest size of a fault that a test detects in 95 of 100 recordings; inf if no test detects any size.

    This is Baarda's minimal detectable bias (1968): under the fault a test's statistic is non-central χ². All arguments
    are whitened.

    - `model_basis` (n, p): orthonormal columns of the model.
    - `patterns` (n, k): the changes of the readings by a fault of size 1, a column for each form of the fault. Each
      form counts with the test that detects it best; the size is that of the form that needs the largest.
    - `alternatives`: the columns of each test, and the test's critical value as a function of their number.
    """
    from scipy.special import chndtrinc

    detected = np.zeros(patterns.shape[1])  # per fault pattern: 1 / the smallest detected size
    for columns, limit in alternatives:
        new = remaining_directions(model_basis, columns)
        if count := new.shape[1]:
            size = np.sqrt(chndtrinc(limit(count), count, 1 - DETECTION_PROBABILITY))
            detected = np.maximum(detected, np.linalg.norm(new.T @ patterns, axis=0) / size)
    is_visible = detected.min() > MIN_VISIBLE_PART * np.linalg.norm(patterns, axis=0).max(initial=0.0)
    return float(1 / detected.min()) if is_visible else float(np.inf)
