"""Texts with something from outside in them (serial numbers, names, paths) on stdout, stderr and in tables."""

import sys
from typing import TYPE_CHECKING, TextIO

from rig.errors.quoting import printable

if TYPE_CHECKING:
    from rich.text import Text


LONG_S = 600.0  # from then on one thinks in minutes


def say(text: str, file: TextIO | None = None) -> None:
    """One printable line, on stdout unless told otherwise."""
    print(printable(text), file=file)


def say_on_terminal(doing: str) -> None:
    """What goes on, for who waits for it at a terminal; a program that reads stderr has no use for it."""
    if sys.stderr.isatty():
        print(f"{printable(doing)} …", file=sys.stderr, flush=True)


def plain(text: str, style: str = "") -> "Text":
    """The printable text for rich, which searches a string for markup such as `[red]` and for `:smileys:`."""
    from rich.text import Text

    return Text(printable(text), style)


def duration_words(duration_s: float) -> str:
    """`66 s`, `5 h 36 min`: how long something takes, as one says it."""
    if duration_s < LONG_S:
        return f"{duration_s:.0f} s"
    hours, minutes = divmod(round(duration_s / 60), 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"
