"""A characteristic of a sensor: a quantity other than scale factor and bias, for every output. Pure."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Literal, get_args

import numpy as np

from rig.data.entries.result_types import Freedom
from rig.data.quantity import DisplayUnit, Quantity
from rig.report.findings.finding import Finding
from rig.report.words.expanded_uncertainty import Expanded, expanded

Outlet = Literal["terminal", "certificate", "digital certificate", "page", "history", "exports"]
OUTLETS: Final[tuple[Outlet, ...]] = get_args(Outlet)


@dataclass(frozen=True, slots=True)
class UncertainNumbers:
    """Numbers of an entry in SI units, their standard uncertainties, and the degrees of freedom of each, if stated."""

    values: Sequence[float]
    stds: Sequence[float]
    dof: Sequence[Freedom] | None = None


@dataclass(frozen=True, slots=True)
class Units:
    """The units of a characteristic's numbers: the SI unit as printed and in D-SI notation, and the unit `shown`."""

    si: str
    d_si: str
    shown: DisplayUnit


@dataclass(frozen=True, slots=True)
class Series:
    """The presentation of a characteristic in a history, as one parameter for each of its numbers.

    A parameter is named `prefix` + label; `words` describe it, with a place for the label. `drawn`: whether the history
    draws the parameters. `opposite`: whether it stores the numbers with the opposite sign of certificates.
    """

    prefix: str
    words: str
    drawn: bool = False
    opposite: bool = False


@dataclass(frozen=True, slots=True)
class Characteristic:
    """A quantity of a sensor other than scale factor and bias, with a number for each of `labels` in an entry.

    - `units`: returns the units for the quantity that the sensor measures.
    - `read`: returns the numbers in an entry; None if the entry does not have them.
    - `series`: its presentation in a history; None if a history does not store it, which `exempt` explains.
    - `exempt`: the forms of output that do not show it, each with the reason.
    - `remark`: returns the remark before ± U in the digital certificate, for an entry.
    """

    name: str
    labels: Sequence[str]
    units: Callable[[Quantity], Units]
    read: Callable[[Any], UncertainNumbers | None]
    series: Series | None
    exempt: Mapping[Outlet, str] = field(default_factory=dict)
    remark: Callable[[Any], str] = lambda _: ""

    def term_of(self, finding: Finding[Any]) -> "Term":
        """Return this characteristic with the numbers that a finding has for it. Raise ValueError if it has none."""
        if (numbers := self.read(finding.entry)) is None:
            raise ValueError(f"{finding.sensor} has no {self.name}")
        return Term(finding, self, numbers)

    @property
    def opposite(self) -> bool:
        """Whether a history stores the values with the opposite sign."""
        return self.series is not None and self.series.opposite

    @property
    def parameters(self) -> dict[str, str]:
        """The words for the parameters that a history stores for it, by parameter name; empty without `series`."""
        if self.series is None:
            return {}
        return {self.series.prefix + label: self.series.words.format(*label) for label in self.labels}


@dataclass(frozen=True, slots=True)
class Term:
    """A characteristic that an entry states, with its numbers."""

    finding: Finding[Any]
    characteristic: Characteristic
    numbers: UncertainNumbers

    @property
    def name(self) -> str:
        """The characteristic's name."""
        return self.characteristic.name

    @property
    def whose(self) -> str:
        """The label of the sensor's readings, which distinguishes their quantity from the sensor's other quantities."""
        return self.finding.quantity.label(self.finding.sensor)

    @property
    def units(self) -> Units:
        """The unit of the numbers."""
        return self.characteristic.units(self.finding.quantity)

    @property
    def expanded(self) -> Expanded:
        """U of the numbers in SI units, with its coverage factors."""
        return expanded(self.numbers.stds, self.numbers.dof)

    @property
    def printed(self) -> Iterator[tuple[str, float, float]]:
        """Label, value and U of each number, in the unit in which they are shown."""
        size, labels = self.units.shown.size, self.characteristic.labels
        for label, value, width in zip(labels, self.numbers.values, self.expanded.widths, strict=True):
            yield label, value / size, width / size


def terms(
    characteristics: Iterable[Characteristic], finding: Finding[Any], outlet: Outlet | None = None
) -> Iterator[Term]:
    """Yield the characteristics that an entry states; if an `outlet` (an output) is given, only those that it shows."""
    for characteristic in characteristics:
        if outlet not in characteristic.exempt and characteristic.read(finding.entry) is not None:
            yield characteristic.term_of(finding)


def read_fields(what: str, suffix: str, sign: int = 1) -> Callable[[Any], UncertainNumbers | None]:
    """Return a reader of the fields `<what>_<suffix>`, `<what>_std_<suffix>` and `<what>_degrees_of_freedom`.

    The reader looks into an entry and into the entry's vector model. It flattens a matrix by rows and multiplies values
    by `sign`.
    """

    def read(entry: Any) -> UncertainNumbers | None:
        for part in (entry, getattr(entry, "vector_model", None)):
            values, stds = (getattr(part, f"{name}_{suffix}", None) for name in (what, f"{what}_std"))
            if values is not None and stds is not None:
                dof = getattr(part, f"{what}_degrees_of_freedom", None)
                numbers = [sign * value for value in _flat(values)]
                return UncertainNumbers(numbers, _flat(stds), None if dof is None else _flat(dof))
        return None

    return read


def _flat(numbers: Any) -> list[Any]:
    """Return the numbers of a scalar, a vector, or a matrix row by row."""
    return list(np.ravel(numbers).tolist())


def same_units(si: str, d_si: str, shown: DisplayUnit | None = None) -> Callable[[Quantity], Units]:
    """Return a function that gives the same units for every quantity; `shown` is by default the SI unit."""
    units = Units(si, d_si, shown or DisplayUnit(si, 1.0))
    return lambda _: units
