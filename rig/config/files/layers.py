"""Configurations based on one another by `base: demo.yaml`, and overrides `--set path=value` on top."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rig.config.files.yaml_text import MAX_DEPTH, Location, Unreadable, first_control_character, read_file, read_yaml
from rig.errors.quoting import quote, shorten

BASE_KEY = "base"
SET = "--set"
MAX_FILES = 8  # files based on one another

Places = Mapping[Location, str]  # position of each key, in words: "line 3", "demo.yaml, line 3", "--set"


@dataclass(frozen=True, slots=True)
class MergedLayers:
    """The merged layers: the `document`, the `places` of its keys in files, and the `problems` of merging.

    `written` is the text of every value that YAML reads as something other than text. `text` is the text of a single
    file; None if several are merged.
    """

    document: dict[str, Any]
    places: Places
    written: Mapping[Location, str]
    problems: tuple[str, ...]
    text: str | None


@dataclass(frozen=True, slots=True)
class _Layer:
    """One of the files on which a configuration is based, before merging."""

    data: dict[str, Any]
    places: Places
    written: Mapping[Location, str]
    problems: tuple[str, ...]


def read_layers(path: Path, overrides: Sequence[str] = ()) -> MergedLayers:
    """Return a file merged with the files that it is based on, and with the overrides. Raise `Unreadable`."""
    return merge_layers(read_file(path), path, overrides)


def merge_layers(text: str, path: Path | None, overrides: Sequence[str] = ()) -> MergedLayers:
    """Return a text merged with its base files, named relative to `path`, and with overrides. Raise `Unreadable`."""
    layers = list(_layers(text, path))
    document: dict[str, Any] = {}
    places: dict[Location, str] = {}
    written: dict[Location, str] = {}
    problems: list[str] = []
    for layer in reversed(layers):
        document = merge(document, layer.data)
        places |= layer.places
        written |= layer.written
        problems += layer.problems
    for item in overrides:
        problems += _override(document, places, written, item)
    return MergedLayers(document, places, written, tuple(problems), None if overrides or len(layers) > 1 else text)


def merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Return `base` changed by `over`: sections key by key, lists and values as a whole; null removes a key."""
    merged = dict(base)
    for key, value in over.items():
        below = merged.get(key)
        if value is None and key in merged:
            del merged[key]
        elif isinstance(value, dict):
            merged[key] = merge(below if isinstance(below, dict) else {}, value)
        else:
            merged[key] = value
    return merged


def _layers(text: str, path: Path | None) -> Iterator[_Layer]:
    """Yield a file, then the files that it is based on."""
    layer, names = _layer(text, ""), ["this file"]
    files = []
    while BASE_KEY in layer.data:
        where, wanted = f"{BASE_KEY} ({layer.places[(BASE_KEY,)]})", layer.data.pop(BASE_KEY)
        yield layer
        if path is None:
            raise Unreadable(f"{where}: only a file can build on another")
        if not isinstance(wanted, str):
            raise Unreadable(f"{where}: {quote(wanted)}: must be the name of a file")
        files.append(path.resolve())
        names.append(shorten(wanted))
        path = path.parent / wanted
        try:
            text = read_file(path)
        except Unreadable as error:
            raise Unreadable(f"{where}: {shorten(wanted)} {error.why}") from None
        if path.resolve() in files:
            raise Unreadable(f"{where}: the files build on one another in a circle: {' → '.join(names)}")
        if len(files) == MAX_FILES:
            raise Unreadable(f"{where}: more than {MAX_FILES} files one on another: {' → '.join(names)}")
        layer = _layer(text, shorten(wanted))
    yield layer


def _layer(text: str, name: str) -> _Layer:
    """Return the layer in one file's text. `name` is that of a base file, "" for the file itself."""
    try:
        document = read_yaml(text)
        if not isinstance(document.data, dict):
            raise Unreadable("the file must be a mapping with the keys arm, board, sensors, limits")
    except Unreadable as error:
        raise Unreadable(f"{name}: {error}" if name else str(error)) from None
    prefix = f"{name}, " if name else ""
    places = {location: f"{prefix}line {line}" for location, line in document.lines.items()}
    return _Layer(
        document.data, places, document.written, tuple(f"{name}: {it}" if name else it for it in document.problems)
    )


def _override(
    document: dict[str, Any], places: dict[Location, str], written: dict[Location, str], item: str
) -> Iterator[str]:
    """Apply one `a.b.c=value` in place; yield a problem if this is impossible."""
    path, equals, value = item.partition("=")
    path = path.strip()
    what = f"{SET} {shorten(item)}"
    if not path or not equals or not value.strip():
        yield f"{what}: must be path=value, for example {_example(item)}"
        return
    if first_control_character(path) is not None:
        yield f"{what}: holds a control character"
        return
    *parents, last = location = tuple(path.split("."))
    if len(location) > MAX_DEPTH:
        yield f"{what}: more than {MAX_DEPTH} sections within one another"
        return
    if location[0] == BASE_KEY:
        yield f"{what}: {BASE_KEY} can only be given in the file"
        return
    try:
        parsed = read_yaml(value)
    except Unreadable as error:
        yield f"{what}: {error.why}"
        return
    yield from (f"{what}: {problem}" for problem in parsed.problems)
    section = document
    for depth, parent in enumerate(parents, start=1):
        if parent not in section:
            places[location[:depth]] = SET
        below = section.setdefault(parent, {})
        if not isinstance(below, dict):
            yield f"{what}: {shorten(parent)} is not a section"
            return
        section = below
    if parsed.data is None and last in section:
        del section[last]
    else:
        section[last] = parsed.data
    for replaced in [key for key in places if key[: len(location)] == location]:
        del places[replaced]
    places |= {(*location, *below): SET for below in ((), *parsed.lines)}
    written |= {(*location, *below): letters for below, letters in parsed.written.items()}


def _example(item: str) -> str:
    """Return an example of a valid override: `item` with "=" in place of ":", or a fixed one if `item` has no value."""
    path, colon, value = item.partition(":")
    return f"{path.strip()}={value.strip()}" if colon and value.strip() else "procedure.speed_deg_s=30"
