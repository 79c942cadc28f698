"""A run in stages, in a simulated laboratory whose operator mounts the board anew: asked, tried, swept, solved."""

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.data.recording.run_file import read_run
from support.laboratories.commands import configuration, rig, wait_for_log
from support.laboratories.worlds import hardware
from support.processes.waiting import PATIENCE_S

pytestmark = pytest.mark.slow

QUARTER = {"x": "+y", "y": "-x", "z": "+z"}  # about wrist 3
TIPPED = {"x": "+x", "y": "+z", "z": "-y"}
STAGES: list[dict[str, Any]] = [
    {"instruction": "fix the board as it is drawn", "sweeps": ["wrist_3", "wrist_1"]},
    {"instruction": "turn the board by 90° about wrist 3", "mount": QUARTER},
]


def in_stages(truth: list[dict[str, Any]], stages: list[dict[str, Any]] = STAGES, **more: Any) -> dict[str, Any]:
    return {"procedure": {"stages": stages}, "world": {"mounts": truth}, **more}


@pytest.mark.thorough
def test_a_board_that_is_mounted_anew_gives_one_calibration(tmp_path: Path) -> None:
    out = tmp_path / "run"
    config = configuration(tmp_path, in_stages([{}, {**QUARTER, "rotation_deg": [0.4, -0.6, 0.5]}]))
    done = rig("run", config, "--out", out, "--json")
    assert done.returncode == 0, done.stderr + done.stdout
    assert [read_run(out / name).settings.stage for name in ("run.h5", "run-2.h5")] == [0, 1]
    result = json.loads(done.stdout)
    (sensor,) = result["gyroscopes"].values()
    truth = np.array([1.1771, 1.1554, 1.1440])
    assert np.abs(np.array(sensor["scale"]) - truth).max() < 0.01
    (mount,) = result["mounts"]
    assert mount["stage"] == 2
    assert np.degrees(mount["rotation_rad"]) == pytest.approx([0.4, -0.6, 0.5], abs=0.35)
    log = (out / "log.txt").read_text(encoding="utf-8")
    assert "Stage 2 of 2: turn the board by 90° about wrist 3" in log


@pytest.mark.thorough
def test_an_instruction_that_was_not_followed_ends_the_run_before_a_sweep(tmp_path: Path) -> None:
    """The board stays as it was: no accelerometer tells, so a small turn does, about the first axis that differs."""
    out = tmp_path / "run"
    done = rig("run", configuration(tmp_path, in_stages([{}])), "--out", out)
    assert done.returncode == 3, done.stderr + done.stdout
    assert "mounted_otherwise" in done.stderr
    assert "in the trial of wrist_1 gyro is turned about the item's" in " ".join(done.stderr.split())
    assert not [event for event in read_run(out / "run-2.h5").events if "Sweep" in type(event.event).__name__]


@pytest.mark.thorough
def test_an_accelerometer_refuses_it_before_anything_has_moved(tmp_path: Path) -> None:
    stages: list[dict[str, Any]] = [{"instruction": "as it is"}, {"instruction": "tip the board", "mount": TIPPED}]
    config = configuration(tmp_path, in_stages([TIPPED], stages, sensors={"gyro": {"acceleration": {}}}))
    done = rig("run", config, "--out", tmp_path / "run")
    assert done.returncode == 2, done.stderr + done.stdout
    assert "mounted_otherwise" in done.stderr
    assert "points up" in done.stderr


@pytest.mark.thorough
def test_a_run_that_was_interrupted_in_its_second_stage_goes_on_there(tmp_path: Path) -> None:
    out = tmp_path / "run"
    config = configuration(tmp_path, in_stages([{}, QUARTER]))
    command = [sys.executable, "-m", "rig", "run", str(config), "--out", str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as begun:
        wait_for_log(out, "Stage 2 of 2")
        wait_for_log(out, "sweep wrist_2")
        begun.send_signal(signal.SIGINT)
        _, errors = begun.communicate(timeout=PATIENCE_S)
    assert "rig resume" in errors
    resumed = rig("resume", out)
    assert resumed.returncode == 0, resumed.stderr + resumed.stdout
    stages = [read_run(out / name).settings.stage for name in ("run.h5", "run-2.h5", "run-3.h5")]
    assert stages == [0, 1, 1]
    assert "stage 1 of 2" not in resumed.stderr.lower()


def test_yes_cannot_say_that_the_item_is_mounted(tmp_path: Path) -> None:
    """Hands are at the item when it is mounted, so a person says that they are away; nothing is connected before."""
    config = hardware(configuration(tmp_path, {"procedure": {"stages": STAGES}}), tmp_path)
    done = rig("run", config, "--yes", "--out", tmp_path / "run")
    assert done.returncode == 2, done.stderr + done.stdout
    assert "not_mounted" in done.stderr
    assert not (tmp_path / "run").exists()
