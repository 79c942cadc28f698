"""A procedure's script knows the rig by one door, so that it outlives what moves behind it."""

import ast
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import rig.procedure
from rig.data.recording.run_file import read_run
from rig.procedure import Outcome, calibrate, fitness
from support.paths import DOCS, RECORDINGS, ROOT

STOCK = sorted(path for path in (ROOT / "procedures").glob("*.py") if path.name != "__init__.py")
OWN_PAGE = DOCS / "how-to" / "with-code" / "own-procedure.md"


def imported(script: str) -> Iterator[str]:
    """Every module a script imports."""
    for node in ast.walk(ast.parse(script)):
        if isinstance(node, ast.ImportFrom):
            assert node.module is not None
            yield node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def of_the_rig(script: str) -> set[str]:
    """The rig's modules among them."""
    return {name for name in imported(script) if name.split(".")[0] in ("rig", "firmware_host")}


@pytest.mark.parametrize(
    "script", [*STOCK, ROOT / "tests" / "support" / "motions" / "unequal_sweeps.py"], ids=lambda path: path.stem
)
def test_a_script_imports_nothing_of_the_rig_but_its_door(script: Path) -> None:
    assert of_the_rig(script.read_text(encoding="utf-8")) == {"rig.procedure"}


def test_the_documented_script_imports_nothing_of_the_rig_but_its_door() -> None:
    (shown,) = re.findall(r"^```python\n(.*?)^```$", OWN_PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert of_the_rig(shown) == {"rig.procedure"}


def test_the_door_has_all_that_the_stock_scripts_need_and_says_so() -> None:
    used = {
        alias.name
        for path in STOCK
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and node.module == "rig.procedure"
        for alias in node.names
    }
    assert len(STOCK) == 8 and used <= {*rig.procedure.__all__}
    assert all(hasattr(rig.procedure, name) for name in rig.procedure.__all__)


@pytest.mark.slow
def test_an_analysis_of_one_s_own_adds_a_check_to_the_verdict() -> None:
    def judged(limit: float) -> Outcome:
        outcome = calibrate([read_run(RECORDINGS / "six_observation" / "run.h5")])
        turns = outcome.results["gyro"].observations
        shortest_s = min(turn.average.duration_s for turn in turns)
        return replace(
            outcome, checks=(*outcome.checks, fitness("gyro", "rate", "turn_s", shortest_s, limit, unit="s"))
        )

    assert judged(60.0).passed and not judged(1.0).passed
    check = judged(1.0).checks[-1]
    assert (check.name, check.unit, check.means.what) == ("gyro.turn_s", "s", "turn_s")
