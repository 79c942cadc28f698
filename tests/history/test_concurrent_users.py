"""A station works on a history, and others beside it: what it said to have entered is there, whatever they do."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from support.history.history_rounds import Rounds, rounds
from support.history.postgres import postgresql

ROUNDS = {"sqlite": 200, "postgresql": 40}
FEW = {"sqlite": 8, "postgresql": 2}
pytestmark = [pytest.mark.slow, pytest.mark.proof]


@pytest.fixture(params=["sqlite", "postgresql"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[tuple[str, str]]:
    if request.param == "sqlite":
        yield "sqlite", str(tmp_path / "history.sqlite")
        return
    with postgresql() as url:
        yield "postgresql", url


@pytest.mark.thorough
@pytest.mark.timeout(6 * 3600)
def test_all_that_was_said_to_be_entered_is_there(place: tuple[str, str], tmp_path: Path, thorough: bool) -> None:
    kind, where = place
    of_one = Rounds(where, tmp_path)
    for this in rounds(0, (ROUNDS if thorough else FEW)[kind]):
        of_one.carry_out(this)
    print(f"{kind}: {len(of_one.entered)} calibrations entered")
    print(f"not remembered: {of_one.not_remembered}; refused: {of_one.refused}")
    assert of_one.entered and not of_one.refused
    # On a busy computer a history may answer too late, which is said with the command that enters the run later.
    assert all("has not answered within" in line and "rig history import" in line for line in of_one.not_remembered)
