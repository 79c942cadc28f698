"""How the rig says no: every error has a name, says what and where, and says what to do.

`catalogue` has every name in one table, from which docs/errors.md is made.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

from firmware_host.problem import Problem, ProblemError

__all__ = ["Fault", "Problem", "ProblemError", "Refused", "RigError", "Unprinted", "or_fault", "raised_as", "refuse"]
Result = TypeVar("Result")


class RigError(ProblemError):
    """Something the rig will not or cannot do. `exit_status` is what the command line returns for it."""

    exit_status = 3


class Refused(RigError):
    """The configuration or the pre-flight check says no; nothing has moved (exit status 2)."""

    exit_status = 2


class Fault(RigError):
    """Something failed during the run; the arm is stopped and the data kept (exit status 3)."""


class Unprinted(RigError):
    """All was done, and what was to be printed of it is lost (exit status 5)."""

    exit_status = 5


def or_fault(solve: Callable[[], Result]) -> Result | Fault:
    """What `solve` returns, or the Fault it ends in: for a result that stands beside others."""
    try:
        return solve()
    except Fault as fault:
        return fault


@contextmanager
def raised_as(kind: type[RigError]) -> Iterator[None]:
    """Raise a problem found inside, by board or recording, as `kind`; a refusal stays one."""
    try:
        yield
    except ProblemError as error:
        if isinstance(error, (kind, Refused)):
            raise
        raise kind.of(error.problem) from error


def refuse(problems: Sequence[Problem]) -> None:
    """Raise `Refused` when there are problems: named after the first, with all of them and their remedies."""
    if not problems:
        return
    *others, last = problems
    also = "".join(f"{problem.what} ({problem.name}): {problem.remedy}. " for problem in others)
    raise Refused(problems[0].name, also + last.what, last.remedy)
