"""The C header: it compiles, and what it computes is the calibration."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.report.header import calibration_header
from support.documents.results import SENSOR, result_document

SCALE = [1.1771, 1.1554, 0.5]
BIAS_RAD_S = [0.0077, -0.0100, -2.5]
READING_RAD_S = [0.25, -1.5, 3.0]

MATRIX = np.array([[1.1771, -0.0052, 0.0031], [-0.0053, 1.1554, 0.0047], [0.0032, 0.0048, 0.5]])
G_SENSITIVITY = np.array([[1e-4, 2e-4, -3e-4], [0.0, 5e-4, 0.0], [-1e-4, 0.0, 2e-3]])  # rad/s per m/s²
GRAVITY_M_S2 = [1.0, -2.0, -9.5]

PROGRAM = """
#include <stdio.h>
#include "calibration.h"

int main(void)
{{
    const float reading_rad_s[3] = {{0.25f, -1.5f, 3.0f}};
    float rate_rad_s[3];
    {call};
    printf("%.9g %.9g %.9g\\n", rate_rad_s[0], rate_rad_s[1], rate_rad_s[2]);
    return 0;
}}
"""


def document(*names: str, **changes: object) -> ResultDocument:
    sensor = SENSOR.model_copy(
        update={
            "serial_number": "A-*/1\n#error /* µ \x1b[31m\x07",
            "temperature_c": 22.04,
            "scale": tuple(SCALE),
            "bias_rad_s": tuple(BIAS_RAD_S),
            "correction_matrix": tuple(map(tuple, np.diag(SCALE).tolist())),
            **changes,
        }
    )
    return result_document(dict.fromkeys(names, sensor))


def computed(folder: Path, header: str, call: str) -> Array:
    """What a C program that includes the header makes of the reading."""
    (folder / "calibration.h").write_text(header, encoding="utf-8")
    (folder / "main.c").write_text(PROGRAM.format(call=call), encoding="utf-8")
    options = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror"]
    subprocess.run(["gcc", *options, "main.c", "-o", "main"], cwd=folder, check=True)
    printed = subprocess.run([folder / "main"], capture_output=True, text=True, check=True).stdout
    return np.array(printed.split(), dtype=float)


@pytest.mark.parametrize(("name", "prefix"), [("gyro", "gyro"), ("2nd gyro-µ", "sensor_2nd_gyro__")])
def test_the_header_compiles_and_corrects_a_reading(tmp_path: Path, name: str, prefix: str) -> None:
    header = calibration_header(document(name, "reference"))
    expected = np.array(SCALE) * (np.array(READING_RAD_S) + BIAS_RAD_S)
    found = computed(tmp_path, header, f"{prefix}_calibrate(reading_rad_s, rate_rad_s)")
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_the_header_has_the_whole_matrix_where_that_corrects(tmp_path: Path) -> None:
    header = calibration_header(document("gyro", correction="matrix", correction_matrix=tuple(map(tuple, MATRIX))))
    expected = MATRIX @ (np.array(READING_RAD_S) + BIAS_RAD_S)
    found = computed(tmp_path, header, "gyro_calibrate(reading_rad_s, rate_rad_s)")
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_the_header_takes_gravity_out_where_the_sensitivity_to_it_is_known(tmp_path: Path) -> None:
    header = calibration_header(document("gyro"), {"gyro": G_SENSITIVITY})
    level = np.array(READING_RAD_S) - G_SENSITIVITY @ GRAVITY_M_S2
    gravity = "(const float[3]){1.0f, -2.0f, -9.5f}"
    found = computed(tmp_path, header, f"gyro_calibrate_with_gravity(reading_rad_s, {gravity}, rate_rad_s)")
    np.testing.assert_allclose(found, np.array(SCALE) * (level + BIAS_RAD_S), rtol=1e-6)
    assert "gravity" not in calibration_header(document("gyro"))


def test_the_header_says_how_to_use_it() -> None:
    text = calibration_header(document("gyro"))
    assert "g = M (m + b)" in text and "Verdict: pass" in text and "at 22.0 °C" in text


def test_a_serial_number_brings_no_control_characters_into_the_header() -> None:
    text = calibration_header(document("gyro"))
    assert "A-* /1 #error / * µ \\x1b[31m\\x07, at" in text
    assert all(character.isprintable() for character in text.replace("\n", ""))
