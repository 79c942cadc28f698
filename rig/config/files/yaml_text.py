"""Reads YAML from any source: plain data and the line of every key, or a sentence that explains a refusal.

A text much longer or more deeply nested than a usual configuration is refused, as reading it could take long.
"""

import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.errors.quoting import printable, quote, shorten

Location = tuple[int | str, ...]

MAX_BYTES = 65_536  # the longest configuration shipped has 2,500
MAX_NODES = 5_000  # keys and values; an alias counts as often as the nodes it stands for
MAX_DEPTH = 16  # sections within sections
MAX_NUMBER_CHARACTERS = 40

NUMBER_TAGS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")
TEXT_TAG = "tag:yaml.org,2002:str"
NULL_TAG = "tag:yaml.org,2002:null"
MERGE_TAG = "tag:yaml.org,2002:merge"
OTHER_FILES = {  # files given for a configuration by mistake, and where they belong
    ".py": "a Python script, not a configuration; run a procedure of your own with `rig run CONFIG --script FILE.py`",
    ".h5": "a recording, not a configuration; solve it with `rig solve FILE.h5`",
    ".csv": "a table of readings, not a configuration; `rig look FILE.csv` says how to solve it",
}
# Invisible characters: control, format, surrogates, breaks of lines and paragraphs.
INVISIBLE_CATEGORIES = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})


class Unreadable(Exception):
    """The reason why a text cannot be read as a configuration, in one line."""

    def __init__(self, why: str, line: int | None = None) -> None:
        super().__init__(f"line {line}: {why}" if line else why)
        self.why = why


@dataclass(frozen=True, slots=True)
class Document:
    """A text's contents: `data` as YAML reads it, the `lines` of its keys, and the `problems` of its keys and words.

    `written` is the text of every value that YAML reads as something other than text: a number, a date, a boolean.
    """

    data: Any
    lines: Mapping[Location, int]
    written: Mapping[Location, str]
    problems: tuple[str, ...]


def first_control_character(text: str) -> str | None:
    """Return the first control character (escape, carriage return, text direction …); None if there is none."""
    return next((character for character in text if unicodedata.category(character) in INVISIBLE_CATEGORIES), None)


def read_file(path: Path) -> str:
    """Return the text of a regular file of at most `MAX_BYTES`. Raise `Unreadable`."""
    if path.suffix in OTHER_FILES and path.is_file():
        raise Unreadable(f"is {OTHER_FILES[path.suffix]}")
    try:
        content = read_regular_file(path, MAX_BYTES)
    except UnfitFile as unfit:
        raise Unreadable(f"cannot be read: {unfit}") from None
    except OSError as error:
        raise Unreadable(f"cannot be read: {error.strerror}") from None
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise Unreadable(f"cannot be read: byte {error.start + 1} is not UTF-8 text") from None


def read_yaml(text: str) -> Document:
    """Return the content of one YAML document. Raise `Unreadable`."""
    if len(text) > MAX_BYTES:
        raise Unreadable(f"is longer than {MAX_BYTES} characters, so it is not a configuration")
    for number, line in enumerate(text.split("\n"), 1):
        if (character := first_control_character(line.rstrip("\r").replace("\t", " "))) is not None:
            raise Unreadable(f"holds the control character {printable(character)}", number)
    try:
        loader, node = _compose(text)
        lines: dict[Location, int] = {}
        written: dict[Location, str] = {}
        problems = tuple(_survey(node, (), lines, written))
        return Document(None if node is None else loader.construct_document(node), lines, written, problems)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        why = ", ".join(part for part in (error.context, error.problem) if part)
        raise Unreadable(_shorten_words(why), mark.line + 1 if mark else None) from None
    except yaml.YAMLError as error:
        raise Unreadable(_shorten_words(" ".join(str(error).split()))) from None


def _compose(text: str) -> "tuple[_Loader, yaml.Node | None]":
    """Parse a text; return loader and root node. libyaml is five times as fast, PyYAML describes errors better."""
    try:
        loader = _Loader(text, yaml.CSafeLoader(text))
        return loader, loader.get_single_node()
    except yaml.YAMLError:
        loader = _Loader(text)
        return loader, loader.get_single_node()


