"""A calibration over temperature in everything that is made of it: what each outlet says is what was found."""

import subprocess
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from rig.cli import main
from rig.config.judging.judging_sections import SiteSection
from rig.data.entries.temperature import OverTemperatureEntry
from rig.data.result_file import ResultDocument, read_result
from rig.estimation.arrays import Array
from rig.report.certificate.dcc import digital_certificate
from rig.report.certificate.statements import StatedFacts
from rig.report.exports.autopilots import ardupilot_files, px4_files
from rig.report.exports.exported_corrections import calibrations
from rig.report.header import calibration_header
from rig.report.kinds.kind_registry import history_records
from support.documents.certified import certificate
from support.documents.dcc_rules import rule_faults, schema_faults
from support.motions.warmed_sweeps import FROM_C, REFERENCE_C, TO_C, Drawn, drawn, session, write_files

pytestmark = pytest.mark.slow

READING = np.array([0.3, -0.9, 1.2])


@pytest.fixture(scope="module")
def warmed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Drawn]:
    """A run folder of readings that were made elsewhere while the sensor warmed and cooled."""
    folder, rng = tmp_path_factory.mktemp("warmed"), np.random.default_rng(8)
    sensor = drawn(rng, gradient_k=0.0, walk=0.0)
    samples, sweeps = write_files(sensor, session(6), rng, folder)
    said = ["--part", "lsm9ds1", "--serial-number", "A1", "--history", str(folder / "history.sqlite")]
    end = main(
        ["solve", str(samples), "--sweeps", str(sweeps), "--reference-c", "25", "--out", str(folder / "run"), *said]
    )
    assert end == 0
    return folder / "run", sensor


@pytest.fixture(scope="module")
def result(warmed: tuple[Path, Drawn]) -> ResultDocument:
    return read_result(warmed[0])


@pytest.fixture(scope="module")
def entry(result: ResultDocument) -> OverTemperatureEntry:
    return result.over_temperature["imu"]["rate"]


def test_the_result_holds_the_sensor_and_agrees_with_its_calibration(
    warmed: tuple[Path, Drawn], result: ResultDocument, entry: OverTemperatureEntry
) -> None:
    for row in entry.table:
        true = warmed[1].evaluate(row.temperature_c)
        assert (np.abs(np.array(row.scale) - true[:3]) < 3 * np.array(row.expanded_scale) + 1e-3).all()
        assert (np.abs(-np.array(row.bias) - true[3:]) < 3 * np.array(row.expanded_bias) + 5e-4).all()  # axes lean
    calibration = result.gyroscopes["imu"]

    assert calibration.temperature_c == REFERENCE_C
    assert np.allclose(entry.evaluate(REFERENCE_C)[0], calibration.scale) and np.allclose(
        entry.bias[0], calibration.bias_rad_s
    )
    assert calibration.budget is not None
    assert any(line.name == "polynomials over temperature" for line in calibration.budget.contributors)


def test_the_run_folder_has_picture_certificate_and_history(
    warmed: tuple[Path, Drawn], capsys: pytest.CaptureFixture[str]
) -> None:
    folder = warmed[0]
    page = (folder / "certificate.html").read_text()

    assert (folder / "over_temperature_imu.png").exists() and (folder / "over_temperature_imu.svg").exists()
    assert "Gyroscope imu over temperature" in page and page.count("<polygon points=") == 6
    assert main(["show", str(folder), "--all"]) in (0, 1)
    assert "over temperature" in capsys.readouterr().out


def test_a_history_follows_the_slopes_and_the_values_at_the_reference(
    result: ResultDocument, entry: OverTemperatureEntry
) -> None:
    by_quantity = {each.quantity: each for each in history_records(result)}
    slopes = {parameter.name: parameter for parameter in by_quantity["rate over temperature"].parameters}

    assert by_quantity["rate"].temperature_c == by_quantity["rate over temperature"].temperature_c == REFERENCE_C
    assert [slopes[name].value for name in ("sx", "sy", "sz", "tx", "ty", "tz")] == [*entry.bias[1], *entry.scale[1]]
    assert all(slope.expanded > 0 for slope in slopes.values())


def test_the_digital_certificate_has_every_temperature(result: ResultDocument) -> None:
    xml = digital_certificate(certificate(result, StatedFacts(SiteSection(country="DE"))))
    names = [each.text for each in ElementTree.fromstring(xml).iter("{https://ptb.de/dcc}content")]

    assert "scale factor along x over temperature" in names and "bias along z over temperature" in names
    assert rule_faults(xml) == []


def test_the_digital_certificate_is_valid_by_ptbs_schema(result: ResultDocument) -> None:
    assert schema_faults(digital_certificate(certificate(result, StatedFacts(SiteSection(country="DE"))))) == []


