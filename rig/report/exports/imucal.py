"""imucal's JSON, version 2.0.0, of a turntable calibration: the only format that contains all corrections.

imucal (2.6, ferraris_calibration_info.py): a = R_a⁻¹ K_a⁻¹ (m_a − b_a), ω = R_g⁻¹ K_g⁻¹ (m_g − K_ga a − b_g), with
specific force a, rate ω, readings m, scale factors K on the diagonal, axes R, biases b, and g-sensitivity K_ga.
"""

import json
from collections.abc import Mapping

import numpy as np

from rig.report.exports.exported_corrections import ExportedCalibrations, Imu

FORMAT_VERSION = "2.0.0"


def imucal_files(calibrations: ExportedCalibrations) -> Mapping[str, str]:
    """Return a text for each IMU, by its file's name. Raise Refused `nothing_to_export` if there is none."""
    documents = {imu.name: _document(calibrations, imu) for imu in calibrations.imus}
    return {f"{name}_imucal.json": json.dumps(document, indent=2) + "\n" for name, document in documents.items()}


def _document(calibrations: ExportedCalibrations, imu: Imu) -> dict[str, object]:
    acceleration, rates = imu.accelerometer, imu.gyroscope
    return {
        "cal_type": "Turntable",
        "_format_version": FORMAT_VERSION,
        "acc_unit": "m/s^2",
        "gyr_unit": "rad/s",
        "from_acc_unit": "m/s^2",
        "from_gyr_unit": "rad/s",
        "comment": ". ".join([*calibrations.origin(rates), *_convention(calibrations, imu)]),
        "K_a": (np.eye(3) if acceleration is None else acceleration.gains).tolist(),
        "R_a": (np.eye(3) if acceleration is None else acceleration.axes).tolist(),
        "b_a": (np.zeros(3) if acceleration is None else acceleration.offset).tolist(),
        "K_g": rates.gains.tolist(),
        "R_g": rates.axes.tolist(),
        "K_ga": imu.g_sensitivity.tolist(),
        "b_g": rates.offset.tolist(),
    }


def _convention(calibrations: ExportedCalibrations, imu: Imu) -> list[str]:
    """Return sentences on the file's convention and on the results that it omits."""
    sentences = [
        "w = R_g^-1 K_g^-1 (m - K_ga a - b_g), in the right-angled frame nearest to the gyroscope's axes; b_g = -b"
    ]
    if imu.accelerometer is None:
        sentences.append("No accelerometer was calibrated: K_a, R_a, b_a are those of an ideal one")
    sentences += imu.remarks
    if imu.gyroscope.g_sensitivity is None:
        sentences.append("The g-sensitivity is not known: K_ga is zero")
    if imu.accelerometer is not None and imu.accelerometer.second_order:
        sentences.append("Left out: the accelerometer's second order")
    sentences += [f"Left out: {name}, for which there is no place" for name in calibrations.not_in_imus]
    return [*sentences, "Left out: uncertainties, temperature, nonlinearity; they are in result.json"]
