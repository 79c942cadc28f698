"""Runs with a device that prints lines: its calibration is the truth within U, and a time by arrival has its cost."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig.data.recording.run_file import read_run
from support.laboratories.commands import rig
from support.laboratories.worlds import fresh_host, merge
from support.paths import CONFIGS

pytestmark = pytest.mark.slow

JITTER_MS = 40.0  # of when a line arrives that a shared computer simulates
LINES = CONFIGS / "own_port" / "lines.yaml"
TRUTH = np.array([1.011, 0.993, 1.006, 0.012, -0.02, 0.007])


def configuration(folder: Path, *changes: dict[str, Any]) -> Path:
    """lines.yaml so changed, on an address of its own."""
    host = fresh_host()
    document = yaml.safe_load(LINES.read_text(encoding="utf-8"))
    for change in changes:
        document = merge(document, change)
    document["arm"]["host"] = host
    document["sensors"]["imu"]["serial"]["port"] = f"socket://{host}:7341"
    path = folder / "config.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


def calibrated(folder: Path, *changes: dict[str, Any]) -> dict[str, Any]:
    """The sensor's entry in `result.json` of a run."""
    done = rig("run", configuration(folder, *changes), "--out", folder / "run")
    assert done.returncode == 0, done.stderr + done.stdout
    result: dict[str, Any] = json.loads((folder / "run" / "result.json").read_text(encoding="utf-8"))
    entry: dict[str, Any] = result["gyroscopes"]["imu"]
    return entry


def off(entry: dict[str, Any]) -> np.ndarray:
    """(6,) errors of scale and bias, each by its standard uncertainty."""
    std = np.sqrt(np.diag(entry["covariance_combined"]))
    found: np.ndarray = (np.array(entry["scale"] + entry["bias_rad_s"]) - TRUTH) / std
    return found


def by_noise(entry: dict[str, Any]) -> np.ndarray:
    """(6,) errors of scale and bias, each by what the scatter of the readings contributes to its uncertainty."""
    (noise,) = (contributor for contributor in entry["budget"]["contributors"] if contributor["name"] == "noise")
    found: np.ndarray = (np.array(entry["scale"] + entry["bias_rad_s"]) - TRUTH) / noise["std"]
    return found


@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.timeout(3000)
def test_its_noise_is_what_its_errors_are(tmp_path: Path) -> None:
    """A steady simulated device has none of what is assumed of any: errors are by the budget's line of the noise."""
    errors = []
    for seed in range(6):
        (tmp_path / str(seed)).mkdir()
        entry = calibrated(tmp_path / str(seed), {"world": {"seed": 100 + seed}})
        errors.append(by_noise(entry))
        assert np.abs(off(entry)).max() < 4
    assert 0.70 < np.sqrt(np.mean(np.square(errors))) < 1.31, "99 % of the means of 36 squares lie between"


@pytest.mark.proof
@pytest.mark.thorough
def test_arrival_times_cost_as_much_as_the_budget_states(tmp_path: Path) -> None:
    """The laboratory goes at the computer's pace, for its clock is the sensor's: a busy computer cannot tell."""
    columns = ["-", "gx", "gy", "gz", "ax", "ay", "az", "temperature"]
    lines = {"columns": columns, "time": None, "clock": "arrival", "jitter_ms": JITTER_MS}
    for attempt in range(3):
        folder = tmp_path / str(attempt)
        folder.mkdir()
        changes = {"sensors": {"imu": {"lines": lines}}, "world": {"time_scale": 1}}
        done = rig("run", configuration(folder, changes), "--out", folder / "run")
        if kept_pace(folder / "run"):
            break
    else:
        pytest.skip("the simulated laboratory stood still again and again, and the computer's clock went on")
    assert done.returncode == 0, done.stderr + done.stdout
    entry = json.loads((folder / "run" / "result.json").read_text(encoding="utf-8"))["gyroscopes"]["imu"]
    assert np.abs(off(entry)).max() < 4
    (stamps,) = (
        contributor for contributor in entry["budget"]["contributors"] if contributor["name"] == "times of the samples"
    )
    assert max(stamps["std"][:3]) > 0


def kept_pace(folder: Path) -> bool:
    """Whether the states of a run came as evenly as lines must that are timed by when they arrive."""
    states = read_run(folder / "run.h5").states
    return bool(np.ptp(states["host_time_s"] - states["time_s"]) < 2e-3 * JITTER_MS)
