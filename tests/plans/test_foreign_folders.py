"""A run folder that came from somebody else is data: what lies in it is neither executed nor connected to."""

import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import pytest

import rig as public
from support.commands import configuration, rig_here
from support.paths import FIXTURES, ROOT

OWN = ROOT / "tests" / "support" / "unequal_sweeps.py"


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another computer, or another user: nothing was run here yet."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "nothing yet"))


@pytest.fixture
def foreign(elsewhere: None, tmp_path: Path) -> Path:
    """A finished run's folder, by a script of its sender's own that leaves a trace where it is executed."""
    folder = tmp_path / "came by e-mail"
    shutil.copytree(FIXTURES / "calibration", folder)
    text = f"open({str(tmp_path / 'trace')!r}, 'w').close()\n" + OWN.read_text(encoding="utf-8")
    said = {"script": "theirs.py", "script_sha256": hashlib.sha256(text.encode()).hexdigest()}
    (folder / "script.py").write_text(text, encoding="utf-8")
    identity = {"name": said["script"], "sha256": said["script_sha256"]}
    (folder / "script.json").write_text(json.dumps(identity), encoding="utf-8")
    with h5py.File(folder / "run.h5", "r+") as file:
        recorded = json.loads(file.attrs["provenance"])
        file.attrs["provenance"] = json.dumps({**recorded, **said, "script_installed": False})
    return folder


def solved_in_a_notebook(folder: Path) -> None:
    assert public.solve(public.load(folder))["gyro"].scale[0] > 1


@pytest.mark.parametrize(
    "read",
    [
        lambda folder: rig_here("solve", folder, "--json"),
        lambda folder: rig_here("solve", folder / "run.h5", "--json"),
        lambda folder: rig_here("history", "import", folder, "--solve", "--history", folder.parent / "history.sqlite"),
        lambda folder: rig_here("report", folder),
        lambda folder: rig_here("export", folder, "--format", "csv"),
        lambda folder: rig_here("allan", folder),
        lambda folder: rig_here("reversal", folder, folder),
        solved_in_a_notebook,
    ],
    ids=["solve", "solve a file", "import", "report", "export", "allan", "reversal", "notebook"],
)
def test_nothing_that_reads_a_run_executes_its_script(
    foreign: Path, tmp_path: Path, read: Callable[[Path], object]
) -> None:
    read(foreign)
    assert not (tmp_path / "trace").exists()


def test_a_run_by_anothers_script_is_solved_without_it_and_says_so(foreign: Path) -> None:
    done, before = rig_here("solve", foreign, "--json"), rig_here("solve", FIXTURES / "calibration", "--json")
    assert done.returncode == 0 and "recorded by the script theirs.py" in done.stderr and before.stderr == ""
    numbers, expected = json.loads(done.stdout)["sensors"]["gyro"], json.loads(before.stdout)["sensors"]["gyro"]
    assert numbers["scale"] == expected["scale"]


def test_a_script_that_the_user_names_is_executed(foreign: Path, tmp_path: Path) -> None:
    done = rig_here("solve", foreign, "--script", foreign / "script.py")
    assert done.returncode == 0 and done.stderr == "" and (tmp_path / "trace").exists()
    other = rig_here("solve", foreign, "--script", OWN)
    assert other.returncode == 2 and "rig: another_script: " in other.stderr


def test_a_run_by_anothers_script_goes_on_by_a_script_that_the_user_names_or_not_at_all(
    foreign: Path, tmp_path: Path
) -> None:
    (foreign / "result.json").unlink()
    config = configuration(tmp_path).read_text(encoding="utf-8")
    (foreign / "config.yaml").write_text(config.replace("six_observation", "unequal_sweeps"), encoding="utf-8")
    refused = rig_here("resume", foreign, "--yes")
    assert refused.returncode == 2 and "rig: foreign_script: " in refused.stderr, refused.stderr
    assert f"--script '{foreign / 'script.py'}'" in refused.stderr
    assert not (tmp_path / "trace").exists()