class _Loader(yaml.SafeLoader):
    """A loader of plain data within limits; `parser`, if given, parses the same text faster."""

    def __init__(self, text: str, parser: yaml.CSafeLoader | None = None) -> None:
        super().__init__(text)
        if parser is not None:
            self.check_event, self.peek_event, self.get_event = parser.check_event, parser.peek_event, parser.get_event
        self._depth = self._nodes = 0
        self._size_of: dict[str, int] = {}  # number of nodes that an alias stands for, once all of them are known

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Return the next node, within limits of depth and size; refuse tags and values that contain themselves."""
        event: Any = self.peek_event()
        if isinstance(event, yaml.AliasEvent):
            anchor = str(event.anchor)
            if anchor in self.anchors and anchor not in self._size_of:
                raise _refusal(f"*{shorten(anchor)} refers to a value that contains itself", event.start_mark)
            self._count(self._size_of.get(anchor, 0), event.start_mark)
            return super().compose_node(parent, index)
        if getattr(event, "tag", None) is not None:
            raise _refusal(f"{shorten(event.tag)}: tags are not used in a configuration", event.start_mark)
        if self._depth == MAX_DEPTH:
            raise _refusal(f"more than {MAX_DEPTH} sections or lists within one another", event.start_mark)
        before = self._nodes
        self._count(1, event.start_mark)
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        if event.anchor is not None:
            self._size_of[event.anchor] = self._nodes - before
        return node

    def _count(self, nodes: int, mark: Any) -> None:
        self._nodes += nodes
        if self._nodes > MAX_NODES:
            raise _refusal(f"more than {MAX_NODES} keys and values", mark)

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        if node.tag in NUMBER_TAGS and len(node.value) > MAX_NUMBER_CHARACTERS:
            raise _refusal(f"{shorten(node.value)} is too long for a number", node.start_mark)
        try:
            return super().construct_object(node, deep)
        except (ValueError, OverflowError) as error:  # the 31st of February, a number without digits
            raise _refusal(f"{shorten(str(node.value))} cannot be: {error}", node.start_mark) from None


def _refusal(why: str, mark: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=why, problem_mark=mark)


def _survey(
    node: yaml.Node | None, location: Location, lines: dict[Location, int], written: dict[Location, str]
) -> Iterator[str]:
    """Record the line of every key, and the text of every value that is not a string.

    Yield a problem for each key that is not a word or occurs twice, because YAML would keep the last.
    """
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            line = key.start_mark.line + 1
            if key.tag not in (TEXT_TAG, MERGE_TAG):
                yield f"{format_path(location)} (line {line}): the key {quote(key.value)} is not a word; quote it"
                continue
            path = (*location, key.value)
            if path in lines:
                yield f"{format_path(path)}: given twice, on lines {lines[path]} and {line}"
            lines[path] = line
            yield from _visible(key, path)
            yield from _survey(value, path, lines, written)
    elif isinstance(node, yaml.SequenceNode):
        for index, value in enumerate(node.value):
            yield from _survey(value, (*location, index), lines, written)
    elif isinstance(node, yaml.ScalarNode):
        if node.tag not in (TEXT_TAG, NULL_TAG):
            written[location] = node.value
        yield from _visible(node, location)


def _visible(node: yaml.ScalarNode, location: Location) -> Iterator[str]:
    """Yield a problem for a control character, which an escape sequence in quotes can produce unnoticed."""
    if (character := first_control_character(node.value)) is not None:
        line = node.start_mark.line + 1
        yield f"{format_path(location)} (line {line}): holds the control character {printable(character)}"


def format_path(location: Location) -> str:
    """Return a location in the form `sensors.gyro.rate_hz`; `the file` for the whole of it."""
    return ".".join(shorten(str(part)) for part in location) or "the file"


def _shorten_words(text: str) -> str:
    return " ".join(shorten(word) for word in text.split())
