"""The calibration as a C header, for firmware that corrects its own readings."""

import re
from collections.abc import Iterable
from pathlib import Path

from rig.analysis.outcome import Outcome
from rig.data.result_file import ResultDocument
from rig.errors.quoting import printable
from rig.station.events import DocumentWritten, RunEvent


def write_header(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """`calibration.h`, unless the calibration failed its limits: nobody should compile it in then."""
    if outcome.passed and outcome.results:
        path = folder / "calibration.h"
        path.write_text(calibration_header(document), encoding="utf-8")
        return (DocumentWritten(path),)
    return ()


def calibration_header(result: ResultDocument) -> str:
    """C source text for the sensors of a result.

    One pair of arrays a calibrated sensor and the function that applies them, g = K (m + b): scale factors (no unit)
    and biases in rad/s. Names are those of the sensors, with everything that C does not allow written as `_`.
    """
    lines = [
        "/* Gyroscope calibration, g = K (m + b): rate_rad_s[i] = scale[i] * (reading_rad_s[i] + bias_rad_s[i]).",
        f" * Verdict: {result.verdict}. Solved {result.provenance.solved_utc}. */",
        "#ifndef CALIBRATION_H",
        "#define CALIBRATION_H",
    ]
    calibrated = {name: sensor for name, sensor in result.sensors.items() if sensor.role == "calibrate"}
    for name, sensor in calibrated.items():
        prefix = re.sub(r"^(?=[^a-z])", "sensor_", re.sub(r"[^a-z0-9]", "_", name.lower()))
        about = f"{sensor.part}, serial number {sensor.serial_number}, at {sensor.temperature_c:.1f} °C"
        lines += [
            "",
            f"/* {_comment(about)}. */",
            f"static const float {prefix}_scale[3] = {_array(sensor.scale)};",
            f"static const float {prefix}_bias_rad_s[3] = {_array(sensor.bias_rad_s)};",
            "",
            f"static inline void {prefix}_calibrate(const float reading_rad_s[3], float rate_rad_s[3])",
            "{",
            "    for (int i = 0; i < 3; i++)",
            f"        rate_rad_s[i] = {prefix}_scale[i] * (reading_rad_s[i] + {prefix}_bias_rad_s[i]);",
            "}",
        ]
    return "\n".join([*lines, "", "#endif", ""])


def _array(values: Iterable[float]) -> str:
    return "{" + ", ".join(f"{value:.9e}f" for value in values) + "}"


def _comment(text: str) -> str:
    """What a serial number may hold must not end the comment it stands in."""
    return printable(" ".join(text.split())).replace("*/", "* /").replace("/*", "/ *")
