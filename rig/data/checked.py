"""Plain values, as JSON has them, into a frozen dataclass: each of the type and in the range its annotation says."""

from typing import Annotated, Any, TypeVar

from pydantic import Field, TypeAdapter, ValidationError

from rig.errors.quoting import quote

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Kind = TypeVar("Kind")
_adapters: dict[type[Any], TypeAdapter[Any]] = {}


def checked(kind: type[Kind], document: Any, where: str) -> Kind:
    """A value of that type. Keys it does not know are left out. Raises ValueError naming the first wrong value."""
    try:
        value: Kind = _adapter(kind).validate_python(document)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join((where, *map(str, first["loc"])))
        raise ValueError(f"{place} is {quote(first['input'])}: {first['msg']}") from None
    return value


def _adapter(kind: type[Any]) -> TypeAdapter[Any]:
    """Made once: that takes a while."""
    if kind not in _adapters:
        _adapters[kind] = TypeAdapter(kind)
    return _adapters[kind]
