"""imucal's JSON, version 2.0.0, of a turntable calibration: the one format that holds everything.

imucal (2.6, ferraris_calibration_info.py): a = R_a⁻¹ K_a⁻¹ (m_a − b_a), ω = R_g⁻¹ K_g⁻¹ (m_g − K_ga a − b_g).
"""

import json
from collections.abc import Mapping

import numpy as np

from rig.data.result_file import ResultDocument
from rig.report.exports.parameters import Exported, comments, exported

FORMAT_VERSION = "2.0.0"


def imucal_files(result: ResultDocument) -> Mapping[str, str]:
    """One file for each sensor."""
    return {
        f"{each.name}_imucal.json": json.dumps(_document(result, each), indent=2) + "\n" for each in exported(result)
    }


def _document(result: ResultDocument, sensor: Exported) -> dict[str, object]:
    acceleration, rates = sensor.accelerometer, sensor.gyroscope
    return {
        "cal_type": "Turntable",
        "_format_version": FORMAT_VERSION,
        "acc_unit": "m/s^2",
        "gyr_unit": "rad/s",
        "from_acc_unit": "m/s^2",
        "from_gyr_unit": "rad/s",
        "comment": ". ".join([*comments(result, sensor), *_convention(sensor)]),
        "K_a": (np.eye(3) if acceleration is None else acceleration.scale).tolist(),
        "R_a": (np.eye(3) if acceleration is None else acceleration.axes).tolist(),
        "b_a": (np.zeros(3) if acceleration is None else acceleration.offset).tolist(),
        "K_g": rates.scale.tolist(),
        "R_g": rates.axes.tolist(),
        "K_ga": sensor.g_sensitivity.tolist(),
        "b_g": rates.offset.tolist(),
    }


def _convention(sensor: Exported) -> list[str]:
    said = ["w = R_g^-1 K_g^-1 (m - K_ga a - b_g), in the right-angled frame nearest to the gyroscope's axes; b_g = -b"]
    if sensor.accelerometer is None:
        said.append("No accelerometer was calibrated: K_a, R_a, b_a are those of an ideal one")
    if not sensor.found_g_sensitivity:
        said.append("The g-sensitivity was not found: K_ga is zero")
    if sensor.second_order:
        said.append("Left out: the accelerometer's second order")
    return [*said, "Left out: uncertainties, temperature, nonlinearity; they are in result.json"]
