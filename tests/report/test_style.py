"""Pictures depend on nothing that lies in the working folder, which may have come from anybody."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from support.paths import RECORDINGS

pytestmark = pytest.mark.slow


@pytest.mark.thorough
def test_a_matplotlibrc_in_the_working_folder_changes_nothing(tmp_path: Path) -> None:
    drawn = []
    for name, settings in (("plain", ""), ("foreign", "text.usetex: True\nfigure.facecolor: red\n")):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "matplotlibrc").write_text(settings, encoding="utf-8")
        command = [sys.executable, "-P", "-m", "rig", "allan", str(RECORDINGS / "six_observation"), "--plot", "."]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        drawn.append((folder / "allan_gyro.svg").read_bytes())
    assert drawn[0] == drawn[1]
