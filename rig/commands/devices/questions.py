"""Asks at the terminal what the command line has not said; without a terminal the option is named that says it."""

import sys
from collections.abc import Callable, Mapping

from rig.errors import Refused
from rig.errors.quoting import printable
from rig.station.plain_text import say


def answered(
    question: str, option: str, valid: Callable[[str], str] = str, usual: str | None = None, given: str | None = None
) -> str:
    """Return the answer to a question: what is `given` by the option, or what is typed, asked again until it is valid.

    `valid` returns an answer as it is used, and raises ValueError for one that cannot be. `usual` is what Enter means.
    Raise Refused `not_answered`, and `bad_option` for a given answer that is not valid.
    """
    if given is not None:
        try:
            return valid(given)
        except ValueError as error:
            raise Refused("bad_option", f"{option} {printable(given)}: {error}", "Give another value") from None
    while True:
        typed = _typed(question, option, usual)
        try:
            return valid(typed)
        except ValueError as error:
            say(f"  {error}", sys.stderr)


def chosen(question: str, option: str, choices: Mapping[str, str], given: str | None = None) -> str:
    """Return the key of one of the choices, by its number or by itself; Enter means the first. Raise as `answered`."""
    keys = [*choices]

    def key_of(text: str) -> str:
        if text in choices:
            return text
        if text.isdecimal() and 0 < int(text) <= len(keys):
            return keys[int(text) - 1]
        raise ValueError(f"type a number from 1 to {len(keys)}")

    if given is None:
        _refuse_without_terminal(question, option)
        say(question, sys.stderr)
        for number, words in enumerate(choices.values(), 1):
            say(f"  {number}  {words}", sys.stderr)
    return answered("  number", option, key_of, usual="1", given=given)


def _refuse_without_terminal(question: str, option: str) -> None:
    if not sys.stdin.isatty():
        raise _nobody(question, option)


def _nobody(question: str, option: str) -> Refused:
    what = f"there is no terminal at which this could be answered: {question}"
    return Refused("not_answered", what, f"Give the answer with {option}")


def _typed(question: str, option: str, usual: str | None) -> str:
    from rich.console import Console
    from rich.prompt import Prompt

    _refuse_without_terminal(question, option)
    try:
        console = Console(stderr=True, highlight=False, markup=False)
        typed = Prompt.ask(question, console=console, default=usual, show_default=usual is not None)
    except EOFError:
        raise _nobody(question, option) from None
    return (typed or "").strip()
