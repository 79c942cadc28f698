"""`latest` is the run folder that was used last and is still there."""

from pathlib import Path

import pytest

from rig.cli import main
from rig.data.latest_run import MAX_FOLDERS, latest_run, meant_run, note_run
from rig.errors import Refused


@pytest.fixture(autouse=True)
def independent_fraction(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "share"))
    monkeypatch.chdir(tmp_path)


def test_it_is_the_newest_that_is_still_there(tmp_path: Path) -> None:
    first, second = tmp_path / "runs" / "1", tmp_path / "runs" / "2"
    for folder in (first, second):
        folder.mkdir(parents=True)
        note_run(folder)
    assert latest_run() == Path("runs/2")
    assert meant_run("latest") == Path("runs/2") and meant_run("latest/run.h5") == Path("runs/2/run.h5")
    note_run(first)  # resumed
    assert latest_run() == Path("runs/1")
    first.rmdir()
    assert latest_run() == Path("runs/2")
    for number in range(MAX_FOLDERS):
        note_run(tmp_path / f"gone-{number}")
    with pytest.raises(Refused, match="no run folder of yours"):
        latest_run()


def test_a_folder_of_that_name_is_meant_by_its_name(tmp_path: Path) -> None:
    note_run(tmp_path)
    (tmp_path / "latest").mkdir()
    assert meant_run("latest") == Path("latest")
    assert meant_run("latest/run.h5") == Path("latest/run.h5")
    assert meant_run("another") == Path("another")


@pytest.mark.parametrize(
    "words",
    ["show", "show latest", "solve latest", "report latest", "export latest --format csv", "resume latest",
     "watch latest", "allan latest", "reversal latest latest", "history import latest",
     "verify latest/certificate.html"],
)  # fmt: skip
def test_every_command_that_takes_a_run_takes_the_latest(words: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(words.split())
    assert ": no run folder of yours is known" in capsys.readouterr().err
