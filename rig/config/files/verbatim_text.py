"""Texts as written, such as `0017`, for keys that expect text, even if YAML reads a number."""

import types
import typing
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from rig.config.files.yaml_text import Location


def take_text_as_written(model: type[BaseModel], data: Any, prefix: Location, written: Mapping[Location, str]) -> None:
    """Restore in place the texts of a section (`data`) of type `model` at `prefix` to their spelling in the file.

    YAML reads a serial number 0017 as 15, and 2026-11-20 as a date. `written` has the spelling by location.
    """
    if isinstance(data, dict):
        for name, field in model.model_fields.items():
            if (key := field.alias or name) in data:
                data[key] = _restore_text(field.annotation, data[key], (*prefix, key), written)


def _restore_text(annotation: Any, value: Any, location: Location, written: Mapping[Location, str]) -> Any:
    """Return the `value` of a key of type `annotation`, with its texts as written."""
    kinds = _kinds(annotation)
    if str in kinds and not isinstance(value, (str, dict, list)) and location in written:
        return written[location]
    for kind in kinds:
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            take_text_as_written(kind, value, location, written)
        elif typing.get_origin(kind) is dict and isinstance(value, dict):
            item_type = typing.get_args(kind)[1]
            value = {key: _restore_text(item_type, item, (*location, key), written) for key, item in value.items()}
        elif typing.get_origin(kind) in (tuple, list) and isinstance(value, list):
            item_type = typing.get_args(kind)[0]
            value = [_restore_text(item_type, item, (*location, index), written) for index, item in enumerate(value)]
    return value


def _kinds(annotation: Any) -> tuple[Any, ...]:
    """Return the types that an annotation allows: the members of a union, without the metadata of `Annotated`."""
    origin = typing.get_origin(annotation)
    if origin is typing.Annotated:
        return _kinds(typing.get_args(annotation)[0])
    if origin in (typing.Union, types.UnionType):
        return tuple(kind for member in typing.get_args(annotation) for kind in _kinds(member))
    return (annotation,)
