"""C source that corrects readings, for each kind of sensor."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from rig.data.entries.accelerometer import AccelerometerEntry
from rig.data.entries.magnetometer import MagnetometerEntry
from rig.data.result_file import GyroscopeEntry
from rig.errors.quoting import printable
from rig.estimation.arrays import Array
from rig.report.findings.finding import Finding


def gyroscope_lines(finding: Finding[GyroscopeEntry], sensitivities: Mapping[str, Array]) -> Iterator[str]:
    """Yield C source for a calibrated gyroscope, with its g-sensitivity (3, 3) if known; nothing for a reference."""
    if finding.entry.role != "calibrate":
        return
    prefix, sensitivity = prefix_of(finding.sensor), sensitivities.get(finding.sensor)
    yield from _correction(prefix, finding.entry)
    if sensitivity is not None:
        yield from _gravity_correction(prefix, sensitivity)


def accelerometer_lines(finding: Finding[AccelerometerEntry], _: Mapping[str, Array]) -> Iterator[str]:
    """Yield C source for an accelerometer."""
    entry = finding.entry
    axes = "its own axes" if entry.alignment is None else "its gyroscope"
    omission = "" if entry.second_order_s2_m is None else "\n * The second order that result.json has is left out."
    about = f"{entry.part}, serial number {entry.serial_number}{_warm(entry.temperature_c)}"
    return _subtraction_lines(finding, entry.bias_m_s2, entry.correction_matrix, "force_m_s2", (
        f"/* Accelerometer of {_comment(about)}: s = M (a - b), specific force: at rest it points up.",
        f" * In the right-angled frame of {axes}, relative to gravity, {entry.gravity_m_s2:g} m/s^2.{omission} */",
    ))  # fmt: skip


def magnetometer_lines(finding: Finding[MagnetometerEntry], _: Mapping[str, Array]) -> Iterator[str]:
    """Yield C source for a magnetometer. The correction is valid only while the magnetometer's mounting is the same."""
    entry = finding.entry
    return _subtraction_lines(finding, entry.bias_t, entry.correction_matrix, "field_t", (
        f"/* Magnetometer {_comment(f'{entry.part}, serial number {entry.serial_number}')}: B = M (m - b), in tesla.",
        f" * In the right-angled frame of its own axes, as mounted, relative to a field of {entry.field_t:g} T. */",
    ))  # fmt: skip


def _warm(temperature_c: float | None) -> str:
    return "" if temperature_c is None else f", at {temperature_c:.1f} °C"


def prefix_of(name: str) -> str:
    """Return the prefix of all C names that belong to the sensor `name`."""
    return re.sub(r"^(?=[^a-z])", "sensor_", re.sub(r"[^a-z0-9]", "_", name.lower()))


def _correction(prefix: str, sensor: GyroscopeEntry) -> Iterator[str]:
    """Yield C source of a gyroscope's constants and of the function that corrects its readings."""
    about = f"{sensor.part}, serial number {sensor.serial_number}{_warm(sensor.temperature_c)}"
    yield from (
        "",
        f"/* {_comment(about)}. */",
        f"static const float {prefix}_scale[3] = {_array(sensor.scale)};",
        f"static const float {prefix}_bias_rad_s[3] = {_array(sensor.bias_rad_s)};",
        f"static const float {prefix}_matrix[3][3] = {c_rows(sensor.correction_matrix)};",
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


def _gravity_correction(prefix: str, sensitivity: Array) -> Iterator[str]:
    """Yield C source of the function that subtracts the effect of gravity from readings and then calibrates them."""
    yield from (
        "",
        "/* The same, corrected for g-sensitivity: gravity_m_s2 points down, in the frame of the corrected",
        " * rates; it is an accelerometer's reading at rest with the opposite sign. */",
        f"static const float {prefix}_g_sensitivity_rad_s_per_m_s2[3][3] = {c_rows(sensitivity)};",
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


def _subtraction_lines(
    finding: Finding[Any], bias: Sequence[float], matrix: Sequence[Sequence[float]], true: str, about: Sequence[str]
) -> Iterator[str]:
    """Yield C source of bias, matrix and correction function for a sensor whose bias is subtracted from readings.

    `true` is the C name of the corrected value; `about` are the lines of the comment above the C source.
    """
    name, unit = f"{prefix_of(finding.sensor)}_{finding.quantity}", finding.quantity.suffix
    yield from (
        "",
        *about,
        f"static const float {name}_bias_{unit}[3] = {_array(bias)};",
        f"static const float {name}_matrix[3][3] = {c_rows(matrix)};",
        "",
        f"static inline void {prefix_of(finding.sensor)}_calibrate_{finding.quantity}("
        f"const float reading_{unit}[3], float {true}[3])",
        "{",
        "    for (int i = 0; i < 3; i++) {",
        f"        {true}[i] = 0.0f;",
        "        for (int j = 0; j < 3; j++)",
        f"            {true}[i] += {name}_matrix[i][j] * (reading_{unit}[j] - {name}_bias_{unit}[j]);",
        "    }",
        "}",
    )


def c_rows(matrix: Iterable[Iterable[float]]) -> str:
    """Return a matrix as an initializer in C."""
    return "{" + ", ".join(_array(row) for row in matrix) + "}"


def _array(values: Iterable[float]) -> str:
    return "{" + ", ".join(f"{value:.9e}f" for value in values) + "}"


def _comment(text: str) -> str:
    """Return the text with `*/` broken up: a serial number may contain it, and it would end the C comment."""
    return printable(" ".join(text.split())).replace("*/", "* /").replace("/*", "/ *")
