"""Kinds of sensors that a package adds, through the entry-point group `rig.kinds`, and all quantities with theirs."""

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import Any, Protocol

from rig.data.quantity import OF_THE_RIG, SCALARS, Quantity, Scalar
from rig.errors import Refused
from rig.errors.installed import added

GROUP = "rig.kinds"


class InstalledKind(Protocol):
    """What a package says of a kind of sensor: each room takes what is its own, and knows nothing of the others.

    - `quantity` is what it measures: its row of the table.
    - `solve` takes the sensor's name, its placements at rest and the site, and returns what is found
      (`rig.analysis.installed_kinds`).
    - `result` is the kind of result (`rig.report.findings.kind.ResultKind`), which shows that everywhere.
    """

    @property
    def quantity(self) -> Quantity: ...
    @property
    def solve(self) -> Any: ...
    @property
    def result(self) -> Any: ...


@cache
def installed_kinds() -> tuple[InstalledKind, ...]:
    """The kinds of the packages installed here. Raises Refused `kind_not_loaded`."""
    return tuple(kind for _, kind in added(GROUP, _not_loaded))


def _not_loaded(what: str, remedy: str) -> Refused:
    return Refused("kind_not_loaded", f"the kind of sensor {what}", remedy)


@cache
def quantities() -> Mapping[str, Quantity]:
    """Every quantity by its name, those of installed kinds of sensors too."""
    every = (*OF_THE_RIG, *(kind.quantity for kind in installed_kinds()))
    return MappingProxyType({each.name: each for each in every})


@cache
def measured() -> Mapping[str, Quantity | Scalar]:
    """Everything that a channel may be of, by its name: quantities, and what has no axes."""
    return MappingProxyType({**quantities(), **{each.name: each for each in SCALARS}})
