"""Kalibr's YAML: noise for its option --imu, and intrinsics in the form of its results.

Kalibr (IccSensors.py, "scale-misalignment"): m_a = M_a a + b_a, m_g = M_g C_g ω + A_g C_g a + b_g, with readings m,
specific force a, rate ω, biases b, lower triangular M, rotation C_g, and g-sensitivity A_g. The frame is that of the
accelerometer's axes or, without an accelerometer, of the gyroscope's axes.
"""

from collections.abc import Mapping

import numpy as np
import yaml

from rig.estimation.arrays import Array
from rig.report.exports.columns import plain_names
from rig.report.exports.exported_corrections import ExportedCalibrations, Imu


def kalibr_files(calibrations: ExportedCalibrations) -> Mapping[str, str]:
    """Return `…_imu.yaml` (noise) and `…_intrinsics.yaml` of each IMU, by name. Raise Refused `nothing_to_export`."""
    files = {}
    names = plain_names(imu.name for imu in calibrations.imus)
    for imu in calibrations.imus:
        topic = f"/{names[imu.name]}/imu"  # as in the bag of `--format ros2`
        files[f"{imu.name}_imu.yaml"] = _noise(calibrations, imu, topic)
        files[f"{imu.name}_intrinsics.yaml"] = _intrinsics(calibrations, imu, topic)
    return files


def triangular(matrix: Array) -> tuple[Array, Array]:
    """Return M, lower triangular with a positive diagonal, and a rotation C, both (3, 3), such that M C = `matrix`."""
    q, r = np.linalg.qr(matrix.T)
    signs = np.sign(np.diag(r))
    return r.T * signs + 0.0, (q * signs).T  # no −0.0


def _noise(calibrations: ExportedCalibrations, imu: Imu, topic: str) -> str:
    """Return the text of Kalibr's noise file: densities of white noise, and comments that name unmeasured values."""
    rates, forces = imu.gyroscope, imu.accelerometer
    parameters = {
        "rostopic": topic,
        "update_rate": rates.noise.rate_hz,
        "gyroscope_noise_density": rates.noise.density,
        "accelerometer_noise_density": None if forces is None else forces.noise.density,
    }
    unknown = [name for name, value in parameters.items() if value is None]
    comments = [
        *calibrations.origin(rates),
        "Noise densities in rad/s/sqrt(Hz), m/s^2/sqrt(Hz): of a sample at rest over the rate's root, worst axis.",
        "Lost: gyroscope_random_walk, accelerometer_random_walk, which take hours at rest; add your own.",
        *(f"Lost: {name}, which this run did not measure" for name in unknown),
    ]
    return _yaml(comments, {name: value for name, value in parameters.items() if value is not None})


def _intrinsics(calibrations: ExportedCalibrations, imu: Imu, topic: str) -> str:
    """Return the text of Kalibr's intrinsics: triangular matrices in the frame of the accelerometer, with comments."""
    rates, forces = imu.gyroscope, imu.accelerometer
    intrinsics: dict[str, object] = {"model": "scale-misalignment", "rostopic": topic}
    to_body = np.eye(3)
    if forces is not None:
        scaled, to_body = triangular(forces.matrix)
        intrinsics["accelerometers"] = {"M": scaled.tolist()}
    scaled, rotation = triangular(rates.matrix @ to_body.T)
    in_body = imu.g_sensitivity @ to_body.T
    intrinsics["gyroscopes"] = {
        "M": scaled.tolist(),
        "A": (in_body @ rotation.T).tolist(),
        "C_gyro_i": rotation.tolist(),
    }
    comments = [
        *calibrations.origin(rates),
        "m = M C_gyro_i w + A C_gyro_i a + b: readings m in rad/s, w true, a in m/s^2. Kalibr has no bias here:",
        f"b = -b of result.json = {rates.offset.tolist()} rad/s",
    ]
    if forces is not None:
        comments.append(f"accelerometer: m = M a + b, b = {forces.offset.tolist()} m/s^2")
    if rates.g_sensitivity is None:
        comments.append("A is zero: the g-sensitivity is not known.")
    comments += [f"{remark}." for remark in imu.remarks]
    comments.append("Lost: uncertainties, temperature, the accelerometer's second order and position.")
    comments += [f"Lost: {name}, for which there is no place" for name in calibrations.not_in_imus]
    return _yaml(comments, {"imu0": intrinsics})


def _yaml(lines: list[str], document: Mapping[str, object]) -> str:
    heading = "".join(f"# {line}\n" for line in lines)
    nested = any(isinstance(value, dict) for value in document.values())  # one line for each row of a matrix
    return heading + yaml.safe_dump(document, sort_keys=False, default_flow_style=None if nested else False)
