"""A recording is judged by the settings it was recorded with, or by those that the user gives instead."""

import shutil
from pathlib import Path

import h5py
import pytest

from rig.analysis.analyses import calibrate
from rig.data.recording.run_data import RunData
from rig.data.recording.run_file import read_run
from support.paths import RECORDINGS

pytestmark = pytest.mark.slow

RECORDING = RECORDINGS / "six_observation" / "run.h5"


def test_keys_the_configuration_no_longer_has_do_not_matter(tmp_path: Path) -> None:
    changed = Path(shutil.copy(RECORDING, tmp_path))
    with h5py.File(changed, "r+") as file:
        file.attrs["config"] = file.attrs["config"].replace("rest_s:", "pause_s:") + "\nlighting: {colour: red}\n"
    assert calibrate([read_run(changed)]).checks == calibrate([read_run(RECORDING)]).checks


def test_another_limit_gives_another_verdict() -> None:
    run: RunData = read_run(RECORDING)
    assert calibrate([run]).passed
    assert not calibrate([run.override_settings(["limits.scale_std=1e-6"])]).passed
