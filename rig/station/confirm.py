"""Asks the operator before an action that cannot be reversed."""

import sys
from collections.abc import Sequence
from contextlib import suppress

from rig.errors import Refused
from rig.errors.quoting import printable_lines
from rig.station.plain_text import for_file

NOT_AGREED = "Run again and agree, or agree in advance: --yes, in Python yes=True"


def ask_operator(announcement: Sequence[str], to_do: str = "start") -> bool:
    """Show the planned action and wait for yes or y; return False without a terminal.

    Input typed before the question does not count.
    """
    forget_what_was_typed()
    for line in announcement:
        print(for_file(printable_lines(line), sys.stderr), file=sys.stderr)
    if not sys.stdin.isatty():
        return False
    print(f"Type yes to {to_do}: ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("yes", "y")


def forget_what_was_typed() -> None:
    """Discard lines that wait at the terminal, because they cannot answer a question not shown yet."""
    with suppress(ImportError):  # a system with other terminals
        import termios

        with suppress(termios.error, OSError, ValueError):  # no terminal
            termios.tcflush(sys.stdin, termios.TCIFLUSH)


def agreed_or_refused(announcement: Sequence[str], to_do: str, assume_yes: bool) -> None:
    """Raise Refused `not_confirmed` unless the operator agrees."""
    if not assume_yes and not ask_operator(announcement, to_do):
        raise Refused("not_confirmed", "the operator did not agree to the change", NOT_AGREED)


def refuse_unless_answerable(assume_yes: bool) -> None:
    """Raise Refused `not_confirmed` without a terminal, before a long action that ends with a question."""
    if not assume_yes and not sys.stdin.isatty():
        raise Refused("not_confirmed", "there is no terminal at which to agree to the change", NOT_AGREED)
