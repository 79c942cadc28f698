"""What a run leaves in its folder, and that another document is one file and one line."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from rig.analysis.analyses import calibrate
from rig.analysis.outcome import Outcome
from rig.data.recording.run_file import read_run
from rig.data.result_file import ResultDocument, read_result
from rig.report import writers
from rig.station.events import DocumentWritten, RunEvent
from support.paths import RECORDINGS, ROOT
from support.processes.full_disk import full_disk
from support.processes.waiting import PATIENCE_S

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    return calibrate([read_run(RECORDINGS / "six_observation" / "run.h5")])


def test_the_folder_holds_header_certificate_and_result(outcome: Outcome, tmp_path: Path) -> None:
    written = [DocumentWritten(tmp_path / name) for name in ("calibration.h", "certificate.html", "result.json")]
    assert list(writers.write_outcome(tmp_path, outcome)) == written
    assert sorted(file.name for file in tmp_path.iterdir()) == ["calibration.h", "certificate.html", "result.json"]
    assert read_result(tmp_path).verdict == outcome.verdict == "pass"


def on_a_full_disk(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    raise OSError(28, "No space left on device")


def test_a_run_whose_documents_fail_is_not_ended_and_no_document_says_that_it_passed(
    outcome: Outcome, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writers, "WRITERS", (*writers.WRITERS, f"{__name__}:on_a_full_disk"))
    with pytest.raises(OSError, match="No space"):
        list(writers.write_outcome(tmp_path, outcome))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("room_bytes", [1000, 4000, 20_000])
def test_on_a_full_disk_no_document_lies_without_its_result(outcome: Outcome, tmp_path: Path, room_bytes: int) -> None:
    with full_disk(room_bytes), pytest.raises(OSError, match=f"too large: '{tmp_path}"):
        list(writers.write_outcome(tmp_path, outcome))
    assert list(tmp_path.iterdir()) == []


def test_the_result_takes_its_place_first(outcome: Outcome, tmp_path: Path) -> None:
    """Whatever ends the program between two of them; here a folder lies where the last one belongs."""
    (tmp_path / "calibration.h").mkdir()
    with pytest.raises(OSError, match="directory"):
        list(writers.write_outcome(tmp_path, outcome))
    assert {file.name for file in tmp_path.iterdir()} == {"calibration.h", "certificate.html", "result.json"}


TOY = """
from rig.station.events import DocumentWritten

def write_toy(outcome, document, folder):
    path = folder / "toy.txt"
    path.write_text(f"{document.verdict}, {len(outcome.results)} sensors", encoding="utf-8")
    return (DocumentWritten(path),)
"""
RUN = """
import sys
from pathlib import Path
from rig.analysis.analyses import calibrate
from rig.data.recording.run_file import read_run
from rig.report.writers import write_outcome
print(*(event.path.name for event in write_outcome(Path(sys.argv[2]), calibrate([read_run(Path(sys.argv[1]))]))))
"""


def test_a_writer_of_ones_own_is_a_file_and_a_line(tmp_path: Path) -> None:
    house = tmp_path / "house"
    shutil.copytree(ROOT / "rig", house / "rig")  # with what is compiled of it already
    (house / "rig" / "report" / "toy.py").write_text(TOY, encoding="utf-8")
    table = house / "rig" / "report" / "writers.py"
    before, after = table.read_text(encoding="utf-8").split('    "rig.report.header:write_header",\n')
    line = '    "rig.report.toy:write_toy",\n'
    table.write_text(f'{before}    "rig.report.header:write_header",\n{line}{after}', encoding="utf-8")
    folder = tmp_path / "run"
    folder.mkdir()
    done = subprocess.run(
        [sys.executable, "-c", RUN, str(RECORDINGS / "six_observation" / "run.h5"), str(folder)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(house), str(ROOT)])},
        cwd=house,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.stdout == "calibration.h toy.txt certificate.html result.json\n", done
    assert (folder / "toy.txt").read_text(encoding="utf-8") == "pass, 1 sensors"
    assert sorted(file.name for file in folder.iterdir()) == [
        "calibration.h",
        "certificate.html",
        "result.json",
        "toy.txt",
    ]
