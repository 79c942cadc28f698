"""The operator who names the parts and answers questions, at a terminal or elsewhere; or a list without questions."""

import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Literal, Protocol

from rig.batch.batch import BatchPart, Doubt
from rig.batch.series import following
from rig.errors import Refused, RigError
from rig.errors.quoting import printable_lines
from rig.station.confirm import forget_what_was_typed
from rig.station.events import Prompt
from rig.station.plain_text import for_file, say

YES = ("yes", "y", "go")
NO = ("no", "n")


Kind = Literal["number", "mount", "go", "doubt", "again"]


@dataclass(frozen=True, slots=True)
class Question:
    """A question of a `kind`: the `lines` before it, and its `text`."""

    kind: Kind
    text: str
    lines: tuple[str, ...] = ()


class Voice(Protocol):
    """The way to ask an operator; an answer has no white space around it, and is empty if the operator has left."""

    def answer(self, question: Question) -> str: ...


class Terminal:
    """The keyboard of the terminal. A scanner is a keyboard that ends each number with Enter."""

    def answer(self, question: Question) -> str:
        """Return the text typed after the question: earlier input does not answer it."""
        forget_what_was_typed()
        for line in question.lines:
            print(for_file(printable_lines(line), sys.stderr), file=sys.stderr)
        print(printable_lines(question.text), end=" ", file=sys.stderr, flush=True)
        return sys.stdin.readline().strip()


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
        """Return the next number of the list, or a typed one; `why` explains the refusal of the last one."""
        if self.numbers is not None:
            return following(self.numbers, [part.serial for part in done])
        text = f"part {len(done) + 1}, serial number (Enter alone ends):"
        return self._answer("number", text, *([f"{why}."] if why else [])) or None

    def is_mounted(self, part: BatchPart) -> bool:
        """Ask whether the part is mounted; "no" puts it aside."""
        text = f"{part.serial}: mount it, plug in its board, step back; then Enter (no: put it aside):"
        with self._asking("to mount the part"):
            while (answer := self._answer("mount", text).lower()) not in ("", *YES, *NO):
                pass  # a number that is scanned twice is not an answer
        return answer not in NO

    def goes_on(self, doubt: Doubt) -> bool:
        """Ask whether to continue despite a doubt."""
        with self._asking("whether to continue anyway"):
            return self._agrees("doubt", "Continue anyway? yes or no:", f"{doubt.why}.")

    def tries_again(self, part: BatchPart, error: RigError) -> bool:
        """Ask whether a part that was refused, or ended in a fault, is tried again; "no" puts it aside."""
        return self._agrees("again", f"{part.serial}: again? yes, or no to put it aside:", f"{part.serial}: {error}")

    def agrees(self, announcement: Sequence[str], to_do: str) -> bool:
        """Ask whether a run may do what it announces; without a voice the agreement was given in advance."""
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
        return self._answer(kind, text, *lines).lower() in YES

    def _answer(self, kind: Kind, text: str, *lines: str) -> str:
        return "" if self.voice is None else self.voice.answer(Question(kind, text, lines))


def refuse_without_terminal() -> None:
    """Raise Refused `not_confirmed` if there is no one to ask."""
    if not sys.stdin.isatty():
        raise Refused(
            "not_confirmed",
            "a station asks before the arm moves, and there is no terminal to answer at",
            "Start it in a terminal, or give --series PARTS.csv; on hardware --yes as well",
        )
