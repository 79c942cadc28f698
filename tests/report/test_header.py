"""The C header: it compiles, and what it computes is the calibration."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from rig.data.result_file import ResultDocument
from rig.report.header import calibration_header
from support.results import SENSOR, result_document

SCALE = [1.1771, 1.1554, 0.5]
BIAS_RAD_S = [0.0077, -0.0100, -2.5]
READING_RAD_S = [0.25, -1.5, 3.0]

PROGRAM = """
#include <stdio.h>
#include "calibration.h"

int main(void)
{{
    const float reading_rad_s[3] = {{0.25f, -1.5f, 3.0f}};
    float rate_rad_s[3];
    {prefix}_calibrate(reading_rad_s, rate_rad_s);
    printf("%.9g %.9g %.9g\\n", rate_rad_s[0], rate_rad_s[1], rate_rad_s[2]);
    return 0;
}}
"""


def document(*names: str) -> ResultDocument:
    sensor = SENSOR.model_copy(
        update={
            "serial_number": "A-*/1\n#error /* µ \x1b[31m\x07",
            "temperature_c": 22.04,
            "scale": tuple(SCALE),
            "bias_rad_s": tuple(BIAS_RAD_S),
        }
    )
    return result_document(dict.fromkeys(names, sensor))


@pytest.mark.parametrize(("name", "prefix"), [("gyro", "gyro"), ("2nd gyro-µ", "sensor_2nd_gyro__")])
def test_the_header_compiles_and_corrects_a_reading(tmp_path: Path, name: str, prefix: str) -> None:
    (tmp_path / "calibration.h").write_text(calibration_header(document(name, "reference")), encoding="utf-8")
    (tmp_path / "main.c").write_text(PROGRAM.format(prefix=prefix), encoding="utf-8")
    options = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror"]
    subprocess.run(["gcc", *options, "main.c", "-o", "main"], cwd=tmp_path, check=True)
    printed = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout
    expected = np.array(SCALE) * (np.array(READING_RAD_S) + BIAS_RAD_S)
    np.testing.assert_allclose(np.array(printed.split(), dtype=float), expected, rtol=1e-6)


def test_the_header_says_how_to_use_it() -> None:
    text = calibration_header(document("gyro"))
    assert "g = K (m + b)" in text and "Verdict: pass" in text and "at 22.0 °C" in text


def test_a_serial_number_brings_no_control_characters_into_the_header() -> None:
    text = calibration_header(document("gyro"))
    assert "A-* /1 #error / * µ \\x1b[31m\\x07, at" in text
    assert all(character.isprintable() for character in text.replace("\n", ""))
