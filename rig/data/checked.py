"""Plain values, as JSON has them, into what they mean: each of the type and in the range its annotation says."""

import json
import re
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.errors import Refused
from rig.errors.quoting import printable, quote
from rig.motion.geometry import MAX_JOINTS

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
OfJoints = Annotated[tuple[Finite, ...], Field(max_length=MAX_JOINTS)]  # the one that stands on the ground first
Kind = TypeVar("Kind")
Document = TypeVar("Document", bound=BaseModel)
MOST_VALUES = 200_000  # the largest of a run has 3,000; every wrong one of them costs a thousand bytes to tell
MOST_RECORDED = 50_000  # of a text or an event in a recording, where they are as dear
SEPARATORS = (b",", b"[", b"{")  # in JSON, before each value but the first
LARGEST_NUMBER = 1e100  # in SI units: what is beyond that overflows where it is squared, and nothing measured is
UNSEEN = re.compile("[\\x00-\\x1f\\x7f-\\x9f\\u061c\\u200e\\u200f\\u2028-\\u202e\\u2066-\\u2069\\ud800-\\udfff]")
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


def read_document(kind: type[Document], file: Path, limit_bytes: int, *, what: str, remedy: str) -> Document:
    """A JSON file of that kind; `what` it is a result of, for messages. Raises Refused `no_result`, `not_a_result`."""
    try:
        return kind.model_validate(parsed(read_regular_file(file, limit_bytes), MOST_VALUES))
    except (UnfitFile, OSError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise Refused("no_result", f"{file} cannot be read: {why}", remedy) from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        why = f"{where}{': ' if where else ''}{first['msg']}"
        raise Refused("not_a_result", f"{file} is no result of {what}: {why}", remedy) from error
    except UnicodeDecodeError as error:
        raise Refused("not_a_result", f"{file} is no result of {what}: it is not text", remedy) from error
    except json.JSONDecodeError as error:
        raise Refused("not_a_result", f"{file} is no result of {what}: it is not JSON: {error}", remedy) from error
    except (ValueError, RecursionError) as error:
        raise Refused("not_a_result", f"{file} is no result of {what}: {error}", remedy) from error


def parsed(content: str | bytes, most: int = MOST_RECORDED) -> Any:
    """The value of JSON that anybody may have written, its texts printable.

    Raises ValueError for a number that cannot be measured, a key that stands twice, over `most` values; RecursionError.
    """
    content = content.encode() if isinstance(content, str) else content
    if sum(map(content.count, SEPARATORS)) > most:
        raise ValueError(f"it holds over {most} values")
    found = json.loads(
        content,
        parse_float=_measured,
        parse_int=_measured,
        parse_constant=_measured,
        object_pairs_hook=each_key_once,
    )
    return seen(found)


def each_key_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object of a JSON file. Raises ValueError if a key stands twice: readers take different ones."""
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key {quote(next(key for key in keys if keys.count(key) > 1))} stands there twice")
    return found


def _measured(text: str) -> int | float:
    """A number of a JSON file. Raises ValueError for one that nothing could have found."""
    value = float(text)
    if not abs(value) <= LARGEST_NUMBER:
        raise ValueError(f"{quote(text)} is no number that can be measured")
    return value if set(text) & set(".eE") else int(text)


def seen(value: Any) -> Any:
    """A JSON value in whose texts nothing is hidden: a terminal, a certificate and a C header show all there is.

    Raises RecursionError.
    """
    if isinstance(value, str):
        return UNSEEN.sub(lambda found: printable(found[0]), value)
    if isinstance(value, list):
        return [seen(each) for each in value]
    if isinstance(value, dict):
        return {seen(key): seen(each) for key, each in value.items()}
    return value


def _adapter(kind: type[Any]) -> TypeAdapter[Any]:
    """The adapter of a type, made once: that takes a while."""
    if kind not in _adapters:
        _adapters[kind] = TypeAdapter(kind)
    return _adapters[kind]
