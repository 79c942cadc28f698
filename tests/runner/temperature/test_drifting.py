"""A bias drift from end to end: attitudes again and again, a kill in between, and the biases by repeat."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig.data.recording.run_file import read_run
from rig.observation.finished_steps import complete_dwells
from support.laboratories.commands import configuration, rig, rig_here, wait_for_log

SIX = [[0, -90, 0], [-90, -90, 0], [-90, -90, 90], [-180, -90, 45], [90, -90, -45], [45, -90, 90]]
PROCEDURE = {"name": "bias_drift", "attitudes": SIX, "dwell_s": 0.6, "repeats": 3, "acceleration_deg_s2": 700}
LABORATORY: dict[str, Any] = {
    "arm": {"transfer_speed_deg_s": 170},
    "sensors": {"gyro": {"acceleration": {"range_g": 2}}},
    "limits": {
        "scale_std": 1,
        "bias_std_rad_s": 1,
        "acceleration_scale_deviation": 0.1,
        "acceleration_scale_std": 0.01,
        "acceleration_bias_m_s2": 1,
        "acceleration_bias_std_m_s2": 0.05,
        "acceleration_verification_m_s2": 0.02,
        "bias_drift_rad_s": 0.005,
        "acceleration_bias_drift_m_s2": 0.02,
    },
    "world": {
        "time_scale": 10,
        "sensors": {
            "gyro": {"noise_rad_s": 0.005, "accelerometer": {"bias_m_s2": [0.3, -0.2, 0.4], "noise_m_s2": 0.015}}
        },
    },
}

pytestmark = pytest.mark.slow


@pytest.mark.proof
@pytest.mark.thorough
def test_a_killed_run_loses_one_dwell_at_most_and_tells_every_repeat(tmp_path: Path) -> None:
    config, out = configuration(tmp_path, LABORATORY, PROCEDURE), tmp_path / "run"
    command = [sys.executable, "-m", "rig", "run", str(config), "--out", str(out), "--yes"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True) as run:
        wait_for_log(out, "done: dwell at", times=8)
        os.killpg(run.pid, signal.SIGKILL)
    kept = complete_dwells(read_run(out / "run.h5"))
    resumed = rig("resume", out)
    assert resumed.returncode == 0, resumed.stdout + resumed.stderr
    repeated = complete_dwells(read_run(out / "run-2.h5"))
    # The file is flushed four times a second, in which this laboratory goes through a dwell, or two when it is quick.
    assert len(kept) >= 6 and not kept & repeated and kept | repeated == set(range(18))

    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    truth = yaml.safe_load(config.read_text(encoding="utf-8"))["world"]["sensors"]["gyro"]
    found = result["bias_drift"]["gyro"]
    for repeat in found["acceleration"]["repeats"]:
        off = np.array(repeat["scale_fixed"]["bias"]) - truth["accelerometer"]["bias_m_s2"]
        std = np.hypot(repeat["scale_fixed"]["std"], found["acceleration"]["common_std"])
        assert np.all(np.abs(off) < 5 * std)
        assert "bias" in repeat["scale_free"]
    assert len(found["rate"]["repeats"]) == 3 and "too_few_observations" in found["rate"]["temperature_slope"]["error"]
    assert {"gyro.bias_drift", "gyro.acceleration_bias_drift"} <= {check["name"] for check in result["checks"]}
    assert "largest change of the bias" in resumed.stdout
    assert "bias by repeat" in rig_here("show", out, "--all").stdout
    for suffix in (".png", ".svg"):
        assert (out / f"bias_drift_gyro{suffix}").stat().st_size > 10_000
