"""The operator who names the parts and answers questions, at a terminal or elsewhere; or a list without questions."""

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from typing import Literal, Protocol

from rig.batch.batch_state import BatchPart, Doubt
from rig.batch.part_list import following
from rig.errors import Refused, RigError
from rig.errors.quoting import printable_lines
from rig.station.confirm import forget_what_was_typed
from rig.station.events import Prompt
from rig.station.plain_text import for_file, say

Kind = Literal["number", "mount", "go", "doubt", "again"]


@dataclass(frozen=True, slots=True)
class Choice:
    """An answer of a question: the `words` that may be typed, its `label` on a button, whether it means yes."""

    words: tuple[str, ...]
    label: str
    yes: bool


# The first choice is the primary one: the safe one wherever something is in doubt. No word answers two questions with
# yes except the plain "yes", so an answer to one question starts nothing at another.
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
    """A question of a `kind`: the `lines` before it, its `text`, and a `hint` on the last answer if it was none."""

    kind: Kind
    text: str
    lines: tuple[str, ...] = ()
    hint: str = ""

    @property
    def choices(self) -> tuple[Choice, ...]:
        """The possible answers; empty if the question asks for a number."""
        return CHOICES[self.kind]

    def meaning(self, answer: str) -> bool | None:
        """Return True for yes and False for no; None if the text does not answer this question."""
        typed = answer.lower()
        return next((choice.yes for choice in self.choices if typed in choice.words), None)

    def after_no_answer(self, answer: str) -> "Question":
        """Return the question with a hint, to be asked again after an invalid answer."""
        expected = " or ".join(choice.words[0] or "Enter" for choice in self.choices) or "a serial number"
        return replace(self, hint=f'"{answer}" does not answer this question: {expected}')


class Voice(Protocol):
    """The way to ask an operator; an answer has no white space around it. It is None if the operator has left."""

    def answer(self, question: Question) -> str | None: ...


class Terminal:
    """The keyboard of the terminal. A scanner is a keyboard that ends each number with Enter."""

    def answer(self, question: Question) -> str | None:
        """Return the text typed after the question, ignoring earlier input; None if the terminal has gone."""
        forget_what_was_typed()
        for line in (question.hint,) if question.hint else question.lines:
            print(for_file(printable_lines(line), sys.stderr), file=sys.stderr)
        print(printable_lines(question.text), end=" ", file=sys.stderr, flush=True)
        line = sys.stdin.readline()
        return line.strip() if line else None


@dataclass(frozen=True, slots=True)
class Operator:
    """The operator, asked by a `voice`, or a list of `numbers`; an empty number ends the batch.

    Without a voice no questions are asked, so a doubt cannot be overridden. Numbers of a list are taken one after the
    other: a refused one is entered in the table, whereas a typed one is typed again. `asking` is open during a question
    between two runs, with its subject, such as "to mount the part".
    """

    voice: Voice | None
    numbers: Sequence[str] | None = None
    asking: Callable[[str], AbstractContextManager[None]] = lambda what: nullcontext()

    @property
    def attended(self) -> bool:
        """Whether an operator can answer."""
        return self.voice is not None

    @property
    def listed(self) -> bool:
        """Whether the numbers come from a list."""
        return self.numbers is not None

    def next_part(self, done: Sequence[BatchPart], why: str = "") -> str | None:
        """Return the next serial number, from the list or typed; `why` is the reason if the last was refused."""
        if self.numbers is not None:
            return following(self.numbers, [part.serial for part in done])
        text = f"part {len(done) + 1}, serial number (Enter alone ends):"
        question = Question("number", text, (f"{why}.",) if why else ())
        while (answer := self._answer(question)) is not None and answer.lower() in COMMAND_WORDS:
            question = question.after_no_answer(answer)  # an answer to another question is no part
        return answer or None

    def is_mounted(self, part: BatchPart) -> bool:
        """Ask whether the part is mounted; "no" puts it aside."""
        text = f"{part.serial}: mount it, plug in its board, step back; then Enter (no: put it aside):"
        with self._asking("to mount the part"):
            return self.voice is None or self._agrees("mount", text)

    def goes_on(self, doubt: Doubt) -> bool:
        """Ask whether to continue despite a doubt."""
        with self._asking("whether to continue anyway"):
            return self._agrees("doubt", "Continue anyway? yes or no:", f"{doubt.why}.")

    def tries_again(self, part: BatchPart, error: RigError) -> bool:
        """Ask whether to try a part again that was refused or ended in a fault; "no" puts it aside."""
        return self._agrees("again", f"{part.serial}: again? yes, or no to put it aside:", f"{part.serial}: {error}")

    def agrees(self, announcement: Sequence[str], to_do: str) -> bool:
        """Ask whether the announced run may start. An operator who cannot be asked has agreed in advance."""
        if to_do == Prompt(()).to_do:
            return self.voice is None or self._agrees("go", f"Type go to {to_do}:", *announcement)
        return self.voice is None or self._agrees("doubt", f"Type yes to {to_do}, or no:", *announcement)

    def hears(self, part: BatchPart) -> None:
        """Print a part's outcome on stdout, one line each."""
        ended = part.ended
        if ended is None:
            return
        repeated = f"sweeps repeated: {ended.repeated}" if ended.repeated else ""
        more = ", ".join(filter(None, [ended.certificate, repeated, ended.why]))
        say(f"{part.number:3d}  {ended.outcome.upper():7s}  {part.serial}  {more}".rstrip())
        sys.stdout.flush()

    def _asking(self, what: str) -> AbstractContextManager[None]:
        return nullcontext() if self.voice is None else self.asking(what)

    def _agrees(self, kind: Kind, text: str, *lines: str) -> bool:
        """Ask until an answer is valid. Without a voice, or if the operator has left, the answer is no."""
        question = Question(kind, text, lines)
        while (answer := self._answer(question)) is not None:
            if (yes := question.meaning(answer)) is not None:
                return yes
            question = question.after_no_answer(answer)
        return False

    def _answer(self, question: Question) -> str | None:
        return None if self.voice is None else self.voice.answer(question)


def refuse_without_terminal() -> None:
    """Raise Refused `not_confirmed` if nobody can be asked."""
    if not sys.stdin.isatty():
        raise Refused(
            "not_confirmed",
            "a station asks before the arm moves, and there is no terminal to answer at",
            "Start it in a terminal, or give --series PARTS.csv; on hardware --yes as well",
        )
