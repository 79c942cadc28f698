"""Plain values, as JSON has them, into a frozen dataclass: each of the type and in the range its annotation says."""

from functools import cache
from typing import Annotated, Any, TypeVar

from pydantic import Field, TypeAdapter, ValidationError

QUOTED_CHARACTERS = 60

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Kind = TypeVar("Kind")


def checked(kind: type[Kind], document: Any, where: str) -> Kind:
    """A value of that type. Keys it does not know are left out. Raises ValueError naming the first wrong value."""
    try:
        return _adapter(kind).validate_python(document)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join((where, *map(str, first["loc"])))
        raise ValueError(f"{place} is {quoted(first['input'])}: {first['msg']}") from None


def quoted(value: object) -> str:
    """For a message: whatever it is, in few plain characters."""
    text = ascii(value) if isinstance(value, str) else repr(value)
    return text if len(text) <= QUOTED_CHARACTERS else text[: QUOTED_CHARACTERS - 1] + "…"


@cache
def _adapter(kind: type[Kind]) -> TypeAdapter[Kind]:
    return TypeAdapter(kind)
