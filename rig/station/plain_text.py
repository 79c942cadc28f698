"""Texts from outside (serial numbers, names, paths) as they may be shown: nothing in them commands the terminal."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.text import Text


def printable(text: str) -> str:
    """The text with every control character, line ends too, written as an escape: `\\x1b`, `\\n`."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def printable_lines(text: str) -> str:
    """The same for a message of several lines, which keeps them."""
    return "\n".join(map(printable, text.split("\n")))


def plain(text: str, style: str = "") -> "Text":
    """The printable text for rich, which searches a string for markup such as `[red]` and for `:smileys:`."""
    from rich.text import Text

    return Text(printable(text), style)
