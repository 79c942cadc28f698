"""Extensions of the rig by installed packages, through the entry points of a group."""

import sys
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from rig.errors import Refused


def load_entry_points(
    group: str, not_loaded: Callable[[str, str], Refused], stock: Iterable[EntryPoint] = ()
) -> Iterator[tuple[EntryPoint, Any]]:
    """Yield the entry points of a group, those in `stock` first, each with its loaded object.

    Raise the error `not_loaded` (problem, remedy) for an entry point that cannot be imported.
    """
    for entry in (*stock, *_entry_points(tuple(sys.path)).select(group=group)):
        try:
            yield entry, entry.load()
        except (ImportError, AttributeError) as error:
            what = f"{entry.name} is installed but cannot be loaded ({error})"
            raise not_loaded(what, f"Install the package of {entry.value} again, or remove it") from error


@cache
def _entry_points(_: tuple[str, ...]) -> Any:
    """Return the entry points of all packages on the search path (the argument), cached because this takes 10 ms.

    Python 3.11 and 3.12 return objects of different classes; both have the method `select`.
    """
    return entry_points()
