"""The source of a batch's serial numbers: an operator at a terminal or page, who also answers questions, or a list."""

import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

from rig.batch.batch_state import BatchPart, Doubt
from rig.batch.part_list import next_serial_number
from rig.errors import Refused, RigError
from rig.station.plain_text import say
from rig.station.questions import COMMAND_WORDS, Kind, Question, Voice, is_agreed, question_before


@dataclass(frozen=True, slots=True)
class Operator:
    """The source of serial numbers and answers: an operator at a terminal or page (`voice`), or a list of `numbers`.

    An empty number ends the batch. Without a `voice` no questions are asked, so a doubt cannot be overridden. If a
    number from a list is refused, it is entered in the table as refused; if a typed number is refused, the operator
    types another. The context manager `asking` is entered for each question between two runs; its argument is the
    subject, such as "to mount the part".
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
        """Whether the parts' serial numbers come from a list."""
        return self.numbers is not None

    def next_part(self, done: Sequence[BatchPart], why: str = "") -> str | None:
        """Return the next serial number, from the list or typed; `why` is the reason if the last number was refused."""
        if self.numbers is not None:
            return next_serial_number(self.numbers, [part.serial for part in done])
        text = f"part {len(done) + 1}, serial number (Enter alone ends):"
        question = Question("number", text, (f"{why}.",) if why else ())
        while (answer := self._answer(question)) is not None and answer.lower() in COMMAND_WORDS:
            question = question.after_no_answer(answer)  # an answer to another question names no part
        return answer or None

    def is_mounted(self, part: BatchPart) -> bool:
        """Ask whether the part is mounted, and return the answer: True without an operator. False puts it aside."""
        text = f"{part.serial}: mount it, plug in its board, step back; then Enter (no: put it aside):"
        with self._asking("to mount the part"):
            return self.voice is None or self._agrees("mount", text)

    def goes_on(self, doubt: Doubt) -> bool:
        """Ask whether to continue despite a doubt."""
        with self._asking("whether to continue anyway"):
            return self._agrees("doubt", "Continue anyway? yes or no:", f"{doubt.why}.")

    def tries_again(self, part: BatchPart, error: RigError) -> bool:
        """Ask whether to repeat a part that was refused or ended in a fault; "no" puts it aside."""
        return self._agrees("again", f"{part.serial}: again? yes, or no to put it aside:", f"{part.serial}: {error}")

    def agrees(self, announcement: Sequence[str], to_do: str) -> bool:
        """Ask whether the announced run may start. Without an operator, return True."""
        return self.voice is None or is_agreed(self.voice, question_before(announcement, to_do))

    def print_outcome(self, part: BatchPart) -> None:
        """Print a part's outcome on stdout in a line, and its agreement with a simulated truth in another."""
        ended = part.ended
        if ended is None:
            return
        repeated = f"sweeps repeated: {ended.repeated}" if ended.repeated else ""
        more = ", ".join(filter(None, [ended.certificate, repeated, ended.why]))
        say(f"{part.number:3d}  {ended.outcome.upper():7s}  {part.serial}  {more}".rstrip())
        if ended.truth:
            say(f"     {ended.truth}")
        sys.stdout.flush()

    def _asking(self, what: str) -> AbstractContextManager[None]:
        return nullcontext() if self.voice is None else self.asking(what)

    def _agrees(self, kind: Kind, text: str, *lines: str) -> bool:
        """Ask a yes-or-no question; without an operator the answer is no."""
        return self.voice is not None and is_agreed(self.voice, Question(kind, text, lines))

    def _answer(self, question: Question) -> str | None:
        return None if self.voice is None else self.voice.answer(question)


def refuse_without_terminal() -> None:
    """Raise Refused `not_confirmed` if there is no terminal for questions."""
    if not sys.stdin.isatty():
        raise Refused(
            "not_confirmed",
            "a station asks before the arm moves, but there is no terminal to answer at",
            "Start it in a terminal, or give --series PARTS.csv; on hardware --yes as well",
        )
