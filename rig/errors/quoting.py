"""Quotation of foreign texts (serial numbers, names, paths, values) without control characters for a terminal."""

from collections.abc import Iterable
from typing import Any

SHOWN_CHARACTERS = 60
SHOWN_NAMES = 12
NO_BREAK_SPACE = "\N{NO-BREAK SPACE}"


def printable(text: str) -> str:
    """Return the text with every invisible character, including line ends, in Python's notation: `\\x1b`, `\
    `.

    A no-break space stays: it separates a number from its power of ten or its unit.
    """
    if text.isprintable():
        return text
    shows = (c.isprintable() or c == NO_BREAK_SPACE for c in text)
    return "".join(c if s else c.encode("unicode_escape").decode("ascii") for c, s in zip(text, shows, strict=True))


def printable_lines(text: str) -> str:
    """Return a printable message that keeps its lines."""
    return "\n".join(map(printable, text.split("\n")))


def shorten(text: str) -> str:
    """Return the beginning of a long text in printable form, with the text's length."""
    shown = printable(text[:SHOWN_CHARACTERS])
    return shown if len(text) <= SHOWN_CHARACTERS else f"{shown}… ({len(text)} characters)"


def quote(value: Any) -> str:
    """Return a value in Python's notation, shortened."""
    return shorten(repr(value))


def listing(names: Iterable[str]) -> str:
    """Return the first of many names, which are already shortened, and the number of the others."""
    every = list(names)
    more = len(every) - SHOWN_NAMES
    return (", ".join(every[:SHOWN_NAMES]) + (f", and {more} more" if more > 0 else "")) or "none"
