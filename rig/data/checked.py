"""Plain values, as JSON has them, into a frozen dataclass: each of the type and in the range its annotation says."""

from typing import Annotated, Any, TypeVar

from pydantic import Field, TypeAdapter, ValidationError

QUOTED_CHARACTERS = 60

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
        raise ValueError(f"{place} is {quoted(first['input'])}: {first['msg']}") from None
    return value


def quoted(value: object) -> str:
    """For a message: whatever it is, in few plain characters."""
    text = ascii(value) if isinstance(value, str) else repr(value)
    return text if len(text) <= QUOTED_CHARACTERS else text[: QUOTED_CHARACTERS - 1] + "…"


def _adapter(kind: type[Any]) -> TypeAdapter[Any]:
    """Made once: that takes a while."""
    if kind not in _adapters:
        _adapters[kind] = TypeAdapter(kind)
    return _adapters[kind]
