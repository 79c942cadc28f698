"""Commands on a disk that takes no more: the file is named, nothing of it is left, and what was whole stays."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.data.recording import run_file
from rig.data.recording.layout import lay_out
from rig.data.recording.run_file import read_run
from rig.errors import Refused
from rig.history.storage import engine
from rig.history.store import open_history
from rig.report.exports.exported_recording import export_recordings
from rig.report.exports.formats import READING_FORMATS, writer_of_readings
from rig.runner.csv_recording import ReadingsFile
from support.laboratories.commands import rig_here
from support.paths import RECORDINGS, ROOT
from support.processes.full_disk import full_disk

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no limit for files there")

RUN = RECORDINGS / "six_observation"
EXAMPLES = ROOT / "docs" / "examples"
SOLVE = ("solve", str(EXAMPLES / "samples.csv"), "--sweeps", str(EXAMPLES / "sweeps.csv"), "--out", "OUT")
REPORT = ("report", str(RUN), "--history", "off", "--out", "OUT")
STUDY = ("study", "convergence", "--runs", "10", "--out", "OUT")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "room_bytes", "refused", "kept"),
    [
        (SOLVE, 50_000, ("run_folder", "run.h5"), set()),
        (REPORT, 5_000, ("report_folder", "certificate.html"), set()),
        (STUDY, 5_000, ("study_folder", "convergence.svg"), {"convergence.csv", "convergence-findings.csv"}),
    ],
)
def test_the_file_that_is_not_written_is_named_and_not_there(
    command: tuple[str, ...], room_bytes: int, refused: tuple[str, str], kept: set[str], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with full_disk(room_bytes):
        done = rig_here(*(str(out) if word == "OUT" else word for word in command))
    name, file = refused
    said = done.stderr.splitlines()[-1]
    assert done.returncode == 2 and said.startswith(f"rig: {name}: ") and str(out / file) in said, done.stderr
    assert "File too large" in said and {path.name for path in out.rglob("*")} == kept


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(READING_FORMATS))
def test_readings_are_exported_whole_or_not_at_all(name: str, tmp_path: Path) -> None:
    recordings = export_recordings([read_run(RUN / "run.h5")])
    with full_disk(4000), pytest.raises(OSError, match=str(tmp_path)):
        writer_of_readings(name)(recordings, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_recording_that_cannot_be_made_plain_stays_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.h5"
    before = (RECORDINGS / "by_hand" / "run.h5").read_bytes()
    path.write_bytes(before)

    def laid_out(*given: Any, **named: Any) -> None:
        with full_disk(1000):  # only here: what is read goes through a file too
            lay_out(*given, **named)

    monkeypatch.setattr(run_file, "lay_out", laid_out)
    with pytest.raises(OSError, match=r"too large: '.*run\.h5'"):
        run_file.make_plain(path)
    assert path.read_bytes() == before and [*tmp_path.iterdir()] == [path]


def test_a_history_is_made_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a disk that has room for its log and no more; SQLite says nothing where it closes then."""
    file = tmp_path / "history.sqlite"
    made = engine._bring_up_to_date

    def made_in_the_last_room(*given: Any) -> None:
        import resource

        made(*given)
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))

    monkeypatch.setattr(engine, "_bring_up_to_date", made_in_the_last_room)
    with full_disk(10_000_000), pytest.raises(Refused, match="history_unreachable: "), open_history(str(file)):
        pass
    assert [*tmp_path.iterdir()] == []
    monkeypatch.undo()
    with open_history(str(file)) as history:
        assert list(history.kept()) == []


def test_readings_end_with_a_whole_line(tmp_path: Path) -> None:
    """Half a number would be another number."""
    run = read_run(RUN / "run.h5")
    torn = ReadingsFile(tmp_path / "gyro.csv", "gyro", run.sensors["gyro"])
    with torn, full_disk(10_000), pytest.raises(OSError, match=r"too large: '.*gyro\.csv'"):
        for rows in np.array_split(run.samples["gyro"], 100):
            torn.add(rows)
    lines = (tmp_path / "gyro.csv").read_text(encoding="utf-8").split("\n")
    assert len(lines) > 100 and lines[-1] == "" and all(line.count(",") == 3 for line in lines[:-1])
    with ReadingsFile(tmp_path / "whole.csv", "gyro", run.sensors["gyro"]) as file:
        file.add(run.samples["gyro"])
    assert (tmp_path / "whole.csv").read_text(encoding="utf-8").startswith("\n".join(lines))
