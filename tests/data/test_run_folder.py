"""A run folder holds all that a run goes on from, or nothing."""

import sys
from pathlib import Path

import pytest

from rig.config.load import load
from rig.data.run_folder import ScriptIdentity, new_folder
from rig.errors import Refused
from support.paths import DEMO
from support.processes.full_disk import full_disk

IDENTITY = ScriptIdentity("six_observation.py", "")


@pytest.mark.skipif(sys.platform == "win32", reason="no limit for files there")
def test_a_disk_that_is_full_from_the_start_leaves_nothing_to_resume(tmp_path: Path) -> None:
    loaded, out = load(DEMO), tmp_path / "run"
    with full_disk(len(loaded.text) // 2), pytest.raises(Refused, match=r"run_folder: .* cannot be written"):
        new_folder(out, loaded, "", IDENTITY)
    assert list(out.iterdir()) == []
    new_folder(out, loaded, "", IDENTITY)
    assert (out / "config.yaml").read_text(encoding="utf-8") == loaded.text


def test_of_two_runs_at_once_the_second_takes_nothing_from_the_first(tmp_path: Path) -> None:
    loaded = load(DEMO)
    new_folder(tmp_path / "run", loaded, "print()\n", IDENTITY)
    with pytest.raises(Refused, match=r"run_folder: .* is not empty"):
        new_folder(tmp_path / "run", loaded, "", IDENTITY)
    assert (tmp_path / "run" / "script.py").read_text(encoding="utf-8") == "print()\n"
