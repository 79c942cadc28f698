"""Builds entries of `result.json` from results of the analysis, by the table of `rig/report/entry_sources.py`."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from pydantic import BaseModel

from rig.data.entries.result_types import ConditionsEntry, ErrorEntry
from rig.errors import Fault
from rig.estimation.arrays import Array

if TYPE_CHECKING:
    from rig.analysis.measurement_conditions import Conditions

EntryT = TypeVar("EntryT", bound=BaseModel)


def entry(kind: type[EntryT], /, *sources: object, **more: Any) -> EntryT:
    """Return an entry of `kind`. A field that `more` does not give is taken from the first source that has it.

    The table of `entry_sources.py` says which fields a source has.

    Arrays become tuples. Raise ValueError for a field without a source or with a value that does not fit; TypeError if
    `more` has a name that is not a field, or for a source that the table does not list; AttributeError if a source
    lacks an attribute of the table.
    """
    if unknown := more.keys() - kind.model_fields.keys():
        raise TypeError(f"{kind.__name__} has no {', '.join(sorted(unknown))}")
    fields: dict[str, Any] = {}
    for source in reversed(sources):
        fields |= {field: getattr(source, attribute) for field, attribute in _attributes(kind, source).items()}
    return kind.model_validate({name: _plain_value(value) for name, value in {**fields, **more}.items()})


def error_entry(fault: Fault) -> ErrorEntry:
    """Return the entry of a Fault that ended an attempt."""
    return ErrorEntry(error=str(fault))


def when_entry(when: "Conditions") -> ConditionsEntry:
    """Return the entry of the times, to the second, and the temperature at which a value was measured."""
    times = {name: getattr(when, name).isoformat(timespec="seconds") for name in ("from_utc", "to_utc", "mean_utc")}
    return entry(ConditionsEntry, when, **times)


def finite_or_none(number: float) -> float | None:
    """Return the number, or None for one that is not finite: infinite degrees of freedom, an unknown temperature."""
    return number if np.isfinite(number) else None


def dof_or_none(dof: Array | None) -> list[Any] | None:
    """Return degrees of freedom as lists, with infinity as null; None for unknown degrees of freedom."""
    return None if dof is None else list_dof(dof)


def list_dof(dof: Array) -> list[Any]:
    """Return degrees of freedom of any shape as lists, with infinity as null."""
    numbers = dof.astype(object)
    numbers[~np.isfinite(dof)] = None
    return list(numbers.tolist())


def _attributes(kind: type[BaseModel], source: object) -> Mapping[str, str]:
    """Return the name of the source's attribute that fills each field of `kind`, by field."""
    from rig.report.entry_sources import SOURCES  # imported here: it imports all entries, and only writing one needs it

    names = {cls.__name__ for cls in type(source).__mro__}
    for row in SOURCES.get(kind, ()):
        if not names.isdisjoint(row.classes):
            return row.attributes
    raise TypeError(f"no row of entry_sources.py says what {kind.__name__} takes from {type(source).__name__}")


def _plain_value(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value
