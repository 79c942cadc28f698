"""A characteristic of a sensor: what a result states of it beside scale factors and biases, for every outlet. Pure."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Literal, get_args

import numpy as np

from rig.data.entries.result_types import Freedom
from rig.data.quantity import Quantity, Unit
from rig.report.findings.finding import Finding
from rig.report.words.expanded import Expanded, expanded

Outlet = Literal["terminal", "certificate", "digital certificate", "page", "history", "exports"]
OUTLETS: Final[tuple[Outlet, ...]] = get_args(Outlet)


@dataclass(frozen=True, slots=True)
class Known:
    """Numbers of an entry in SI units, their standard uncertainties, and the degrees of freedom of these if counted."""

    values: Sequence[float]
    stds: Sequence[float]
    freedom: Sequence[Freedom] | None = None


@dataclass(frozen=True, slots=True)
class Units:
    """The unit of such numbers: that of SI in print and as D-SI writes it, and the one that they are `shown` in."""

    si: str
    d_si: str
    shown: Unit


@dataclass(frozen=True, slots=True)
class Series:
    """How a history names numbers, by `prefix` and label, and what it calls each in `words`, by the label's letters.

    `drawn` among the pictures; `opposite` where it keeps the values with the other sign than the certificates.
    """

    prefix: str
    words: str
    drawn: bool = False
    opposite: bool = False


@dataclass(frozen=True, slots=True)
class Characteristic:
    """One quantity of a sensor beside scale and bias, as an entry states it by `labels`.

    - `units` are those for what the sensor measures; `known` finds the numbers in the entry, None where there are none.
    - `series` is how a history follows it; None where it does not, which `elsewhere` explains.
    - `elsewhere`: the outlets that do not take it from here, each with the reason in a line.
    - `remark` is what the digital certificate says of it before ± U, by its entry.
    """

    name: str
    labels: Sequence[str]
    units: Callable[[Quantity], Units]
    known: Callable[[Any], Known | None]
    series: Series | None
    elsewhere: Mapping[Outlet, str] = field(default_factory=dict)
    remark: Callable[[Any], str] = lambda _: ""

    def of(self, finding: Finding[Any]) -> "Term":
        """What an entry states of it. Raises ValueError where it states nothing."""
        if (known := self.known(finding.entry)) is None:
            raise ValueError(f"{finding.sensor} has no {self.name}")
        return Term(finding, self, known)

    @property
    def opposite(self) -> bool:
        """Whether a history keeps the values with the other sign."""
        return self.series is not None and self.series.opposite

    @property
    def parameters(self) -> dict[str, str]:
        """The names of the history's parameters with their words."""
        if self.series is None:
            return {}
        return {self.series.prefix + label: self.series.words.format(*label) for label in self.labels}


@dataclass(frozen=True, slots=True)
class Term:
    """A characteristic that an entry states, with its numbers."""

    finding: Finding[Any]
    characteristic: Characteristic
    known: Known

    @property
    def name(self) -> str:
        """What it is called."""
        return self.characteristic.name

    @property
    def whose(self) -> str:
        """How the sensor is called beside the others of its name."""
        return self.finding.quantity.label(self.finding.sensor)

    @property
    def units(self) -> Units:
        """The unit of its numbers."""
        return self.characteristic.units(self.finding.quantity)

    @property
    def expanded(self) -> Expanded:
        """U of the numbers in SI units, with its coverage factors."""
        return expanded(self.known.stds, self.known.freedom)

    @property
    def printed(self) -> Iterator[tuple[str, float, float]]:
        """Label, value and U of each number in the unit that they are shown in."""
        size, labels = self.units.shown.size, self.characteristic.labels
        for label, value, width in zip(labels, self.known.values, self.expanded.widths, strict=True):
            yield label, value / size, width / size


def terms(
    characteristics: Iterable[Characteristic], finding: Finding[Any], outlet: Outlet | None = None
) -> Iterator[Term]:
    """The characteristics that an entry states; of those the ones that an outlet takes where one is named."""
    for each in characteristics:
        if outlet not in each.elsewhere and each.known(finding.entry) is not None:
            yield each.of(finding)


def named(what: str, suffix: str, sign: int = 1) -> Callable[[Any], Known | None]:
    """Numbers of an entry, or of its vector model: `what_suffix`, `what_std_suffix`, `what_degrees_of_freedom`.

    A matrix is read row by row. Values change by the `sign` where the entry has those of the opposite.
    """

    def known(entry: Any) -> Known | None:
        for held in (entry, getattr(entry, "vector_model", None)):
            values, stds = (getattr(held, f"{name}_{suffix}", None) for name in (what, f"{what}_std"))
            if values is not None and stds is not None:
                freedom = getattr(held, f"{what}_degrees_of_freedom", None)
                counted = None if freedom is None else _flat(freedom)
                return Known([sign * each for each in _flat(values)], _flat(stds), counted)
        return None

    return known


def _flat(numbers: Any) -> list[Any]:
    """One number, those of a vector, or those of a matrix row by row."""
    return list(np.ravel(numbers).tolist())


def always(si: str, d_si: str, shown: Unit | None = None) -> Callable[[Quantity], Units]:
    """A unit that is the same whatever the sensor measures, shown as it is unless another is given."""
    units = Units(si, d_si, shown or Unit(si, 1.0))
    return lambda _: units
