"""Texts with something from outside in them (serial numbers, names, paths) on stdout, stderr and in tables."""

import os
import re
import sys
from typing import TYPE_CHECKING, TextIO

from rig.errors.quoting import printable

if TYPE_CHECKING:
    from rich.text import Text


LONG_S = 600.0  # from then on one thinks in minutes
NARROWEST, USUAL = 30, 80  # columns of a terminal: where lines are still broken between words, and without an answer
INDENT = "  "
COMMAND = re.compile("(`[^`]*`|(?<=: )rig .*$)")  # what is copied: between backticks, or the end of a line
UNBROKEN = "\N{NO-BREAK SPACE}"


def say(text: str, file: TextIO | None = None) -> None:
    """One printable line, on stdout unless told otherwise; a terminal gets it broken between words."""
    file = sys.stdout if file is None else file
    print(for_file(printable(text), file), file=file)


def say_on_terminal(doing: str) -> None:
    """What goes on, for who waits for it at a terminal; a program that reads stderr has no use for it."""
    if sys.stderr.isatty():
        print(f"{printable(doing)} …", file=sys.stderr, flush=True)


def for_file(text: str, file: TextIO) -> str:
    """A message in lines for stderr or its like: broken between words where it is a terminal, else as it is."""
    if not file.isatty():
        return text
    width = _columns(file)
    if width < NARROWEST:
        return text
    return "\n".join(each for line in text.split("\n") for each in wrapped(line, width) or [""])


def wrapped(text: str, width: int) -> list[str]:
    """One line's text in lines of at most `width`; a command and a long word stay whole, whatever their length."""
    import textwrap

    whole = "".join(part.replace(" ", UNBROKEN) if i % 2 else part for i, part in enumerate(COMMAND.split(text)))
    lines = textwrap.wrap(whole, width, subsequent_indent=INDENT, break_long_words=False, break_on_hyphens=False)
    return [line.replace(UNBROKEN, " ") for line in lines]


def _columns(file: TextIO) -> int:
    stated = os.environ.get("COLUMNS", "")
    try:
        return int(stated) if stated.isdecimal() else os.get_terminal_size(file.fileno()).columns
    except OSError:
        return USUAL


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
