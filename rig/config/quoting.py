"""Quotes what somebody else wrote: short, on one line, and nothing in it that a terminal would obey."""

import unicodedata
from typing import Any

SHOWN_CHARACTERS = 60
UNSEEN = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})  # control, format, half a pair, breaks of lines and paragraphs


def first_control_character(text: str) -> str | None:
    """The first character that does something instead of being seen: escape, carriage return, text direction …"""
    return next((character for character in text if unicodedata.category(character) in UNSEEN), None)


def escape(text: str) -> str:
    """`text` with its control characters written as Python does, `\\x1b`."""
    if first_control_character(text) is None:
        return text
    return "".join(c.encode("unicode_escape").decode() if unicodedata.category(c) in UNSEEN else c for c in text)


def shorten(text: str) -> str:
    """The beginning of what is long, and how long it is; safe to print."""
    text = escape(text)
    return text if len(text) <= SHOWN_CHARACTERS else f"{text[:SHOWN_CHARACTERS]}… ({len(text)} characters)"


def quote(value: Any) -> str:
    """A value as Python writes it, shortened."""
    return shorten(repr(value))
