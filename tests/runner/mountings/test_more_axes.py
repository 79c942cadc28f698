"""Twelve sweeps about six axes, at two speeds, through the whole chain."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from support.laboratories.commands import configuration, rig

pytestmark = [pytest.mark.slow, pytest.mark.proof, pytest.mark.thorough]


def test_six_axes_and_two_speeds_recover_the_simulated_truth(tmp_path: Path) -> None:
    chosen = ("procedure.axes=6", "procedure.speeds_deg_s=[75, 150]")
    overrides = [argument for each in chosen for argument in ("--set", each)]
    done = rig("run", configuration(tmp_path), "--out", tmp_path / "run", *overrides)
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    truth = yaml.safe_load((tmp_path / "run" / "config.yaml").read_text(encoding="utf-8"))["world"]["sensors"]["gyro"]
    sensor = result["gyroscopes"]["gyro"]
    assert len(sensor["observations"]) == 24
    assert np.degrees(sensor["speeds_rad_s"]) == pytest.approx([75, 150], rel=1e-2)
    odd, std = (np.array(sensor["nonlinearity"][f"odd_{each}per_rad_s"]) for each in ("", "std_"))
    assert (np.abs(odd) < 4 * std).all()
    error = np.array(sensor["scale"] + sensor["bias_rad_s"]) - np.array(truth["scale"] + truth["bias_rad_s"])
    assert (np.abs(error) < 4 * np.sqrt(np.diag(sensor["covariance_combined"]))).all()
    assert result["provenance"]["arm_kinematics"]["d_m"][0] == pytest.approx(0.1807)
    assert result["provenance"]["tcp_offset"] == [0.0] * 6
