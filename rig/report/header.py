"""The calibration as a C header, for firmware that corrects its own readings."""

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from rig.analysis.calibration import SensorResult
from rig.analysis.outcome import Outcome
from rig.config.written_file import write_new
from rig.data.accelerometer_entries import AccelerometerEntry
from rig.data.result_file import ResultDocument, SensorEntry
from rig.errors.quoting import printable
from rig.estimation.arrays import Array
from rig.estimation.vector_model import VectorSolution
from rig.station.events import DocumentWritten, RunEvent

NOTHING: Mapping[str, Array] = MappingProxyType({})


def write_header(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """`calibration.h`, unless the calibration failed its limits: nobody should compile it in then."""
    if outcome.passed and (outcome.results or outcome.accelerometers):
        path = folder / "calibration.h"
        found = {name: g_sensitivity(result) for name, result in outcome.results.items()}
        sensed = {name: matrix for name, matrix in found.items() if matrix is not None}
        write_new(path, calibration_header(document, sensed))
        return (DocumentWritten(path),)
    return ()


def g_sensitivity(result: SensorResult) -> Array | None:
    """(3, 3) what gravity in the frame of the corrected rates adds to a reading, rad/s per m/s²; None if not found.

    The vector model has it with gravity in the flange frame, which its `mounting` R turns into the sensor's: G Rᵀ.
    """
    vector = result.vector_model
    if not isinstance(vector, VectorSolution) or vector.g_sensitivity is None:
        return None
    matrix: Array = vector.g_sensitivity @ vector.mounting.T
    return matrix


def calibration_header(result: ResultDocument, g_sensitivity: Mapping[str, Array] = NOTHING) -> str:
    """C source text for the sensors of a result.

    For each calibrated sensor its scale factors (no unit), its biases in rad/s, the matrix M of g = M (m + b) by which
    the board corrects it, and the function that does the same; where `g_sensitivity` (3, 3), rad/s per m/s², is known,
    that too and a function that takes it out first. Of each calibrated accelerometer bias, matrix and function. Names
    are those of the sensors, with everything that C does not allow written as `_`.
    """
    lines = [
        "/* Gyroscope calibration, g = M (m + b): rate_rad_s = matrix * (reading_rad_s + bias_rad_s).",
        " * M is diag(scale), or the whole matrix, which also brings the axes to right angles.",
        f" * Verdict: {result.verdict}. Solved {result.provenance.solved_utc}. */",
        "#ifndef CALIBRATION_H",
        "#define CALIBRATION_H",
    ]
    for name, sensor in result.sensors.items():
        if sensor.role == "calibrate":
            prefix = _prefix(name)
            lines += _correction(prefix, sensor)
            if name in g_sensitivity:
                lines += _without_gravity(prefix, g_sensitivity[name])
    for name, accelerometer in result.accelerometers.items():
        lines += _acceleration(_prefix(name), accelerometer)
    return "\n".join([*lines, "", "#endif", ""])


def _prefix(name: str) -> str:
    """Of a sensor's names in C."""
    return re.sub(r"^(?=[^a-z])", "sensor_", re.sub(r"[^a-z0-9]", "_", name.lower()))


def _correction(prefix: str, sensor: SensorEntry) -> Iterator[str]:
    about = f"{sensor.part}, serial number {sensor.serial_number}, at {sensor.temperature_c:.1f} °C"
    whole = sensor.correction_matrix
    yield from (
        "",
        f"/* {_comment(about)}. */",
        f"static const float {prefix}_scale[3] = {_array(sensor.scale)};",
        f"static const float {prefix}_bias_rad_s[3] = {_array(sensor.bias_rad_s)};",
        f"static const float {prefix}_matrix[3][3] = {_rows(np.diag(sensor.scale) if whole is None else whole)};",
        "",
        f"static inline void {prefix}_calibrate(const float reading_rad_s[3], float rate_rad_s[3])",
        "{",
        "    for (int i = 0; i < 3; i++) {",
        "        rate_rad_s[i] = 0.0f;",
        "        for (int j = 0; j < 3; j++)",
        f"            rate_rad_s[i] += {prefix}_matrix[i][j] * (reading_rad_s[j] + {prefix}_bias_rad_s[j]);",
        "    }",
        "}",
    )


def _without_gravity(prefix: str, sensitivity: Array) -> Iterator[str]:
    yield from (
        "",
        "/* The same without what gravity adds to a reading: gravity_m_s2 points down, in the frame of the corrected",
        " * rates; it is an accelerometer's reading at rest with the other sign. */",
        f"static const float {prefix}_g_sensitivity_rad_s_per_m_s2[3][3] = {_rows(sensitivity)};",
        "",
        f"static inline void {prefix}_calibrate_with_gravity(",
        "    const float reading_rad_s[3], const float gravity_m_s2[3], float rate_rad_s[3])",
        "{",
        "    float level_rad_s[3];",
        "    for (int i = 0; i < 3; i++) {",
        "        level_rad_s[i] = reading_rad_s[i];",
        "        for (int j = 0; j < 3; j++)",
        f"            level_rad_s[i] -= {prefix}_g_sensitivity_rad_s_per_m_s2[i][j] * gravity_m_s2[j];",
        "    }",
        f"    {prefix}_calibrate(level_rad_s, rate_rad_s);",
        "}",
    )


def _acceleration(prefix: str, found: AccelerometerEntry) -> Iterator[str]:
    about = f"{found.part}, serial number {found.serial_number}, at {found.temperature_c:.1f} °C"
    axes = "its own axes" if found.alignment is None else "the gyroscope beside it"
    left_out = "" if found.second_order_s2_m is None else "\n * The second order that result.json has is left out."
    yield from (
        "",
        f"/* Accelerometer of {_comment(about)}: s = M (a - b), specific force: at rest it points up.",
        f" * In the right-angled frame of {axes}, relative to gravity, {found.gravity_m_s2:g} m/s^2.{left_out} */",
        f"static const float {prefix}_acceleration_bias_m_s2[3] = {_array(found.bias_m_s2)};",
        f"static const float {prefix}_acceleration_matrix[3][3] = {_rows(found.correction_matrix)};",
        "",
        f"static inline void {prefix}_calibrate_acceleration(const float reading_m_s2[3], float force_m_s2[3])",
        "{",
        "    for (int i = 0; i < 3; i++) {",
        "        force_m_s2[i] = 0.0f;",
        "        for (int j = 0; j < 3; j++)",
        f"            force_m_s2[i] += {prefix}_acceleration_matrix[i][j]"
        f" * (reading_m_s2[j] - {prefix}_acceleration_bias_m_s2[j]);",
        "    }",
        "}",
    )


def _rows(matrix: Iterable[Iterable[float]]) -> str:
    return "{" + ", ".join(_array(row) for row in matrix) + "}"


def _array(values: Iterable[float]) -> str:
    return "{" + ", ".join(f"{value:.9e}f" for value in values) + "}"


def _comment(text: str) -> str:
    """What a serial number may hold must not end the comment it stands in."""
    return printable(" ".join(text.split())).replace("*/", "* /").replace("/*", "/ *")
