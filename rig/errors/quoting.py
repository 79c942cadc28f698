"""Shows what somebody else wrote: serial numbers, names, paths, values. Nothing in it that a terminal would obey."""

from collections.abc import Iterable
from typing import Any

SHOWN_CHARACTERS = 60
SHOWN_NAMES = 12
NO_BREAK_SPACE = "\N{NO-BREAK SPACE}"


def printable(text: str) -> str:
    """Return the text with every invisible character, line ends too, written as Python does: `\\x1b`, `\\n`.

    A no-break space stays: it stands between a number and its power of ten or its unit.
    """
    if text.isprintable():
        return text
    shows = (c.isprintable() or c == NO_BREAK_SPACE for c in text)
    return "".join(c if s else c.encode("unicode_escape").decode("ascii") for c, s in zip(text, shows, strict=True))


def printable_lines(text: str) -> str:
    """A message of several lines made printable, which keeps its lines."""
    return "\n".join(map(printable, text.split("\n")))


def shorten(text: str) -> str:
    """The beginning of what is long, and how long it is; printable."""
    shown = printable(text[:SHOWN_CHARACTERS])
    return shown if len(text) <= SHOWN_CHARACTERS else f"{shown}… ({len(text)} characters)"


def quote(value: Any) -> str:
    """A value as Python writes it, shortened."""
    return shorten(repr(value))


def listing(names: Iterable[str]) -> str:
    """The first of many names, which are shortened already, and how many more there are."""
    every = list(names)
    more = len(every) - SHOWN_NAMES
    return (", ".join(every[:SHOWN_NAMES]) + (f", and {more} more" if more > 0 else "")) or "none"
