"""Asks the operator before an action that cannot be reversed."""

import sys
from collections.abc import Sequence

from rig.errors import Refused
from rig.errors.quoting import printable_lines
from rig.station.plain_text import format_for_file
from rig.station.questions import Terminal, is_agreed, question_before

AGREEMENT_REMEDY = "Run again and agree, or agree in advance: --yes, in Python yes=True"


def ask_operator(announcement: Sequence[str], to_do: str = "start") -> bool:
    """Show what will be done and ask until the operator agrees or declines; return False without a terminal.

    Input typed before the question is ignored.
    """
    if sys.stdin.isatty():
        return is_agreed(Terminal(), question_before(announcement, to_do))
    for line in announcement:
        print(format_for_file(printable_lines(line), sys.stderr), file=sys.stderr)
    return False


def require_agreement(announcement: Sequence[str], to_do: str, assume_yes: bool) -> None:
    """Raise Refused `not_confirmed` unless the operator agrees, now or in advance (`assume_yes`)."""
    if not assume_yes and not ask_operator(announcement, to_do):
        raise Refused("not_confirmed", "the operator did not agree to the change", AGREEMENT_REMEDY)


def refuse_unless_answerable(assume_yes: bool) -> None:
    """Raise Refused `not_confirmed`, before a long action, if no terminal can answer the question at its end."""
    if not assume_yes and not sys.stdin.isatty():
        raise Refused("not_confirmed", "there is no terminal at which to agree to the change", AGREEMENT_REMEDY)
