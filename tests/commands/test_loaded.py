"""A command loads what it needs: a history, a plan and a report do not wait for libraries of recordings and arms."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from rig.history.store import open_history
from support.history.past_runs import finish_run
from support.paths import DEMO, RECORDINGS

pytestmark = pytest.mark.slow

# What takes long to load: the recordings' library, the solver's, the arm's client, plots, the page's server.
SLOW = ("h5py", "scipy", "rtde_control", "rtde_receive", "rtde_io", "matplotlib", "uvicorn", "distributed", "joblib")
COMMAND = """
import json, sys

def loaded():
    return sorted(name for name in json.loads(sys.argv[1]) if name in sys.modules)

class Told:
    encoding, first = "utf-8", None
    def write(self, text):
        if self.first is None and text.strip():
            self.first = loaded()
    def flush(self): ...
    def isatty(self): return False

told, there = Told(), sys.stdout
sys.stdout = told
from rig.cli import main
status = main(sys.argv[2:])
print(json.dumps([status, told.first, loaded()]), file=there)
"""


def loaded(*arguments: str | Path, among: tuple[str, ...] = SLOW) -> tuple[list[str], list[str]]:
    """Which of the slow libraries, or other modules, are there at a command's first line, and at its end."""
    command = [sys.executable, "-c", COMMAND, json.dumps(among), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, env=dict(os.environ), check=False)
    assert done.returncode == 0, done.stderr
    status, first, last = json.loads(done.stdout)
    assert status == 0 and first is not None, done.stderr
    return first, last


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A history of two sensors, the one that is meant."""
    monkeypatch.setenv("RIG_HISTORY", str(tmp_path / "history.sqlite"))
    with open_history(str(tmp_path / "history.sqlite")) as history:
        for day in range(3):
            history.enter(finish_run(day, serial_number=f"G-{day % 2}"))
    return tmp_path


@pytest.mark.one_in(3)  # all read one history by the same modules; a list and what was entered differ in what they show
@pytest.mark.parametrize("words", [(), ("list", "--csv"), ("G-0",), ("show", "1")])
def test_what_the_history_knows_is_told_without_them(words: tuple[str, ...], place: Path) -> None:
    assert loaded("history", *words) == ([], [])


@pytest.mark.thorough
def test_a_comparison_loads_no_more_than_its_limit_needs(place: Path) -> None:
    assert {library for libraries in loaded("history", "compare", "1", "3") for library in libraries} <= {"scipy"}


@pytest.mark.thorough
def test_a_report_is_written_without_them(place: Path) -> None:
    run = shutil.copytree(RECORDINGS / "six_observation", place / "run")
    assert {library for libraries in loaded("report", run) for library in libraries} <= {"scipy"}  # for Student's t


@pytest.mark.thorough
def test_the_steps_of_a_plan_are_told_before_what_takes_longer_to_find() -> None:
    first, last = loaded("plan", DEMO)
    assert first == [] and set(last) <= {"scipy"}  # for how small a disturbance its checks can notice


def test_the_process_that_the_arms_client_lives_in_waits_for_no_library() -> None:
    libraries = ("numpy", "pydantic", "yaml", "scipy")
    command = f"import rig.turners.ur.child.client_process, sys; print([n for n in {libraries} if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_plan_reads_no_recording_and_a_result_is_shown_without_the_analysis() -> None:
    unused: tuple[str, ...] = ("rig.data.recording.run_file", "rig.data.recording.provenance", "rig.data.result_file")
    assert loaded("plan", DEMO, among=unused) == ([], [])
    unused = ("rig.data.recording.run_file", "rig.analysis.judging", "rig.observation", "rig.data.recording.settings")
    assert loaded("show", RECORDINGS / "six_observation", among=unused) == ([], [])
    assert loaded("solve", RECORDINGS / "six_observation", among=("rig.analysis.external.attitudes",)) == ([], [])
