"""Quotation of foreign texts (serial numbers, names, paths, values) without control characters for a terminal."""

from collections.abc import Iterable
from typing import Any

from firmware_host.problem import printable

__all__ = ["list_first", "printable", "printable_lines", "quote", "shorten"]
MAX_CHARACTERS = 60
MAX_NAMES = 12


def printable_lines(text: str) -> str:
    """Return a printable message with the same line breaks."""
    return "\n".join(map(printable, text.split("\n")))


def shorten(text: str) -> str:
    """Return the beginning of a long text in printable form, with the text's length."""
    shown = printable(text[:MAX_CHARACTERS])
    return shown if len(text) <= MAX_CHARACTERS else f"{shown}… ({len(text)} characters)"


def quote(value: Any) -> str:
    """Return a value in Python's notation, shortened."""
    return shorten(repr(value))


def list_first(names: Iterable[str]) -> str:
    """Return the first `MAX_NAMES` names in one text, and the number of the others; no name is shortened."""
    every = list(names)
    more = len(every) - MAX_NAMES
    return (", ".join(every[:MAX_NAMES]) + (f", and {more} more" if more > 0 else "")) or "none"
