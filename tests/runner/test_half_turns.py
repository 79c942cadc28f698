"""A run whose sweeps are half a turn, in the simulated laboratory, from the question to the certificate."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from support.laboratories.commands import configuration, rig

pytestmark = [pytest.mark.slow, pytest.mark.proof]

ONCE_RAD, TWICE_RAD = 3e-4, 1e-4  # what the simulated encoders err
STD_DEG = float(np.degrees(np.hypot(ONCE_RAD, TWICE_RAD) / np.sqrt(2)))


@pytest.mark.thorough
def test_half_turns_recover_the_simulated_truth(tmp_path: Path) -> None:
    changes = {
        "procedure": {"arc_deg": 180},
        "uncertainty": {"angle_std_deg": STD_DEG},
        "limits": {"bias_std_rad_s": 0.02},  # half the readings of whole turns
        "world": {"arm": {"unmodelled": {"encoder_once_rad": ONCE_RAD, "encoder_twice_rad": TWICE_RAD}}},
    }
    done = rig("run", configuration(tmp_path, changes), "--out", tmp_path / "run")
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    truth = yaml.safe_load((tmp_path / "run" / "config.yaml").read_text(encoding="utf-8"))["world"]["sensors"]["gyro"]
    sensor = result["gyroscopes"]["gyro"]
    assert [observation["angle_rad"] for observation in sensor["observations"]] == pytest.approx([np.pi] * 6)
    assert "turner's encoders" in {contributor["name"] for contributor in sensor["budget"]["contributors"]}
    error = np.array(sensor["scale"] + sensor["bias_rad_s"]) - np.array(truth["scale"] + truth["bias_rad_s"])
    assert (np.abs(error) < 4 * np.sqrt(np.diag(sensor["covariance_combined"]))).all()
    page = (tmp_path / "run" / "certificate.html").read_text(encoding="utf-8")
    assert "turns by 180°, by the turner's encoders" in page
    assert "closure of the circle" not in page
