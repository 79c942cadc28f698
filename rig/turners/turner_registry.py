"""Kinds of turners by name. A package adds its own through the entry-point group `rig.turners`.

The rest of the rig knows a turner only through its `TurnerKind`.
"""

from collections.abc import Mapping
from functools import cache
from importlib.metadata import EntryPoint

from rig.config.load import STOCK_TURNERS
from rig.config.models import TurnerSection
from rig.errors import Refused
from rig.errors.installed import load_entry_points
from rig.turners.turner_kind import AnyTurner, Wording

GROUP = "rig.turners"


@cache
def load_turner_kinds() -> Mapping[str, AnyTurner]:
    """Return the kinds of turners in stock and in installed packages, by name. Raise Refused `turner_not_loaded`."""
    return {kind.name: kind for _, kind in load_entry_points(GROUP, _not_loaded, map(_stock, STOCK_TURNERS))}


def _stock(name: str) -> EntryPoint:
    return EntryPoint(name, f"rig.turners.{name}.{name}_kind:{name.upper()}", GROUP)


def _not_loaded(what: str, remedy: str) -> Refused:
    return Refused("turner_not_loaded", f"the turner {what}", remedy)


def sections() -> Mapping[str, type[TurnerSection]]:
    """Return the models of the configuration's section `turner:`, by its `kind`."""
    return {name: kind.section for name, kind in load_turner_kinds().items()}


def kind_of(section: TurnerSection) -> AnyTurner:
    """Return the kind of turner that a section configures. Raise Refused `turner_not_installed`."""
    for kind in load_turner_kinds().values():
        if type(section) is kind.section:
            return kind
    raise Refused(
        "turner_not_installed",
        f"no installed turner has the section {type(section).__name__}",
        "Install the package that brings it; after an update of the rig, install the rig again",
    )


def words_of(name: str) -> Wording:
    """Return the wording for a kind of turner; general terms for a kind that is not installed."""
    # Only the stock one: to search for those of packages takes as long as to write the certificate that needs the
    # words.
    kind: AnyTurner | None = _stock(name).load() if name in STOCK_TURNERS else load_turner_kinds().get(name)
    if kind is not None:
        return kind.words
    return Wording(
        name=f"turner of the kind {name}",
        short="turner",
        turned="it",
        method=f"A turner of the kind {name} turns the items",
        briefly=f"turns and attitudes at rest on a turner of the kind {name}",
        directions="the turner's geometry",
    )
