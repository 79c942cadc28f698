"""Questions at the terminal for values that the command line lacks; without a terminal an error names the option."""

import sys
from collections.abc import Callable, Mapping
from typing import TypeVar

from rig.errors import Refused
from rig.errors.quoting import printable
from rig.station.plain_text import say

KeyT = TypeVar("KeyT", bound=str)


def ask(
    question: str, option: str, valid: Callable[[str], str] = str, usual: str | None = None, value: str | None = None
) -> str:
    """Return the answer to a question: the option's value, or text typed by the user, requested until it is valid.

    `valid` converts an answer and raises ValueError for an invalid one. Enter alone answers `usual`. Raise Refused
    `not_answered`, and `bad_option` for an invalid option.
    """
    if value is not None:
        try:
            return valid(value)
        except ValueError as error:
            raise Refused("bad_option", f"{option} {printable(value)}: {error}", "Give another value") from None
    while True:
        typed = _read_typed(question, option, usual)
        try:
            return valid(typed)
        except ValueError as error:
            say(f"  {error}", sys.stderr)


def ask_choice(
    question: str, option: str, choices: Mapping[KeyT, str], value: str | None = None, usual: KeyT | None = None
) -> KeyT:
    """Return the key of a choice, typed by name or number; Enter selects `usual`, or the first. Raise as `ask` does."""
    keys = [*choices]

    def key_of(text: str) -> str:
        if text in choices:
            return text
        if text.isdecimal() and 0 < int(text) <= len(keys):
            return keys[int(text) - 1]
        raise ValueError(f"type a number from 1 to {len(keys)}")

    if value is None:
        _refuse_without_terminal(question, option)
        say(question, sys.stderr)
        for number, words in enumerate(choices.values(), 1):
            say(f"  {number}  {words}", sys.stderr)
    usual_number = 1 if usual is None else keys.index(usual) + 1
    answer = ask("  number", option, key_of, usual=str(usual_number), value=value)
    return next(key for key in keys if key == answer)


def _refuse_without_terminal(question: str, option: str) -> None:
    if not sys.stdin.isatty():
        raise _no_terminal(question, option)


def _no_terminal(question: str, option: str) -> Refused:
    what = f"there is no terminal to answer this question: {question}"
    return Refused("not_answered", what, f"Give the answer with {option}")


def _read_typed(question: str, option: str, usual: str | None) -> str:
    from rich.console import Console
    from rich.prompt import Prompt

    _refuse_without_terminal(question, option)
    try:
        console = Console(stderr=True, highlight=False, markup=False)
        typed = Prompt.ask(question, console=console, default=usual, show_default=usual is not None)
    except EOFError:
        raise _no_terminal(question, option) from None
    return (typed or "").strip()
