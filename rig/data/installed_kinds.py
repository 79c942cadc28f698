"""Kinds of sensors that packages add through the entry-point group `rig.kinds`, and the quantities of all kinds."""

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import Any, Protocol

from rig.data.quantity import RIG_QUANTITIES, SCALARS, Quantity, Scalar
from rig.errors import Refused
from rig.errors.installed import load_entry_points

GROUP = "rig.kinds"


class InstalledKind(Protocol):
    """A kind of sensor from an installed package; each part of rig reads only what it needs.

    - `quantity` is what the sensor measures.
    - `solve` takes the sensor's name, its placements at rest and the site, and returns the solution
      (`rig.analysis.installed_solvers`).
    - `result` (`rig.report.findings.result_kind.ResultKind`) describes its results for every output.
    """

    @property
    def quantity(self) -> Quantity: ...
    @property
    def solve(self) -> Any: ...
    @property
    def result(self) -> Any: ...


@cache
def installed_kinds() -> tuple[InstalledKind, ...]:
    """Return the kinds of sensors that installed packages add. Raise Refused `kind_not_loaded`."""
    return tuple(kind for _, kind in load_entry_points(GROUP, _not_loaded))


def _not_loaded(what: str, remedy: str) -> Refused:
    return Refused("kind_not_loaded", f"the kind of sensor {what}", remedy)


@cache
def quantities() -> Mapping[str, Quantity]:
    """Return every quantity by its name, including those of installed kinds of sensors."""
    every = (*RIG_QUANTITIES, *(kind.quantity for kind in installed_kinds()))
    return MappingProxyType({quantity.name: quantity for quantity in every})


@cache
def channel_contents() -> Mapping[str, Quantity | Scalar]:
    """Return everything that a channel may hold, by its name: quantities, and scalars without axes."""
    return MappingProxyType({**quantities(), **{scalar.name: scalar for scalar in SCALARS}})
