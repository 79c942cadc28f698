"""Runs with a device that prints lines: its calibration is the truth within U, and a time by arrival has its cost."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig.data.quantity import PRESSURE, TEMPERATURE
from rig.data.recording.run_file import read_run
from rig.notebook.runs import load
from support.laboratories.commands import rig
from support.laboratories.worlds import fresh_host, merge
from support.paths import CONFIGS

JITTER_MS = 40.0  # of when a line arrives that a shared computer simulates
LINES = CONFIGS / "own_port" / "lines.yaml"
QUICK: dict[str, Any] = {
    "procedure": {"speed_deg_s": 150, "acceleration_deg_s2": 400, "rest_s": 0.5},
    "limits": {"scale_std": 0.01, "bias_std_rad_s": 0.05},
}
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


@pytest.mark.slow
def test_a_device_that_prints_lines_is_calibrated_on_the_arm_and_its_barometer_recorded(tmp_path: Path) -> None:
    """So is its thermometer of the room: named in the configuration, both come out of every way out."""
    scalars = {"air": {"unit": "hPa"}, "room": {"unit": "K"}}
    columns = ["time", "gx", "gy", "gz", "ax", "ay", "az", "temperature", "air", "room"]
    printed = {"lines": {"scalars": {"air": 964.8, "room": 294.65}}}
    changes = {"sensors": {"imu": {"lines": {"columns": columns, "scalars": scalars}}}}
    assert np.abs(off(calibrated(tmp_path, QUICK, changes, {"world": {"sensors": {"imu": printed}}}))).max() < 4
    folder = tmp_path / "run"
    run = read_run(folder / "run.h5")
    assert {name: sensor.channels[0].measures for name, sensor in run.sensors.items() if not sensor.has_axes} == {
        "imu_air": PRESSURE,
        "imu_room": TEMPERATURE,
    }
    assert run.sensors["imu_air"].channel(PRESSURE).values(run.samples["imu_air"]) == pytest.approx(96_480)
    shown = rig("show", folder, "--sensor", "imu_air")
    assert "pressure mean 964.80, 964.80 to 964.80 hPa" in shown.stdout, shown.stderr
    assert rig("export", folder, "--format", "csv", "--out", tmp_path / "tables").returncode == 0
    header, first, *_ = (tmp_path / "tables" / "imu_room.csv").read_text(encoding="utf-8").splitlines()
    assert header == "time_s,temperature_c" and float(first.split(",")[1]) == pytest.approx(21.5)
    frame = load(folder)["imu_air"].to_frame()
    assert frame["pressure_pa"].iloc[0] == pytest.approx(96_480)
    assert frame.index[0] == pytest.approx(load(folder)["imu"].to_frame().index[0], abs=1e-6), "on one clock"


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.thorough
def test_a_time_by_arrival_costs_what_the_budget_says(tmp_path: Path) -> None:
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
