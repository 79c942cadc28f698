"""The questions before something moves or changes, their answers, and the terminal that asks them."""

import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal, Protocol

from rig.errors.quoting import printable_lines
from rig.station.plain_text import format_for_file

Kind = Literal["number", "mount", "go", "doubt", "again"]


@dataclass(frozen=True, slots=True)
class Choice:
    """A possible answer to a question: the `words` that may be typed, its `label` on a button, whether it means yes."""

    words: tuple[str, ...]
    label: str
    yes: bool


# The first choice is the primary one: the safe one wherever there is doubt. Except for the plain "yes", no word
# confirms two different questions, so an answer that comes too late starts nothing.
CHOICES: Mapping[Kind, tuple[Choice, ...]] = {
    "number": (),
    "mount": (Choice(("",), "It is mounted", True), Choice(("no", "n"), "Put it aside", False)),
    "go": (Choice(("go",), "Go", True), Choice(("no", "n"), "Do not start", False)),
    "doubt": (Choice(("no", "n"), "No", False), Choice(("yes", "y"), "Continue anyway", True)),
    "again": (Choice(("yes", "y"), "Again", True), Choice(("no", "n"), "Put it aside", False)),
}
COMMAND_WORDS = frozenset(word for choices in CHOICES.values() for choice in choices for word in choice.words if word)


@dataclass(frozen=True, slots=True)
class Question:
    """A question of a `kind`: the `lines` before it, its `text`, and a `hint` after an input that was not an answer."""

    kind: Kind
    text: str
    lines: tuple[str, ...] = ()
    hint: str = ""

    @property
    def choices(self) -> tuple[Choice, ...]:
        """The possible answers; empty if the question asks for a number."""
        return CHOICES[self.kind]

    def meaning(self, answer: str) -> bool | None:
        """Return True for yes and False for no; None if the text is not an answer to this question."""
        typed = answer.lower()
        return next((choice.yes for choice in self.choices if typed in choice.words), None)

    def after_no_answer(self, answer: str) -> "Question":
        """Return the question with a hint that `answer` does not answer it."""
        expected = " or ".join(choice.words[0] or "Enter" for choice in self.choices) or "a serial number"
        return replace(self, hint=f'"{answer}" does not answer this question: {expected}')


class Voice(Protocol):
    """The interface to an operator; an answer has no white space around it, and is None if the operator has left."""

    def answer(self, question: Question) -> str | None: ...


class Terminal:
    """The keyboard of the terminal, or a scanner that ends each number with Enter."""

    def answer(self, question: Question) -> str | None:
        """Return the text typed after the question; earlier input is ignored. None if the terminal is closed."""
        _forget_what_was_typed()
        for line in (question.hint,) if question.hint else question.lines:
            print(format_for_file(printable_lines(line), sys.stderr), file=sys.stderr)
        print(format_for_file(printable_lines(question.text), sys.stderr), end=" ", file=sys.stderr, flush=True)
        line = sys.stdin.readline()
        return line.strip() if line else None


def question_before(announcement: Sequence[str], to_do: str) -> Question:
    """Return the question before an announced action: the answer `go` permits motion, `yes` any other action."""
    from rig.station.events import Prompt

    if to_do == Prompt(()).to_do:  # the default action, which permits motion
        return Question("go", f"Type go to {to_do}, or no:", tuple(announcement))
    return Question("doubt", f"Type yes to {to_do}, or no:", tuple(announcement))


def is_agreed(voice: Voice, question: Question) -> bool:
    """Ask until an answer is one of the question's choices, and return its meaning; False if the operator has left."""
    while (answer := voice.answer(question)) is not None:
        if (yes := question.meaning(answer)) is not None:
            return yes
        question = question.after_no_answer(answer)
    return False


def _forget_what_was_typed() -> None:
    """Discard lines typed at the terminal before the question."""
    with suppress(ImportError):  # a system with other terminals
        import termios

        with suppress(termios.error, OSError, ValueError):  # no terminal
            termios.tcflush(sys.stdin, termios.TCIFLUSH)
