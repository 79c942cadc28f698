"""The rig is right on an arm ten times rougher than any that was logged: 5 % of ripple, in proportion to the speed."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from support.laboratories.commands import configuration, rig


@pytest.mark.slow
def test_a_run_on_rough_joints_recovers_the_simulated_truth(tmp_path: Path) -> None:
    config = configuration(tmp_path, {"world": {"arm": {"joints": "rough"}}, "history": {"off": True}})
    done = rig("run", config, "--out", tmp_path / "run")
    assert done.returncode == 0, done.stdout + done.stderr
    sensor = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))["gyroscopes"]["gyro"]
    truth = yaml.safe_load((tmp_path / "run" / "config.yaml").read_text(encoding="utf-8"))["world"]["sensors"]["gyro"]
    error = np.array(sensor["scale"] + sensor["bias_rad_s"]) - np.array(truth["scale"] + truth["bias_rad_s"])
    assert np.all(np.abs(error) < 4 * np.sqrt(np.diag(sensor["covariance"])))
