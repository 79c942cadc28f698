"""Texts with something from outside in them (serial numbers, names, paths) on stdout, stderr and in tables."""

from typing import TYPE_CHECKING, TextIO

from rig.errors.quoting import printable

if TYPE_CHECKING:
    from rich.text import Text


def say(text: str, file: TextIO | None = None) -> None:
    """One printable line, on stdout unless told otherwise."""
    print(printable(text), file=file)


def plain(text: str, style: str = "") -> "Text":
    """The printable text for rich, which searches a string for markup such as `[red]` and for `:smileys:`."""
    from rich.text import Text

    return Text(printable(text), style)
