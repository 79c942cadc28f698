"""The rig measures what it says: seeds of the whole chain against the simulated truth."""

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import yaml

from support.paths import DEMO
from support.worlds import fresh_host

SEEDS = range(1, 21)
FEW = range(1, 2)


def normalised_errors(seed: int, folder: Path) -> np.ndarray:
    """(6,) errors of scale and bias over their reported standard deviations, from one run of the demonstration."""
    host = fresh_host()
    out = folder / str(seed)
    command = [sys.executable, "-m", "rig", "run", str(DEMO), "--json", "--out", str(out)]
    changes = {"world.seed": seed, "arm.host": host, "board.port": f"socket://{host}:7321"}
    for path, value in changes.items():
        command += ["--set", f"{path}={value}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
    sensor = json.loads(done.stdout)["sensors"]["gyro"]
    truth = yaml.safe_load(DEMO.read_text(encoding="utf-8"))["world"]["sensors"]["gyro"]
    error = np.array(sensor["scale"] + sensor["bias_rad_s"]) - np.array(truth["scale"] + truth["bias_rad_s"])
    return np.asarray(error / np.sqrt(np.diag(sensor["covariance"])))


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.timeout(900)
def test_errors_are_as_large_as_reported(tmp_path: Path, thorough: bool) -> None:
    with ThreadPoolExecutor(2) as two_at_once:  # each run is mostly one process that simulates, and waits for its arm
        seeds = SEEDS if thorough else FEW
        errors = np.array(list(two_at_once.map(partial(normalised_errors, folder=tmp_path), seeds)))
    rms = float(np.sqrt(np.mean(errors**2)))
    print(f"largest error {np.abs(errors).max():.2f} σ, RMS {rms:.3f} σ over {errors.size} errors")
    assert np.abs(errors).max() < 4
    # Three standard deviations of the RMS of so many independent errors, a little more than 0.2 for all seeds.
    assert abs(rms - 1) < 3 / np.sqrt(2 * errors.size)
