"""What the README shows can be typed: what needs no arm is run here on a frozen run, the rest elsewhere."""

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

import rig
from rig.data.latest_run import note_run
from support.laboratories.commands import rig_here
from support.paths import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
FROZEN = ROOT / "tests" / "fixtures" / "recordings" / "verified"
# Commands of the README's blocks that move an arm, install or ask: where they are run, or that they need hardware.
ELSEWHERE = {
    "pip install '.[world]'": "tests/installation/test_wheel.py",
    "rig demo": "tests/installation/test_wheel.py",
    "rig watch latest": "tests/page/test_page_in_a_browser.py",
    "rig run configs/imu.yaml": "tests/runner/reference/test_accelerometer_truth.py",
    "rig check my.yaml": "hardware",
    "rig run my.yaml": "hardware",
}
# Commands in its sentences and its table.
IN_SENTENCES = {
    "uvx --from 'calibration-rig[world]' rig demo": "needs a release; tests/installation/test_wheel.py runs the wheel",
    "rig": "tests/commands/test_cli.py",
    "rig demo": "tests/installation/test_wheel.py",
    "rig demo --files .": "tests/installation/test_wheel.py",
    "rig lines PORT --write my.yaml": "tests/commands/devices/test_new.py",
    "rig run my.yaml": "needs hardware",
    "rig board flash": "needs hardware",
    "rig new my.yaml": "tests/commands/devices/test_new.py",
    "rig check my.yaml": "needs hardware",
    "rig look LOG": "tests/commands/offline/test_look.py",
    "rig explain NAME": "tests/report/terminal/test_ending.py",
    "rig show": "tests/report/terminal/test_ending.py",
}
ON_A_RUN = (
    "rig show latest --all",
    "rig report latest",
    "rig history",
    "rig plan my.yaml",
    "rig solve docs/examples/samples.csv --sweeps docs/examples/sweeps.csv",
)
NOT_SHOWN = (
    "rig explain scale_changed",
    "rig solve latest --estimator newton",
    "rig allan latest",
    "rig export latest --format csv --out OUT",
    "rig demo --files OUT",
)
NEW = "new my.yaml --turner hand --sensor board --part lsm9ds1 --port /dev/ttyACM0 --serial-number G1"
LONGEST = 110  # lines: it is read in one sitting


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


@pytest.fixture
def run_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of a frozen run, which is the latest, a history of its own, and a folder to work in."""
    monkeypatch.setenv("RIG_HISTORY", str(tmp_path / "history.sqlite"))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "share"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    folder = Path(shutil.copytree(FROZEN, tmp_path / "run"))
    note_run(folder)
    return folder


def test_it_is_read_in_one_sitting() -> None:
    assert len(README.splitlines()) <= LONGEST


def test_every_command_of_a_block_is_run_somewhere() -> None:
    lines = [re.sub(r"\s+#.*", "", line) for block in blocks("") for line in block.splitlines()]
    shown = {line for line in lines if re.match(r"(?:make|pip|rig|\.) \S", line)}
    assert shown == {*ELSEWHERE, *ON_A_RUN}
    for place in ELSEWHERE.values():
        assert "/" not in place or (ROOT / place).exists(), f"{place} is not there"


def test_every_command_of_a_sentence_is_run_somewhere_or_says_what_it_needs() -> None:
    prose = re.sub(r"^```.*?^```$", "", README, flags=re.MULTILINE | re.DOTALL)
    shown = {command for command in re.findall(r"`([^`]+)`", prose) if re.match(r"(make|uvx|rig)\b(?!\.)", command)}
    assert shown == IN_SENTENCES.keys()
    for place in IN_SENTENCES.values():
        assert place.startswith("needs ") or (ROOT / place).exists(), f"{place} is not there"


@pytest.mark.slow
@pytest.mark.parametrize("command", [*ON_A_RUN, *NOT_SHOWN])
def test_what_needs_no_arm_works_as_shown(command: str, run_folder: Path, tmp_path: Path) -> None:
    if "my.yaml" in command:
        assert rig_here(*NEW.split()).returncode == 0
    arguments = [word.replace("OUT", str(tmp_path / "out")) for word in shlex.split(command)[1:]]
    done = rig_here(*arguments)
    assert done.returncode == 0, done.stderr
    assert done.stdout


@pytest.mark.slow
def test_the_notebook_s_lines_work_as_shown(run_folder: Path) -> None:
    (shown,) = blocks("python")
    names: dict[str, object] = {"readings_rad_s": np.zeros((3, 3))}
    exec(compile(shown, "README.md", "exec"), names)
    run = names["run"]
    assert isinstance(run, rig.Run)