def c_of(header: str, folder: Path, temperature_c: float) -> Array:
    """What a C program makes of the reading, and whether it holds there."""
    (folder / "calibration.h").write_text(header)
    (folder / "main.c").write_text(f"""#include <stdio.h>
#include "calibration.h"
int main(void) {{
    const float reading[3] = {{{READING[0]}f, {READING[1]}f, {READING[2]}f}};
    float rate[3];
    const int holds = imu_calibrate_at(reading, {temperature_c}f, rate);
    printf("%.9g %.9g %.9g %d\\n", rate[0], rate[1], rate[2], holds);
    imu_calibrate(reading, rate);
    return 0;
}}
""")
    options = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror"]
    subprocess.run(["gcc", *options, "main.c", "-o", "main"], cwd=folder, check=True)
    return np.array(
        subprocess.run([folder / "main"], capture_output=True, text=True, check=True).stdout.split(), dtype=float
    )


@pytest.mark.parametrize("asked_c", [25.0, 41.5, 90.0])
def test_the_header_corrects_by_temperature(
    result: ResultDocument, entry: OverTemperatureEntry, tmp_path: Path, asked_c: float
) -> None:
    taken_c = min(asked_c, entry.range_c[1])
    scale, bias = (np.array(each) for each in entry.evaluate(taken_c))
    matrix = np.array(result.gyroscopes["imu"].correction_matrix) * (scale / entry.scale[0])

    *rate, held = c_of(calibration_header(result), tmp_path, asked_c)

    assert held == (asked_c == taken_c) and np.allclose(rate, matrix @ (READING + bias), atol=2e-6)


def read_fields(lines: str, separator: str, name: int, value: int) -> dict[str, float]:
    rows = [line.split(separator) for line in lines.splitlines() if line and not line.startswith("#")]
    return {row[name]: float(row[value]) for row in rows}


def ours(entry: OverTemperatureEntry, temperature_c: float) -> Array:
    """The reading less what it is off at no rate, by the nearer end outside."""
    found: Array = READING + np.array(entry.evaluate(float(np.clip(temperature_c, *entry.range_c)))[1])
    return found


@pytest.mark.parametrize("temperature_c", [0.0, FROM_C + 0.5, REFERENCE_C, 35.0, 47.3, TO_C - 1, 80.0])
def test_px4_corrects_as_we_do(result: ResultDocument, entry: OverTemperatureEntry, temperature_c: float) -> None:
    """By calc_thermal_offsets_3D of TemperatureCompensation.cpp and Gyroscope::Correct."""
    said = read_fields(px4_files(calibrations(result))["px4.params"], "\t", 2, 3)
    delta = min(max(temperature_c, said["TC_G0_TMIN"]), said["TC_G0_TMAX"]) - said["TC_G0_TREF"]
    thermal = [
        said[f"TC_G0_X0_{i}"] + said[f"TC_G0_X1_{i}"] * delta + said[f"TC_G0_X2_{i}"] * delta**2
        + said[f"TC_G0_X3_{i}"] * delta**3
        for i in range(3)
    ]  # fmt: skip
    offset = [said[f"CAL_GYRO0_{axis}OFF"] for axis in "XYZ"]

    assert said["TC_G_ENABLE"] == 1
    assert np.allclose(READING - thermal - offset, ours(entry, temperature_c), rtol=0, atol=1e-6)


@pytest.mark.parametrize("temperature_c", [0.0, FROM_C + 0.5, REFERENCE_C, 35.0, 47.3, TO_C - 1, 80.0])
def test_ardupilot_corrects_as_we_do(result: ResultDocument, entry: OverTemperatureEntry, temperature_c: float) -> None:
    """By TCal::correct_sensor of AP_InertialSensor_tempcal.cpp and _rotate_and_correct_gyro."""
    said = read_fields(ardupilot_files(calibrations(result))["ardupilot.param"], ",", 0, 1)

    def evaluated(warm: float) -> Array:
        away = min(max(warm, said["INS_TCAL1_TMIN"]), said["INS_TCAL1_TMAX"]) - 35.0
        c = [np.array([said[f"INS_TCAL1_GYR{n}_{axis}"] for axis in "XYZ"]) for n in (1, 2, 3)]
        polynomial: Array = (c[0] + (c[1] + c[2] * away) * away) * away * 1e-6
        return polynomial

    rate = READING - evaluated(temperature_c) + evaluated(said["INS_GYR1_CALTEMP"])
    rate -= [said[f"INS_GYROFFS_{axis}"] for axis in "XYZ"]

    assert said["INS_TCAL1_ENABLE"] == 1 and said["INS_TCAL1_ACC1_X"] == 0
    assert np.allclose(rate, ours(entry, temperature_c), rtol=0, atol=1e-6)


def test_what_has_no_temperature_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(1)
    samples, sweeps = write_files(drawn(rng), session(4), rng, tmp_path)
    cold = tmp_path / "cold.csv"
    cold.write_text("\n".join(line.rsplit(",", 1)[0] for line in samples.read_text().splitlines()) + "\n")

    assert main(["solve", str(cold), "--sweeps", str(sweeps), "--reference-c", "25"]) == 2
    assert "temperature_not_recorded" in capsys.readouterr().err
    assert main(["solve", str(samples), "--attitudes", str(sweeps), "--reference-c", "25"]) == 2
    assert "bad_option" in capsys.readouterr().err
