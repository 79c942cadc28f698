"""The form of every refusal and fault in the program: name, clause, remedy."""

from typing import NamedTuple, Self

NO_BREAK_SPACE = "\N{NO-BREAK SPACE}"


def printable(text: str) -> str:
    """Return the text with every invisible character, including line ends, in Python's notation: `\\x1b`, `\\n`.

    A no-break space stays: it separates a number from its power of ten or its unit.
    """
    if text.isprintable():
        return text
    shows = (c.isprintable() or c == NO_BREAK_SPACE for c in text)
    return "".join(c if s else c.encode("unicode_escape").decode("ascii") for c, s in zip(text, shows, strict=True))


class Problem(NamedTuple):  # no dataclass: the command line imports this, and must start at once
    """A condition that prevents an operation.

    `name` is stable, for programs and documentation (`lost_samples`, `arm_link_lost`, …), `what` one clause on what
    happened and where, `remedy` one clause on what to do.
    """

    name: str
    what: str
    remedy: str

    def __str__(self) -> str:
        stop = "" if self.remedy.endswith((".", "?", "!")) else "."
        return printable(f"{self.name}: {self.what}. {self.remedy}{stop}")  # a path may contain a line feed


class ProblemError(Exception):
    """An exception that carries a `Problem`; each part of the program has its own kinds of it."""

    def __init__(self, name: str, what: str, remedy: str) -> None:
        super().__init__(name, what, remedy)
        self.problem = Problem(name, what, remedy)

    @classmethod
    def from_problem(cls, problem: Problem) -> Self:
        """Return the problem as an exception of this kind."""
        return cls(problem.name, problem.what, problem.remedy)

    @property
    def name(self) -> str:
        """The problem's stable name."""
        return self.problem.name

    @property
    def what(self) -> str:
        """A clause that says what happened and where."""
        return self.problem.what

    @property
    def remedy(self) -> str:
        """A clause that says what to do."""
        return self.problem.remedy

    def __str__(self) -> str:
        return str(self.problem)
