"""Text is taken as text: where a key holds words, a value that YAML reads as a number is what was written, `0017`."""

import types
import typing
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from rig.config.files.yaml_text import Location


def take_text_as_written(model: type[BaseModel], data: Any, prefix: Location, written: Mapping[Location, str]) -> None:
    """Put into `data`, a section of `model` that stands at `prefix`, the words that were `written` where it holds text.

    YAML makes 15 of a serial number 0017, and a date of 2026-11-20.
    """
    if isinstance(data, dict):
        for key, field in model.model_fields.items():
            if key in data:
                data[key] = _as_text(field.annotation, data[key], (*prefix, key), written)


def _as_text(annotation: Any, value: Any, place: Location, written: Mapping[Location, str]) -> Any:
    """`value` of a key that holds what `annotation` says, its texts as they were written."""
    kinds = _kinds(annotation)
    if str in kinds and not isinstance(value, (str, dict, list)) and place in written:
        return written[place]
    for kind in kinds:
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            take_text_as_written(kind, value, place, written)
        elif typing.get_origin(kind) is dict and isinstance(value, dict):
            of_each = typing.get_args(kind)[1]
            value = {key: _as_text(of_each, each, (*place, key), written) for key, each in value.items()}
        elif typing.get_origin(kind) in (tuple, list) and isinstance(value, list):
            of_each = typing.get_args(kind)[0]
            value = [_as_text(of_each, each, (*place, index), written) for index, each in enumerate(value)]
    return value


def _kinds(annotation: Any) -> tuple[Any, ...]:
    """What an annotation allows: each of a union by itself, without what is said of it beside its type."""
    origin = typing.get_origin(annotation)
    if origin is typing.Annotated:
        return _kinds(typing.get_args(annotation)[0])
    if origin in (typing.Union, types.UnionType):
        return tuple(kind for each in typing.get_args(annotation) for kind in _kinds(each))
    return (annotation,)
