"""The short procedures in which faults occur, on one sensor, and the truth of their results."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rig.data.result_file import read_result
from support.laboratories.worlds import merge

COVERAGE = 2.0  # U = 2 u
TRUTH: dict[str, dict[str, list[float]]] = {
    "gyro": {"scale": [1.1771, 1.1554, 1.1440], "bias_rad_s": [0.0077, -0.0100, -0.0051]},
    "accelerometer": {"scale": [1.012, 0.991, 1.007], "bias_m_s2": [0.35, -0.28, 0.51]},
}

SWEEPS: dict[str, Any] = {
    "arm": {"transfer_speed_deg_s": 170},
    "sensors": {"gyro": {"rate_hz": 59.5, "range_deg_s": 500}},
    "procedure": {"speed_deg_s": 150, "acceleration_deg_s2": 400, "rest_s": 0.9},
    "limits": {"scale_std": 0.02, "bias_std_rad_s": 0.02, "condition": 20},
    "world": {"time_scale": 8, "sensors": {"gyro": {**TRUTH["gyro"], "noise_rad_s": 0.005}}},
}
SETUPS: Mapping[str, dict[str, Any]] = {
    "six_observation": SWEEPS,
    "imu": merge(
        SWEEPS,
        {
            "sensors": {"gyro": {"acceleration": {"range_g": 2}}},
            "procedure": {
                "name": "imu", "order": None, "directions": None, "axes": 3, "attitudes": "faces", "dwell_s": 0.5
            },
            "site": {"gravity_m_s2": 9.807},
            "limits": {
                "acceleration_scale_deviation": 0.1,
                "acceleration_scale_std": 0.02,
                "acceleration_bias_m_s2": 1.0,
                "acceleration_bias_std_m_s2": 0.1,
            },
            "world": {
                "site": {"gravity_m_s2": 9.807},
                "sensors": {"gyro": {"accelerometer": {**TRUTH["accelerometer"], "noise_m_s2": 0.0113}}},
            },
        },
    ),
}  # fmt: skip


def errors_in_u(folder: Path) -> float:
    """Return the largest error in the results of the run in `folder`, in its expanded uncertainties."""
    result = read_result(folder)
    gyro = result.gyroscopes["gyro"]
    combined = gyro.covariance_combined if gyro.covariance_combined is not None else gyro.covariance
    errors = [_largest([*gyro.scale, *gyro.bias_rad_s], combined, [v for part in TRUTH["gyro"].values() for v in part])]
    for entry in (result.accelerometers or {}).values():
        truth = [v for part in TRUTH["accelerometer"].values() for v in part]
        errors.append(_largest([*entry.scale, *entry.bias_m_s2], entry.covariance, truth))
    return max(errors)


def _largest(stated: list[float], covariance: Any, truth: list[float]) -> float:
    std = np.sqrt(np.diag(np.array(covariance)))[: len(truth)]
    return float(np.max(np.abs(np.array(stated) - truth) / (COVERAGE * std)))
