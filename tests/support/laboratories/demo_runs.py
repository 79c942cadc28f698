"""Runs of the demonstration, compared with the simulated truth."""

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import yaml

from support.laboratories.worlds import fresh_host
from support.processes.waiting import PATIENCE_S


def compute_normalised_errors(rig: Sequence[str | Path], config: Path, seed: int, out: Path) -> np.ndarray:
    """Return errors (6,) of scale and bias over their reported standard deviations, from one run by command."""
    host = fresh_host()
    command = [*map(str, rig), "run", str(config), "--json", "--out", str(out)]
    changes = {"world.seed": seed, "arm.host": host, "board.port": f"socket://{host}:7321"}
    for path, value in changes.items():
        command += ["--set", f"{path}={value}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False, cwd=out.parent)
    assert done.returncode == 0, done.stderr
    sensor = json.loads(done.stdout)["gyroscopes"]["gyro"]
    truth = yaml.safe_load(config.read_text(encoding="utf-8"))["world"]["sensors"]["gyro"]
    error = np.array(sensor["scale"] + sensor["bias_rad_s"]) - np.array(truth["scale"] + truth["bias_rad_s"])
    return np.asarray(error / np.sqrt(np.diag(sensor["covariance"])))
