"""Asks the operator before something is done that cannot be taken back."""

import sys
from collections.abc import Sequence
from contextlib import suppress

from rig.errors import Refused
from rig.errors.quoting import printable_lines
from rig.station.plain_text import for_file

NOT_AGREED = "Run again and agree, or agree before: --yes, in Python yes=True"


def ask_operator(announcement: Sequence[str], to_do: str = "start") -> bool:
    """Show what will be done and wait for yes or y; where there is no terminal, there is nobody to say it.

    What was typed before that was shown is no answer.
    """
    forget_what_was_typed()
    for line in announcement:
        print(for_file(printable_lines(line), sys.stderr), file=sys.stderr)
    if not sys.stdin.isatty():
        return False
    print(f"Type yes to {to_do}: ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("yes", "y")


def forget_what_was_typed() -> None:
    """Nobody agrees to what he has not read: lines that wait at the terminal are thrown away."""
    with suppress(ImportError):  # a system that has other terminals
        import termios

        with suppress(termios.error, OSError, ValueError):  # no terminal
            termios.tcflush(sys.stdin, termios.TCIFLUSH)


def agreed_or_refused(announcement: Sequence[str], to_do: str, assume_yes: bool) -> None:
    """Go on only if the operator agrees. Raises Refused `not_confirmed`."""
    if not assume_yes and not ask_operator(announcement, to_do):
        raise Refused("not_confirmed", "nobody agreed to the change", NOT_AGREED)


def refuse_unless_answerable(assume_yes: bool) -> None:
    """Look for a terminal before what takes long and asks at its end. Raises Refused `not_confirmed` where none is."""
    if not assume_yes and not sys.stdin.isatty():
        raise Refused("not_confirmed", "there is no terminal at which somebody could agree to the change", NOT_AGREED)
