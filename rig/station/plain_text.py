"""Texts with foreign parts (serial numbers, names, paths) on stdout, stderr and in tables."""

import os
import re
import sys
from typing import TYPE_CHECKING, Any, TextIO

from rig.errors.quoting import printable

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from rich.table import Table
    from rich.text import Text

MINUTES_FROM_S = 600.0  # longer durations are shown in minutes
MIN_WIDTH, DEFAULT_WIDTH = 30, 80  # columns of a terminal: the least for breaking lines, and the default
INDENT = "  "
COMMAND = re.compile("(`[^`]*`|(?<=: )rig .*$)")  # between backticks, or at the end of a line
NBSP = "\N{NO-BREAK SPACE}"


def say(text: str, file: TextIO | None = None) -> None:
    """Print one printable line, on stdout by default; for a terminal it is broken between words."""
    file = sys.stdout if file is None else file
    print(format_for_file(printable(text), file), file=file)


def say_on_terminal(doing: str) -> None:
    """Print the present activity on a terminal only, not for a program that reads stderr."""
    if sys.stderr.isatty():
        print(f"{printable(doing)} …", file=sys.stderr, flush=True)


def format_for_file(text: str, file: TextIO) -> str:
    """Return a message for a file such as stderr, broken between words if that is a terminal."""
    if not file.isatty():
        return text
    width = _columns(file)
    if width < MIN_WIDTH:
        return text
    return "\n".join(row for line in text.split("\n") for row in wrap_line(line, width) or [""])


def wrap_line(text: str, width: int) -> list[str]:
    """Return the text of one line, broken into lines of at most `width`; a command or a long word is not broken."""
    import textwrap

    unbroken = "".join(part.replace(" ", NBSP) if i % 2 else part for i, part in enumerate(COMMAND.split(text)))
    lines = textwrap.wrap(unbroken, width, subsequent_indent=INDENT, break_long_words=False, break_on_hyphens=False)
    return [line.replace(NBSP, " ") for line in lines]


def _columns(file: TextIO) -> int:
    stated = os.environ.get("COLUMNS", "")
    try:
        return int(stated) if stated.isdecimal() else os.get_terminal_size(file.fileno()).columns
    except OSError:
        return DEFAULT_WIDTH


def plain(text: str, style: str = "") -> "Text":
    """Return printable text for the library rich, which would interpret `[red]` and `:smileys:` in a string."""
    from rich.text import Text

    return Text(printable(text), style)


def build_number_table(
    headings: "Iterable[str]", title: str = "", texts: "Collection[str]" = ("axis",), **style: Any
) -> "Table":
    """Return a table without rows; the columns of the headings in `texts` begin at the left."""
    from rich.table import Table

    table = Table(title=plain(title, "table.title") if title else None, title_justify="left", **style)
    for heading in headings:
        table.add_column(heading, justify="left" if heading in texts else "right")
    return table


def duration_words(duration_s: float) -> str:
    """Return a duration in words: `66 s`, `5 h 36 min`."""
    if duration_s < MINUTES_FROM_S:
        return f"{duration_s:.0f} s"
    hours, minutes = divmod(round(duration_s / 60), 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"
