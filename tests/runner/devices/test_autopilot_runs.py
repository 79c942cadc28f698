"""Runs with an autopilot's IMUs on the arm: the truth is found though it corrects, and what is stored corrects."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from support.laboratories.commands import rig
from support.laboratories.ideal import ideal_document
from support.laboratories.worlds import fresh_host, merge
from support.paths import CONFIGS

pytestmark = pytest.mark.slow

QUICK: dict[str, Any] = {
    "arm": {"transfer_speed_deg_s": 170},
    "sensors": {"imu1": {"rate_hz": 50, "acceleration": None}},
    "procedure": {"speed_deg_s": 170, "acceleration_deg_s2": 700, "rest_s": 0.5},
    "limits": {"bias_std_rad_s": 0.01, "scale_std": 0.01},
}
TRUTH = [1.006, 0.994, 1.003, 0.008, -0.011, 0.005]


def configuration(folder: Path, *changes: dict[str, Any]) -> Path:
    """autopilot.yaml so changed, on an address of its own."""
    host = fresh_host()
    document = ideal_document(CONFIGS / "own_port" / "autopilot.yaml")
    for change in (QUICK, *changes):
        document = merge(document, change)
    document["arm"]["host"] = host
    document["sensors"]["imu1"]["mavlink"]["port"] = f"socket://{host}:5760"
    path = folder / "config.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


def off(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """(6,) how far scale and bias are from the truth, and their standard deviations."""
    entry = json.loads((folder / "result.json").read_text(encoding="utf-8"))["gyroscopes"]["imu1"]
    return np.array(entry["scale"] + entry["bias_rad_s"]) - TRUTH, np.sqrt(np.diag(entry["covariance_combined"]))


def test_what_a_run_found_is_stored_corrects_and_is_undone_in_the_next(tmp_path: Path, thorough: bool) -> None:
    """The first undoes what was stored before it, as the next does: that one is for `make proof`."""
    kept = {"world": {"sensors": {"imu1": {"autopilot": {"parameter_file": str(tmp_path / "memory.json")}}}}}
    config = configuration(tmp_path, kept)
    done = rig("run", config, "--out", tmp_path / "run")
    assert done.returncode == 0, done.stderr + done.stdout
    error, std = off(tmp_path / "run")
    assert (np.abs(error) < 4 * std).all() and std.max() < 3e-3
    done = rig("autopilot", "store", config, tmp_path / "run", "--yes")
    assert done.returncode == 0, done.stderr
    offsets = json.loads((tmp_path / "memory.json").read_text(encoding="utf-8"))
    stored = [np.frombuffer(bytes.fromhex(offsets[f"INS_GYROFFS_{axis}"]), "<f4")[0] for axis in "XYZ"]
    # At rest the part reads -b: what the autopilot sends of it then is as far from no turn as b was found wrong.
    assert (np.abs(np.negative(stored) - TRUTH[3:]) < 4 * std[3:]).all()
    if not thorough:
        return
    done = rig("run", config, "--out", tmp_path / "again")
    assert done.returncode == 0, done.stderr + done.stdout
    error, std = off(tmp_path / "again")
    assert (np.abs(error) < 4 * std).all(), "the new offsets are undone as the old ones were"


@pytest.mark.thorough
def test_an_armed_autopilot_is_refused_before_anything_moves(tmp_path: Path) -> None:
    config = configuration(tmp_path, {"world": {"sensors": {"imu1": {"autopilot": {"armed": True}}}}})
    done = rig("run", config, "--out", tmp_path / "run")
    assert done.returncode == 2 and "autopilot_armed" in done.stderr and "pre-flight" not in done.stderr
    done = rig("check", config)
    assert done.returncode == 2 and "autopilot_armed" in done.stderr
