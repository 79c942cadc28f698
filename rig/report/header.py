"""The calibration as a C header, for firmware that corrects its own readings."""

from collections.abc import Mapping
from typing import Any


def calibration_header(result: Mapping[str, Any]) -> str:
    """C source text for a `result.json` document (schema `rig.result/1`).

    One pair of arrays a sensor, in the convention g = K (m + b): scale factors (no unit) and biases in rad/s.
    """
    lines = [
        "/* Gyroscope calibration: rate_rad_s[i] = scale[i] * (reading_rad_s[i] + bias_rad_s[i]).",
        f" * Verdict: {result['verdict']}. Solved {result['provenance']['solved_utc']}. */",
        "#ifndef CALIBRATION_H",
        "#define CALIBRATION_H",
    ]
    for name, sensor in result["sensors"].items():
        upper = "".join(c if c.isalnum() else "_" for c in name).lower()
        lines += [
            "",
            f"/* {sensor['part']}, serial number {sensor['serial_number']}, at {sensor['temperature_c']:.1f} °C. */",
            f"static const float {upper}_scale[3] = {_array(sensor['scale'])};",
            f"static const float {upper}_bias_rad_s[3] = {_array(sensor['bias_rad_s'])};",
        ]
    return "\n".join([*lines, "", "#endif", ""])


def _array(values: list[float]) -> str:
    return "{" + ", ".join(f"{value:.9e}f" for value in values) + "}"
