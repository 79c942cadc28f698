"""Plain values, as in JSON, validated against the type and range of their annotation."""

import json
import re
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.errors import Refused
from rig.errors.quoting import printable, quote
from rig.motion.chain import MAX_JOINTS

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
OfJoints = Annotated[tuple[Finite, ...], Field(max_length=MAX_JOINTS)]  # beginning with the joint on the ground
Kind = TypeVar("Kind")
Document = TypeVar("Document", bound=BaseModel)
MAX_VALUES = 200_000  # the largest file of a run has 3,000; the message about each wrong one takes a kilobyte
MAX_RECORDED_VALUES = 50_000  # in a text or an event of a recording, with the same cost
SEPARATORS = (b",", b"[", b"{")  # characters before a value in JSON
MAX_NUMBER = 1e100  # in SI units: larger than any measured value; the square of a larger one might overflow
INVISIBLE = re.compile("[\\x00-\\x1f\\x7f-\\x9f\\u061c\\u200e\\u200f\\u2028-\\u202e\\u2066-\\u2069\\ud800-\\udfff]")
_adapters: dict[type[Any], TypeAdapter[Any]] = {}


def validate(kind: type[Kind], document: Any, where: str) -> Kind:
    """Return `document` as a value of type `kind`. Raise ValueError naming the first wrong value or unknown key."""
    try:
        value: Kind = _adapter(kind).validate_python(document)
    except ValidationError as error:
        first = error.errors()[0]
        path = ".".join((where, *map(str, first["loc"])))
        raise ValueError(f"{path} is {quote(first['input'])}: {first['msg']}") from None
    return value


def read_document(kind: type[Document], file: Path, limit_bytes: int, *, what: str, remedy: str) -> Document:
    """Return the content of a JSON file as type `kind`; error messages call the file a result of `what`.

    Raise Refused `no_result`, `not_a_result`.
    """
    try:
        value = parse_json(read_regular_file(file, limit_bytes), MAX_VALUES)
        return kind.model_validate_json(json.dumps(value), strict=True)  # of JSON, so that a list may be a tuple
    except (UnfitFile, OSError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise Refused("no_result", f"{file} cannot be read: {why}", remedy) from error
    except ValidationError as error:
        first = error.errors()[0]
        if first["loc"] == ("schema",) and isinstance(first.get("input"), str):
            expected = first.get("ctx", {}).get("expected", "another")
            what_else = f"{file} is of the schema {quote(first['input'])}, but this version reads {expected}"
            raise Refused("not_a_result", what_else, "Use the version of the rig that wrote it") from error
        where = ".".join(map(str, first["loc"]))
        why = f"{where}{': ' if where else ''}{first['msg']}"
        raise Refused("not_a_result", f"{file} is not a result of {what}: {why}", remedy) from error
    except UnicodeDecodeError as error:
        raise Refused("not_a_result", f"{file} is not a result of {what}: it is not text", remedy) from error
    except json.JSONDecodeError as error:
        raise Refused("not_a_result", f"{file} is not a result of {what}: it is not JSON: {error}", remedy) from error
    except (ValueError, RecursionError) as error:
        raise Refused("not_a_result", f"{file} is not a result of {what}: {error}", remedy) from error


def parse_json(content: str | bytes, most: int = MAX_RECORDED_VALUES) -> Any:
    """Return the value of a JSON text (RFC 8259) from any source, with its strings made printable.

    Raise ValueError for bytes that are not UTF-8, a number that no measurement can yield (not finite, or too large), a
    duplicate key, or more than `most` values. Raise RecursionError for values that are nested too deeply.
    """
    content = content.encode() if isinstance(content, str) else content
    if sum(map(content.count, SEPARATORS)) > most:
        raise ValueError(f"it holds over {most} values")
    value = json.loads(
        content.decode(),
        parse_float=_parse_number,
        parse_int=_parse_number,
        parse_constant=_parse_number,
        object_pairs_hook=refuse_duplicate_keys,
    )
    return sanitize(value)


def refuse_duplicate_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object of a JSON file. Raise ValueError for a duplicate key."""
    document = dict(pairs)
    if len(document) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key {quote(next(key for key in keys if keys.count(key) > 1))} occurs twice")
    return document


def _parse_number(text: str) -> int | float:
    """Return a number of a JSON file. Raise ValueError for a number that no measurement has."""
    value = float(text)
    if not abs(value) <= MAX_NUMBER:
        raise ValueError(f"{quote(text)} is not a number that can be measured")
    return value if set(text) & set(".eE") else int(text)


def sanitize(value: Any) -> Any:
    """Return a JSON value with hidden characters made visible, for any kind of output. Raise RecursionError."""
    if isinstance(value, str):
        return INVISIBLE.sub(lambda match: printable(match[0]), value)
    if isinstance(value, list):
        return [sanitize(item) for item in value]
    if isinstance(value, dict):
        return {sanitize(key): sanitize(item) for key, item in value.items()}
    return value


def _adapter(kind: type[Any]) -> TypeAdapter[Any]:
    """Return the adapter of a type, cached because building one takes long."""
    if kind not in _adapters:
        _adapters[kind] = TypeAdapter(kind)
    return _adapters[kind]
