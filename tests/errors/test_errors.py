"""A problem keeps its three parts whatever carries it."""

import pickle

import pytest

from firmware_host.emulator.chip.bus import Violation
from firmware_host.errors import BoardError
from rig.errors import Fault, Problem, ProblemError, Refused, RigError, raised_as

PROBLEM = Problem("no_board", "nothing answers on /dev/ttyACM0", "Check the cable")


@pytest.mark.parametrize("kind", [Refused, Fault, BoardError, Violation])
def test_every_kind_of_error_carries_a_problem(kind: type[ProblemError]) -> None:
    error = kind.from_problem(PROBLEM)
    assert error.problem == PROBLEM
    assert (error.name, error.what, error.remedy) == (PROBLEM.name, PROBLEM.what, PROBLEM.remedy)
    assert str(error) == str(PROBLEM) == "no_board: nothing answers on /dev/ttyACM0. Check the cable."
    assert pickle.loads(pickle.dumps(error)).problem == PROBLEM, "errors cross processes"


@pytest.mark.parametrize(
    ("raised", "as_kind", "expected"),
    [
        (BoardError, Refused, Refused),
        (Fault, Refused, Refused),
        (Refused, Refused, Refused),
        (BoardError, Fault, Fault),
        (Fault, Fault, Fault),
        (Refused, Fault, Refused),
    ],
)
def test_one_converter_serves_every_kind(
    raised: type[ProblemError], as_kind: type[RigError], expected: type[RigError]
) -> None:
    with pytest.raises(ProblemError) as caught, raised_as(as_kind):
        raise raised.from_problem(PROBLEM)
    assert type(caught.value) is expected
    assert caught.value.problem == PROBLEM
