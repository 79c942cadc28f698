"""The parameters of a result that a history stores, with their uncertainties, by sensor. Pure.

The parameters kx, ky, kz are scale factors, k is their mean, and bx, by, bz are biases; `characteristics.py` names the
others. The mean is a parameter of its own, because an error of the clock, a gyroscope's only standard, changes all
scale factors by the same fraction.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, find_dof_by_factor

if TYPE_CHECKING:
    from rig.data.entries.budget import BudgetEntry
    from rig.data.quantity import Quantity
    from rig.data.result_file import ResultDocument
    from rig.report.findings.characteristic import Term

SCALES, BIASES = ("k", "kx", "ky", "kz"), ("bx", "by", "bz")


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of a calibration.

    `std_combined` is None if only the uncertainty due to noise is known. `max_deviation`: the run's limit of the
    deviation from nominal, None without a limit. `coverage_factor`: the coverage factor of U for its degrees of
    freedom.
    """

    name: str
    value: float
    std_statistical: float
    std_combined: float | None
    unit: str
    max_deviation: float | None = None
    coverage_factor: float = COVERAGE_FACTOR

    @property
    def std(self) -> float:
        """The combined standard uncertainty if available, else the standard uncertainty due to noise."""
        return self.std_statistical if self.std_combined is None else self.std_combined

    @property
    def expanded(self) -> float:
        """The stated expanded uncertainty U."""
        return self.coverage_factor * self.std

    @property
    def dof(self) -> float:
        """The degrees of freedom of the standard uncertainty, from its coverage factor."""
        return find_dof_by_factor(self.coverage_factor)

    @property
    def nominal(self) -> float:
        """The value of an ideal sensor."""
        return nominal(self.name)


@dataclass(frozen=True, slots=True)
class HistoryRecord:
    """The parameters, including characteristics, of one sensor's result in a run, for the measured `quantity`.

    `full_scale`: the sensor's range in the unit of its biases, 0 if the result does not state the range.
    """

    sensor: str
    quantity: str
    part: str
    serial_number: str
    full_scale: float
    estimator: str
    temperature_c: float | None
    parameters: tuple[Parameter, ...] = ()


class CalibratedEntry(Protocol):
    """Scale factors and biases of an entry of `result.json`, of any sensor."""

    @property
    def scale(self) -> Sequence[float]: ...
    @property
    def covariance(self) -> Sequence[Sequence[float]]: ...
    @property
    def covariance_combined(self) -> Sequence[Sequence[float]] | None: ...
    @property
    def budget(self) -> "BudgetEntry | None": ...


def nominal(name: str) -> float:
    """Return 1 for scale factors, else 0."""
    return float(is_scale(name))


def is_scale(name: str) -> bool:
    """Return whether a parameter of this name is a scale factor, whose changes are stated as fractions."""
    return name in SCALES


def scale_and_bias(
    sensor: str, quantity: "Quantity", entry: CalibratedEntry, bias: Sequence[float], document: "ResultDocument"
) -> Iterator[Parameter]:
    """Yield the mean scale factor, then scale factor and bias of each axis.

    The mean's uncertainty includes the covariances of the axes; its coverage factor is the largest of the three axes.
    """
    from rig.data.meaning import JUDGED_PARAMETERS, find_conformity_limit

    axes, unit_rows = len(entry.scale), np.eye(2 * len(entry.scale))
    mean = unit_rows[:axes].mean(axis=0)
    values, combined = np.array([*entry.scale, *bias]), entry.covariance_combined
    factors = np.full(2 * axes, COVERAGE_FACTOR) if entry.budget is None else np.array(entry.budget.coverage_factors)
    scale_limit, bias_limit = (
        find_conformity_limit(document.checks, sensor, quantity.name, parameter) for parameter in JUDGED_PARAMETERS
    )
    rows: list[tuple[str, Array, str, float | None]] = [("k", mean, "1", None)]
    rows += [(f"k{axis}", unit_rows[i], "1", scale_limit) for i, axis in enumerate(quantity.axes)]
    rows += [(f"b{axis}", unit_rows[axes + i], quantity.unit, bias_limit) for i, axis in enumerate(quantity.axes)]
    for name, row, unit, limit in rows:
        yield Parameter(
            name,
            float(row @ values),
            _std(row, entry.covariance),
            None if combined is None else _std(row, combined),
            unit,
            limit,
            float(factors[row > 0].max()),
        )


def parameters(characteristics: "Iterable[Term]") -> Iterator[Parameter]:
    """Yield each number of the sensor's characteristics as a parameter, with its uncertainty and coverage factor."""
    for term in characteristics:
        numbers = term.numbers
        sign = -1 if term.characteristic.opposite else 1
        rows = zip(term.characteristic.parameters, numbers.values, numbers.stds, term.expanded.factors, strict=True)
        for name, value, std, factor in rows:
            yield Parameter(name, sign * value, std, None, term.units.si, coverage_factor=float(factor))


def select_uncertain(parameters: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """Return the parameters that have an uncertainty, without which a history cannot judge changes."""
    return tuple(parameter for parameter in parameters if parameter.std_statistical > 0)


def _std(row: Array, covariance: Sequence[Sequence[float]]) -> float:
    return float(np.sqrt(row @ np.array(covariance) @ row))
