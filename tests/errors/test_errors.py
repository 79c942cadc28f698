"""A problem keeps its three parts whatever carries it."""

import pickle
from contextlib import suppress

import pytest

from firmware_host.emulator.chip.bus import Violation
from firmware_host.errors import BoardError
from rig.cli import main
from rig.errors import Fault, Problem, ProblemError, Refused, RigError, raise_as

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
    with pytest.raises(ProblemError) as caught, raise_as(as_kind):
        raise raised.from_problem(PROBLEM)
    assert type(caught.value) is expected
    assert caught.value.problem == PROBLEM


def test_a_path_with_control_characters_leaves_an_error_on_one_line() -> None:
    error = Refused("no_file", "logs/a\nb\x1b[31m.csv cannot be read", "Give a file")
    assert str(error) == r"no_file: logs/a\nb\x1b[31m.csv cannot be read. Give a file."
    assert error.what == "logs/a\nb\x1b[31m.csv cannot be read", "a program gets the path itself"


@pytest.mark.parametrize("words", [["show", "a\nb\x1b[31m"], ["show", "x", "--a\nb\x1b[31m"]])
def test_no_argument_reaches_the_terminal_with_its_control_characters(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with suppress(SystemExit):
        main(words)
    first, *others = capsys.readouterr().err.splitlines()
    assert r"a\nb\x1b[31m" in first and not any(line.startswith("b") for line in others)
