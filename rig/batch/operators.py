"""Who names the parts: an operator with a keyboard or a scanner at the terminal, or a list that is asked nothing."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass

from rig.batch.batch import Doubt, Part
from rig.batch.series import following
from rig.errors import Refused, RigError
from rig.errors.quoting import printable_lines
from rig.station.plain_text import for_file, say

YES = ("yes", "y", "go")


@dataclass(frozen=True, slots=True)
class AtTheTerminal:
    """The operator. A scanner is a keyboard that ends each number with Enter; an empty line ends the batch.

    The numbers of a list are taken one after the other where there is one; `asked` is False where everything that a
    question may answer was agreed to before.
    """

    asked: bool = True
    numbers: Sequence[str] | None = None

    @property
    def attended(self) -> bool:
        """Whether somebody sits there who can answer."""
        return self.asked

    @property
    def listed(self) -> bool:
        """Whether the numbers come from a list."""
        return self.numbers is not None

    def next_part(self, done: Sequence[Part]) -> str | None:
        """The next number of the list, or the one that is typed or scanned."""
        if self.numbers is not None:
            return following(self.numbers, [each.serial for each in done])
        return _line(f"part {len(done) + 1}, serial number (Enter alone ends): ") or None

    def mounted(self, part: Part) -> bool:
        """Whether it is; "no" puts it aside."""
        if not self.asked:
            return True
        said = _line(f"{part.serial}: mount it, plug in its board, step back; then Enter (no: put it aside): ")
        return said.lower() not in ("no", "n")

    def goes_on(self, doubt: Doubt) -> bool:
        """Whether the operator says yes."""
        _tell(f"{doubt.why}.")
        return self.asked and _line("Go on all the same? yes or no: ").lower() in YES

    def tries_again(self, part: Part, error: RigError) -> bool:
        """Whether the operator wants it again."""
        _tell(f"{part.serial}: {error}")
        return self.asked and _line(f"{part.serial}: again? yes, or no to put it aside: ").lower() in YES

    def agrees(self, announcement: Sequence[str], to_do: str) -> bool:
        """Whether the operator says go."""
        if not self.asked:
            return True
        for line in announcement:
            _tell(line)
        return _line(f"Type go to {to_do}: ").lower() in YES

    def hears(self, part: Part) -> None:
        """Told on stdout, a line for each part."""
        ended = part.ended
        if ended is None:
            return
        repeated = f"sweeps repeated: {ended.repeated}" if ended.repeated else ""
        more = ", ".join(filter(None, [ended.certificate, repeated, ended.why]))
        say(f"{part.number:3d}  {ended.outcome.upper():7s}  {part.serial}  {more}".rstrip())
        sys.stdout.flush()


def refuse_without_terminal() -> None:
    """Raise Refused `not_confirmed` where nobody can be asked."""
    if not sys.stdin.isatty():
        raise Refused(
            "not_confirmed",
            "a station asks before the arm moves, and there is no terminal to answer at",
            "Start it in a terminal, or give --series PARTS.csv; on hardware --yes as well",
        )


def _line(question: str) -> str:
    """What is typed after a question, without blanks around it; nothing where the terminal is gone."""
    print(question, end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip()


def _tell(text: str) -> None:
    print(for_file(printable_lines(text), sys.stderr), file=sys.stderr)
