"""Errors of the rig: each has a name, and states what happened, where, and what to do.

`catalogue` has every name in one table, from which docs/errors.md is made.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

from firmware_host.problem import Problem, ProblemError

__all__ = [
    "Fault",
    "Problem",
    "ProblemError",
    "Refused",
    "RigError",
    "Unprinted",
    "name_sensor",
    "or_fault",
    "raise_as",
    "refuse",
]
Result = TypeVar("Result")
INTERRUPTED_STATUS = 130  # exit status of an interrupted command: 128 + SIGINT, as in a shell


class RigError(ProblemError):
    """An action that the rig refuses or cannot do. `exit_status` is that of the command line."""

    exit_status = 3


class Refused(RigError):
    """An action that the configuration or the pre-flight tests forbid; nothing has moved (exit status 2)."""

    exit_status = 2


class Fault(RigError):
    """A failure during the run; the arm is stopped and the data are kept (exit status 3)."""


class Unprinted(RigError):
    """The loss of the output of a finished action (exit status 5)."""

    exit_status = 5


def or_fault(solve: Callable[[], Result]) -> Result | Fault:
    """Return the result of `solve`, or the Fault that it raises."""
    try:
        return solve()
    except Fault as fault:
        return fault


@contextmanager
def raise_as(kind: type[RigError]) -> Iterator[None]:
    """Convert errors of the board or of a recording, raised in the block, into `kind`; Refused remains unchanged."""
    try:
        yield
    except ProblemError as error:
        if isinstance(error, (kind, Refused)):
            raise
        raise kind.from_problem(error.problem) from error


@contextmanager
def name_sensor(name: str, sensors: Collection[str]) -> Iterator[None]:
    """Put the sensor's `name` before what a Fault in the block says, unless it is the only one of the `sensors`."""
    try:
        yield
    except Fault as fault:
        if len(sensors) < 2:
            raise
        raise Fault(fault.name, f"{name}: {fault.what}", fault.remedy) from fault


def refuse(problems: Sequence[Problem]) -> None:
    """Raise Refused under the first problem's name, with all problems and remedies; do nothing if there are none."""
    if not problems:
        return
    *others, last = problems
    also = "".join(f"{problem.what} ({problem.name}): {problem.remedy}. " for problem in others)
    raise Refused(problems[0].name, also + last.what, last.remedy)
