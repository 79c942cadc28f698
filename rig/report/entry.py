"""From what the analysis found to the entries of `result.json`, by the table of `rig/report/entry_sources.py`."""

from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel

from rig.estimation.arrays import Array

EntryT = TypeVar("EntryT", bound=BaseModel)


def entry(kind: type[EntryT], /, *sources: object, **more: Any) -> EntryT:
    """Return an entry of that kind: each field from `more`, or by the table from the first source that has it.

    Arrays become tuples. Raises ValueError for a field that nothing says or whose value does not fit, TypeError for one
    of `more` that the entry does not have and for a source that the table does not know: reading ignores what it does
    not know, writing must not. Raises AttributeError where a source has lost what the table takes.
    """
    if unknown := more.keys() - kind.model_fields.keys():
        raise TypeError(f"{kind.__name__} has no {', '.join(sorted(unknown))}")
    fields: dict[str, Any] = {}
    for source in reversed(sources):
        fields |= {field: getattr(source, attribute) for field, attribute in _attributes(kind, source).items()}
    return kind.model_validate({name: _plain(value) for name, value in {**fields, **more}.items()})


def counted(freedom: Array | None) -> list[Any] | None:
    """Degrees of freedom of any shape, infinite ones as null; None where nobody counted."""
    if freedom is None:
        return None
    found = freedom.astype(object)
    found[~np.isfinite(freedom)] = None
    return list(found.tolist())


def _attributes(kind: type[BaseModel], source: object) -> Mapping[str, str]:
    """Return the attribute of a source that fills each field of such an entry."""
    from rig.report.entry_sources import SOURCES  # all that is analysed: only what writes entries needs it

    for row in SOURCES.get(kind, ()):
        if isinstance(source, row.classes):
            return row.attributes
    raise TypeError(f"no row of entry_sources.py says what {kind.__name__} takes from {type(source).__name__}")


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value
