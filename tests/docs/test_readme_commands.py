"""What the README shows can be typed: what needs no arm is run here on a frozen run, the rest elsewhere."""

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

import rig
from support.laboratories.commands import rig_here
from support.paths import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
FROZEN = ROOT / "tests" / "fixtures" / "recordings" / "verified"
# Commands of the README's blocks that move an arm, or install: where they are run, or that they need hardware.
ELSEWHERE = {
    "make demo": "tests/installation/test_wheel.py",
    "make check": ".ci/run",
    "make test": ".ci/run",
    "make docs": "tests/docs/test_site.py",
    ". .venv/bin/activate": "the shell's own",
    "rig run configs/lsm9ds1_adis16465.yaml": "tests/runner/test_experiment.py",
    "rig run configs/imu.yaml": "tests/runner/reference/test_accelerometer_truth.py",
    "rig check configs/ur10e_lsm9ds1.yaml": "hardware",
    "rig run configs/ur10e_lsm9ds1.yaml": "hardware",
}
PLANNED = ("rig plan configs/imu.yaml", "rig plan configs/ur10e_lsm9ds1.yaml")
ON_A_RUN = (
    "rig show RUN --all",
    "rig explain scale_changed",
    "rig solve RUN --estimator newton",
    "rig solve docs/examples/samples.csv --sweeps docs/examples/sweeps.csv",
    "rig allan RUN",
    "rig report RUN --out OUT",
    "rig export RUN --format csv --out OUT",
    "rig history",
)


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


@pytest.fixture
def run_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of a frozen run, and a history of its own."""
    monkeypatch.setenv("RIG_HISTORY", str(tmp_path / "history.sqlite"))
    monkeypatch.chdir(ROOT)
    return Path(shutil.copytree(FROZEN, tmp_path / "run"))


def test_every_command_of_a_block_is_run_somewhere() -> None:
    lines = [re.sub(r"\s+#.*", "", line) for block in blocks("") for line in block.splitlines()]
    shown = {line for line in lines if re.match(r"(?:make|rig|\.) \S", line)}
    assert shown == {*ELSEWHERE, *PLANNED}
    for place in ELSEWHERE.values():
        assert "/" not in place or (ROOT / place).exists(), f"{place} is not there"


@pytest.mark.slow
@pytest.mark.parametrize("command", [*PLANNED, *ON_A_RUN])
def test_what_needs_no_arm_works_as_shown(command: str, run_folder: Path, tmp_path: Path) -> None:
    places = {"RUN": str(run_folder), "OUT": str(tmp_path / "out")}
    arguments = [places.get(word, word) for word in shlex.split(command)[1:]]
    done = rig_here(*arguments)
    assert done.returncode == 0, done.stderr
    assert done.stdout


@pytest.mark.slow
def test_the_notebook_s_lines_work_as_shown(run_folder: Path) -> None:
    (shown,) = blocks("python")
    text = re.sub(r'"runs/[^"]*"', repr(str(run_folder)), shown)
    names: dict[str, object] = {"readings_rad_s": np.zeros((3, 3))}
    exec(compile(text, "README.md", "exec"), names)
    run = names["run"]
    assert isinstance(run, rig.Run)
