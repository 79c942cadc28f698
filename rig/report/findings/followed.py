"""What a history keeps of a result: parameters with their uncertainties, by sensor. Pure.

Names: kx ky kz scale factors, k their mean, bx by bz biases; characteristics (`characteristics.py`) name the others.
The mean is one of its own because a gyroscope's only standard of size, the clock, moves all alike.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, freedom_of

if TYPE_CHECKING:
    from rig.data.entries.budget import BudgetEntry
    from rig.data.quantity import Quantity
    from rig.data.result_file import ResultDocument
    from rig.report.findings.characteristic import Term

SCALES, BIASES = ("k", "kx", "ky", "kz"), ("bx", "by", "bz")


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of a calibration. `std_combined` is None where no more than noise is known of its uncertainty.

    `max_deviation` from the nominal value is what the run's limits allowed, None without one. `coverage_factor` is that
    of U by its degrees of freedom.
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
        """The larger account of its standard uncertainty that there is."""
        return self.std_statistical if self.std_combined is None else self.std_combined

    @property
    def expanded(self) -> float:
        """U as the result states it."""
        return self.coverage_factor * self.std

    @property
    def freedom(self) -> float:
        """The degrees of freedom of its standard uncertainty, by its coverage factor."""
        return freedom_of(self.coverage_factor)

    @property
    def nominal(self) -> float:
        """What an ideal sensor has."""
        return nominal(self.name)


@dataclass(frozen=True, slots=True)
class Followed:
    """What one sensor's result in a run is followed by, under the name of a `quantity`.

    `full_scale` is in the unit of its biases, 0 where the result does not say it. Characteristics join the `parameters`
    of the kind's own.
    """

    sensor: str
    quantity: str
    part: str
    serial_number: str
    full_scale: float
    estimator: str
    temperature_c: float | None
    parameters: tuple[Parameter, ...] = ()


class Calibrated(Protocol):
    """Scale factors and biases in `result.json`, whatever the sensor."""

    @property
    def scale(self) -> Sequence[float]: ...
    @property
    def covariance(self) -> Sequence[Sequence[float]]: ...
    @property
    def covariance_combined(self) -> Sequence[Sequence[float]] | None: ...
    @property
    def budget(self) -> "BudgetEntry | None": ...


def nominal(name: str) -> float:
    """1 for scale factors, else 0."""
    return float(is_scale(name))


def is_scale(name: str) -> bool:
    """Whether a parameter of this name is a scale factor, whose changes are fractions."""
    return name in SCALES


def scale_and_bias(
    sensor: str, quantity: "Quantity", entry: Calibrated, bias: Sequence[float], document: "ResultDocument"
) -> Iterator[Parameter]:
    """Scale and bias of each axis, and the mean scale factor by their covariance, with the largest k of theirs."""
    from rig.data.meaning import JUDGED_PARAMETERS, limit_held

    axes, each_alone = len(entry.scale), np.eye(2 * len(entry.scale))
    mean = each_alone[:axes].mean(axis=0)
    values, combined = np.array([*entry.scale, *bias]), entry.covariance_combined
    factors = np.full(2 * axes, COVERAGE_FACTOR) if entry.budget is None else np.array(entry.budget.coverage_factors)
    scale_limit, bias_limit = (limit_held(document.checks, sensor, quantity.name, of) for of in JUDGED_PARAMETERS)
    rows: list[tuple[str, Array, str, float | None]] = [("k", mean, "1", None)]
    rows += [(f"k{axis}", each_alone[i], "1", scale_limit) for i, axis in enumerate(quantity.axes)]
    rows += [(f"b{axis}", each_alone[axes + i], quantity.unit, bias_limit) for i, axis in enumerate(quantity.axes)]
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
    """The parameters of characteristics, by their standard deviations and the degrees of freedom of these."""
    for each in characteristics:
        of, known = each.characteristic, each.known
        sign = -1 if of.opposite else 1
        rows = zip(of.parameters, known.values, known.stds, each.expanded.factors, strict=True)
        for name, value, std, factor in rows:
            yield Parameter(name, sign * value, std, None, each.units.si, coverage_factor=float(factor))


def known(parameters: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """The parameters with an uncertainty: of another, nothing can be said over time."""
    return tuple(each for each in parameters if each.std_statistical > 0)


def _std(row: Array, covariance: Sequence[Sequence[float]]) -> float:
    return float(np.sqrt(row @ np.array(covariance) @ row))
