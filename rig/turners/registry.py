"""The kinds of turners by name. A package adds its own through the entry-point group `rig.turners`.

Nothing in the rig knows a turner except through its `TurnerKind`.
"""

from collections.abc import Mapping
from functools import cache
from importlib.metadata import EntryPoint

from rig.config.load import STOCK_TURNERS
from rig.config.models import TurnerSection
from rig.errors import Refused
from rig.errors.installed import added
from rig.turners.kind import AnyTurner, Words

GROUP = "rig.turners"


@cache
def installed() -> Mapping[str, AnyTurner]:
    """The kinds of turners in stock, and of the packages installed here. Raises Refused `turner_not_loaded`."""
    stock = (EntryPoint(name, f"rig.turners.{name}.kind:{name.upper()}", GROUP) for name in STOCK_TURNERS)
    return {kind.name: kind for _, kind in added(GROUP, _not_loaded, stock)}


def _not_loaded(what: str, remedy: str) -> Refused:
    return Refused("turner_not_loaded", f"the turner {what}", remedy)


def sections() -> Mapping[str, type[TurnerSection]]:
    """What the `turner:` section of a configuration may be, by its `kind`."""
    return {name: kind.section for name, kind in installed().items()}


def kind_of(section: TurnerSection) -> AnyTurner:
    """The kind of turner that is configured so. Raises Refused `turner_not_installed`."""
    for kind in installed().values():
        if type(section) is kind.section:
            return kind
    raise Refused(
        "turner_not_installed",
        f"no installed turner has the section {type(section).__name__}",
        "Install the package that brings it; after an update of the rig, install the rig again",
    )


def words_of(name: str) -> Words:
    """How to speak of a kind of turner: in general terms of one that is not installed here."""
    known = installed().get(name)
    if known is not None:
        return known.words
    return Words(
        name=f"turner of the kind {name}",
        short="turner",
        turned="it",
        method=f"A turner of the kind {name} turns the items",
        briefly=f"turns and attitudes at rest on a turner of the kind {name}",
        directions="the turner's geometry",
    )
