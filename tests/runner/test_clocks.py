"""Clocks that contradict each other fail a run; whether a crystal holds the board's, the board says."""

import json
from pathlib import Path
from typing import Any

import pytest

from rig.data.recording.run_file import read_run
from support.laboratories.commands import configuration, rig

pytestmark = pytest.mark.slow


def finished(folder: Path, world: dict[str, Any]) -> tuple[int, dict[str, Any], dict[str, Any]]:
    """A run's exit status, its checks of the clocks by name, its provenance."""
    out = folder / "run"
    done = rig("run", configuration(folder, {"world": world}), "--out", out)
    assert done.returncode in (0, 1), done.stderr
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    clocks = {check["name"]: check for check in result["checks"] if check["name"].startswith("clocks_agree.")}
    return done.returncode, clocks, result["provenance"]


@pytest.mark.thorough
def test_a_controllers_clock_that_the_boards_crystal_contradicts_fails_and_says_by_how_much(tmp_path: Path) -> None:
    status, clocks, provenance = finished(tmp_path, {"arm": {"clock_ppm": 500}})
    check = clocks["clocks_agree.controller_and_crystal"]
    assert status == 1 and not check["passed"] and check["unit"] == "ppm"
    assert 450 < check["value"] < 550 and check["limit"] < 150
    assert provenance["board_follows_crystal"] is True


@pytest.mark.thorough
def test_a_board_without_its_crystal_says_so_and_contradicts_nobody(tmp_path: Path) -> None:
    status, clocks, provenance = finished(tmp_path, {"board": {"crystal": False, "crystal_ppm": 9000}})
    assert status == 0 and clocks == {}
    assert provenance["board_follows_crystal"] is False
    assert read_run(tmp_path / "run" / "run.h5").provenance.board_follows_crystal is False
