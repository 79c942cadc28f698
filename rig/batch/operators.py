"""Who names the parts and is asked: an operator at the terminal or elsewhere, or a list that is asked nothing."""

import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Literal, Protocol

from rig.batch.batch import Doubt, Part
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
    """A question of a `kind`: what is told before it in `lines`, and the `text` that asks."""

    kind: Kind
    text: str
    lines: tuple[str, ...] = ()


class Voice(Protocol):
    """How an operator is asked; what is typed comes back without blanks around it, empty where nobody is left."""

    def answer(self, question: Question) -> str: ...


class Terminal:
    """The keyboard of the terminal. A scanner is a keyboard that ends each number with Enter."""

    def answer(self, question: Question) -> str:
        """What is typed after the question: what was typed before is no answer to what nobody had read."""
        forget_what_was_typed()
        for line in question.lines:
            print(for_file(printable_lines(line), sys.stderr), file=sys.stderr)
        print(printable_lines(question.text), end=" ", file=sys.stderr, flush=True)
        return sys.stdin.readline().strip()


@dataclass(frozen=True, slots=True)
class Asked:
    """The operator, by a `voice`; an empty number ends the batch. Nobody is asked where there is no voice.

    Not `attended`, nobody can say that a doubt is none. The numbers of a list are taken one after the other where there
    is one: one that is not run stands in the table, one that was typed is typed again. `asking` is held while something
    is asked between two runs, and told what, as "to mount the part".
    """

    voice: Voice | None
    numbers: Sequence[str] | None = None
    asking: Callable[[str], AbstractContextManager[None]] = lambda what: nullcontext()

    @property
    def attended(self) -> bool:
        """Whether somebody is there who can answer."""
        return self.voice is not None

    @property
    def listed(self) -> bool:
        """Whether the numbers come from a list."""
        return self.numbers is not None

    def next_part(self, done: Sequence[Part], why: str = "") -> str | None:
        """The next number of the list, or the one that is typed or scanned after `why` the last one was not taken."""
        if self.numbers is not None:
            return following(self.numbers, [each.serial for each in done])
        text = f"part {len(done) + 1}, serial number (Enter alone ends):"
        return self._answer("number", text, *([f"{why}."] if why else [])) or None

    def mounted(self, part: Part) -> bool:
        """Whether the part is mounted; "no" puts it aside."""
        text = f"{part.serial}: mount it, plug in its board, step back; then Enter (no: put it aside):"
        with self._asking("to mount the part"):
            while (said := self._answer("mount", text).lower()) not in ("", *YES, *NO):
                pass  # a number that is scanned twice says nothing of what is mounted
        return said not in NO

    def goes_on(self, doubt: Doubt) -> bool:
        """Whether it is right all the same."""
        with self._asking("whether to go on all the same"):
            return self._agrees("doubt", "Go on all the same? yes or no:", f"{doubt.why}.")

    def tries_again(self, part: Part, error: RigError) -> bool:
        """Whether a part that was refused, or ended in a fault, is tried again; "no" puts it aside."""
        return self._agrees("again", f"{part.serial}: again? yes, or no to put it aside:", f"{part.serial}: {error}")

    def agrees(self, announcement: Sequence[str], to_do: str) -> bool:
        """Whether what a run announces may be done: the operator says so, or was not to be asked, and agreed before."""
        if to_do == Prompt(()).to_do:
            return self.voice is None or self._agrees("go", f"Type go to {to_do}:", *announcement)
        return self.voice is None or self._agrees("doubt", f"Type yes to {to_do}, or no:", *announcement)

    def hears(self, part: Part) -> None:
        """What became of a part is told on stdout, a line for each."""
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
    """Raise Refused `not_confirmed` where nobody can be asked."""
    if not sys.stdin.isatty():
        raise Refused(
            "not_confirmed",
            "a station asks before the arm moves, and there is no terminal to answer at",
            "Start it in a terminal, or give --series PARTS.csv; on hardware --yes as well",
        )
