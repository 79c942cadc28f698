"""What packages installed here add to the rig, by the entry points of a group."""

from collections.abc import Callable, Iterable, Iterator
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from rig.errors import Refused


def added(
    group: str, not_loaded: Callable[[str, str], Refused], stock: Iterable[EntryPoint] = ()
) -> Iterator[tuple[EntryPoint, Any]]:
    """The entry points of the group, those in `stock` first, each with what it names.

    Raises `not_loaded` of what cannot be imported, by what is wrong and what to do.
    """
    for entry in (*stock, *entry_points(group=group)):
        try:
            yield entry, entry.load()
        except (ImportError, AttributeError) as error:
            what = f"{entry.name} is installed but cannot be loaded ({error})"
            raise not_loaded(what, f"Install the package of {entry.value} again, or remove it") from error
