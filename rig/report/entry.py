"""From what the analysis found to the entries of `result.json`, field by field of the same name."""

from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel

from rig.estimation.arrays import Array

EntryT = TypeVar("EntryT", bound=BaseModel)


def entry(kind: type[EntryT], /, *sources: object, **more: Any) -> EntryT:
    """An entry of that kind: each field is in `more`, or is the attribute of that name of the first source that has it.

    Arrays become tuples. Raises ValueError for a field that nothing says or whose value does not fit, TypeError for one
    of `more` that the entry does not have: reading ignores what it does not know, writing must not.
    """
    if unknown := more.keys() - kind.model_fields.keys():
        raise TypeError(f"{kind.__name__} has no {', '.join(sorted(unknown))}")
    said = {name: getattr(source, name) for source in reversed(sources) for name in _shared(kind, source)}
    return kind.model_validate({name: _plain(value) for name, value in {**said, **more}.items()})


def counted(freedom: Array | None) -> list[Any] | None:
    """Degrees of freedom of any shape, infinite ones as null; None where nobody counted."""
    if freedom is None:
        return None
    found = freedom.astype(object)
    found[~np.isfinite(freedom)] = None
    return list(found.tolist())


def _shared(kind: type[BaseModel], source: object) -> list[str]:
    return [name for name in kind.model_fields if hasattr(source, name)]


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value
