"""All triads of one part from end to end: sweeps and attitudes, real clients, real firmware, simulated laboratory."""

import json
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from firmware_host.samples import FIELD_SAMPLE_DTYPE
from rig.analysis.analyses import calibrate
from rig.cli import main
from rig.data.quantity import FIELD, RATE
from rig.data.recording.run_data import RunData
from rig.data.recording.run_file import read_run
from support.laboratories.commands import configuration, rig, rig_here
from support.laboratories.worlds import merge
from support.processes.waiting import PATIENCE_S
from support.recordings.stated import find_differences

SITE: dict[str, Any] = {"magnetic_field_ut": 50.0}
TRUTH: dict[str, Any] = {
    "scale": [1.03, 0.97, 1.05],
    "bias_ut": [12.0, -25.0, 8.0],
    "noise_ut": 0.3,
    "non_orthogonality_deg": [0.5, -0.3, 0.4],
}
COMPASS = {"part": "lsm9ds1_magnetometer", "serial_number": "LSM9DS1-001"}
NINE = [[0, -90, 0], [-90, -90, 0], [-90, -90, 90], [-180, -90, 45], [90, -90, -45], [45, -90, 90], [-45, -90, -90]]
NINE += [[-135, -90, 135], [0, -90, -135]]
NINE += [[0, -45, 90], [90, -45, 0]]  # without these no residual shows what the arm adds along wrist 1's axis
ATTITUDES = {
    "name": "static_attitudes",
    "attitudes": NINE,
    "dwell_s": 0.6,
    "field_test_s": 2.0,
    "acceleration_deg_s2": 700,
}
IMU = {**ATTITUDES, "name": "imu", "axes": 3, "speed_deg_s": 150, "rest_s": 0.5}
ACCELEROMETER: dict[str, Any] = {
    "scale": [1.02, 0.985, 1.01],
    "bias_m_s2": [0.3, -0.2, 0.4],
    "noise_m_s2": 0.015,
    "non_orthogonality_deg": [0.3, -0.2, 0.1],
    "delay_ms": 3.0,
}
# Along the axis of wrist 3, where no residual shows it; 0.36 m from the sensor, which feels 1.3 µT of it.
IRON = {"carried_by": "wrist_2", "position_mm": [0, 0, 56.55], "moment_a_m2": [0, 0, 0.3]}
ARM_FIELD_UT = 0.2 * 0.3 / 0.36**3
OVER = {"x": "+x", "y": "-y", "z": "-z"}
LABORATORY: dict[str, Any] = {
    "arm": {"transfer_speed_deg_s": 170, "extension_mm": [0, 0, 300]},
    "sensors": {"gyro": {"acceleration": {"range_g": 2}}},
    "magnetometers": {"compass": COMPASS},
    "site": SITE,
    "limits": {
        "scale_std": 1,
        "bias_std_rad_s": 1,
        "acceleration_scale_deviation": 0.1,
        "acceleration_scale_std": 0.01,
        "acceleration_bias_m_s2": 1,
        "acceleration_bias_std_m_s2": 0.05,
    },
    "world": {
        "time_scale": 20,
        "site": {"magnetic_field_ut": 50.0, "magnetic_dip_deg": 60, "magnetic_declination_deg": 30},
        "arm": {"iron": {"housing": IRON}},
        "magnetometers": {"compass": TRUTH},
        "sensors": {"gyro": {"noise_rad_s": 0.005, "offset_mm": [20, -15, 30], "accelerometer": ACCELEROMETER}},
    },
}

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any], str]:
    """The folder of a run with sweeps, result.json, and everything that `rig show` prints on a wide terminal."""
    folder = tmp_path_factory.mktemp("compass")
    out = folder / "run"
    with pytest.MonkeyPatch.context() as wide:
        wide.setenv("COLUMNS", "200")
        done = rig("run", configuration(folder, LABORATORY, IMU), "--out", out)
        shown = rig_here("show", out, "--all").stdout
    assert done.returncode == 0, done.stdout + done.stderr
    return out, json.loads((out / "result.json").read_text(encoding="utf-8")), shown


def recorded(out: Path) -> RunData:
    return read_run(out / "run.h5")


def test_the_field_is_recorded_beside_the_rates_and_nothing_is_lost(
    finished: tuple[Path, dict[str, Any], str],
) -> None:
    run = recorded(finished[0])
    assert set(run.measuring(FIELD)) == {"compass"} and "compass" not in run.measuring(RATE)
    compass, samples = run.sensors["compass"], run.samples["compass"]
    assert compass.rate_hz == 80 and compass.channel(FIELD).range == pytest.approx(4e-4)
    assert samples.dtype == FIELD_SAMPLE_DTYPE
    assert samples["sequence"].tolist() == list(range(len(samples)))
    assert np.diff(samples["board_time_us"].astype(float)).mean() == pytest.approx(12_500, rel=1e-3)
    assert run.provenance.sensor_serial_numbers["compass"] == "LSM9DS1-001"


def test_the_field_is_exported_as_it_was_read_on_the_arms_clock(
    finished: tuple[Path, dict[str, Any], str], tmp_path: Path
) -> None:
    assert main(["export", str(finished[0]), "--format", "csv", "--out", str(tmp_path)]) == 0
    table = np.genfromtxt(tmp_path / "compass.csv", delimiter=",", names=True)
    assert table.dtype.names == ("time_s", "x_t", "y_t", "z_t")
    run = recorded(finished[0])
    read_t = run.sensors["compass"].channel(FIELD).values(run.samples["compass"])
    np.testing.assert_array_equal(np.column_stack([table[axis] for axis in ("x_t", "y_t", "z_t")]), read_t)
    arm_s = run.states["time_s"]
    assert arm_s[0] - 1 < table["time_s"][0] and table["time_s"][-1] < arm_s[-1] + 1
    assert "compass.csv: compass, lsm9ds1_magnetometer" in (tmp_path / "README.txt").read_text()


def test_dwells_tell_scale_bias_and_angles_as_mounted(finished: tuple[Path, dict[str, Any], str]) -> None:
    _, result, printed = finished
    found = result["magnetometers"]["compass"]
    std = np.sqrt(np.diag(found["covariance"]))
    mounted_ut = np.add(TRUTH["bias_ut"], (0, 0, ARM_FIELD_UT / TRUTH["scale"][2]))
    off = np.array(found["scale"] + found["bias_t"]) - [*TRUTH["scale"], *(1e-6 * mounted_ut)]
    assert np.abs(off / std).max() < 4
    assert found["bias_t"][2] - 1e-6 * TRUTH["bias_ut"][2] > 5 * std[5], "the arm's field is in it"
    assert found["arm_field_in_bias"] and found["extension_m"] == [0, 0, 0.3]
    assert found["uniformity"]["chi_square"] < found["uniformity"]["limit"]
    assert found["drift"]["chi_square"] < found["drift"]["limit"]
    assert std[:3].max() < 0.01 and std[3:].max() < 0.5e-6
    skew = np.array(found["non_orthogonality_rad"]) - np.radians([0.4, -0.3, 0.5])
    assert np.all(np.abs(skew) < 4 * np.array(found["non_orthogonality_std_rad"]))
    assert len(found["dwells"]) == 11 and found["field_t"] == 50e-6
    # North lies along the base's x axis, the field's level part 30° clockwise of it, towards −y.
    level, down = 50e-6 * np.cos(np.radians(60)), 50e-6 * np.sin(np.radians(60))
    true = [level * np.cos(np.radians(30)), -level * np.sin(np.radians(30)), -down]
    assert found["field_base_t"] == pytest.approx(true, abs=1e-6)
    assert "magnetometer as mounted" in printed and "it has no limits" in printed
    lines = {line["name"]: line for line in found["budget"]["contributors"]}
    assert {"noise", "arm's attitudes", "size of the field", "drift of the field"} <= lines.keys()
    assert lines["size of the field"]["half_width"] == pytest.approx(0.5)  # 1 % of 50 µT: nobody said how good they are
    assert found["budget"]["std"] == pytest.approx(np.sqrt(np.diag(found["covariance_combined"])).tolist())
    assert found["budget"]["std"][:3] == pytest.approx([0.01 / 3**0.5 * k for k in found["scale"]], rel=0.1)
    assert 3 * std[:3].max() < 0.01 / 3**0.5
    said = " ".join(printed.split())
    assert "size of the field ±0.5 µT" in said
    assert "± 0.5 µT is assumed: site.magnetic_field_uncertainty_ut is not given" in said
    certificate = (finished[0] / "certificate.html").read_text(encoding="utf-8")
    assert "The bias is that of the magnetometer as mounted" in certificate
    judged = [check for check in result["checks"] if check["name"].startswith("compass")]
    assert {"compass.field_disturbed_dwell", "compass.field_stuck_bit"} <= {check["name"] for check in judged}
    assert all(check["name"].startswith("compass.field_") and check["passed"] for check in judged)


def test_solving_the_recording_equals_the_run(finished: tuple[Path, dict[str, Any], str]) -> None:
    out, *_ = finished
    assert find_differences(out, rig_here("solve", out, "--json").stdout) == []


def test_a_worse_limit_fails_the_verdict(finished: tuple[Path, dict[str, Any], str]) -> None:
    out, *_ = finished
    judged = rig_here("solve", out, "--set", "limits.acceleration_bias_m_s2=1e-6", "--json")
    failed = [check["name"] for check in json.loads(judged.stdout)["checks"] if not check["passed"]]
    assert judged.returncode == 1 and failed == ["gyro.acceleration_bias"]


def test_one_run_calibrates_gyroscope_and_accelerometer(finished: tuple[Path, dict[str, Any], str]) -> None:
    """Where it sits, how late it is, and how its axes lie to the gyroscope's: that takes sweeps."""
    _, result, printed = finished
    found, gyro = result["accelerometers"]["gyro"], result["gyroscopes"]["gyro"]
    off = np.subtract(found["scale"] + found["bias_m_s2"], ACCELEROMETER["scale"] + ACCELEROMETER["bias_m_s2"])
    assert np.all(np.abs(off) < 4 * np.sqrt(np.diag(found["covariance"])))
    assert found["sweeps"] == 6 and len(gyro["rests"]) >= 11, "a dwell is a rest for the gyroscope"
    lever = np.array(found["lever_arm_m"]) - 1e-3 * np.array([20, -15, 30])
    assert np.all(np.abs(lever) < 4 * np.array(found["lever_arm_std_m"]))
    assert abs(found["delay_s"] - 3e-3) < 4 * found["delay_std_s"] < 1e-3
    # Both triads are square but for the accelerometer's own skew, of which half turns the frame nearest to its axes.
    turned = np.array(found["alignment"]["rotation_rad"])
    assert np.abs(turned).max() < np.radians(0.3) and "rotation against its gyroscope" in printed


def test_the_header_corrects_readings_as_the_result_does(
    finished: tuple[Path, dict[str, Any], str], tmp_path: Path
) -> None:
    """By a C compiler; the force comes out in the frame of the corrected rates."""
    out, result, _ = finished
    source = tmp_path / "try.c"
    source.write_text(
        '#include <stdio.h>\n#include "calibration.h"\nint main(void) { float m[3] = {1.0f, -2.0f, 9.0f}, s[3];\n'
        'gyro_calibrate_acceleration(m, s); printf("%.9g %.9g %.9g\\n", s[0], s[1], s[2]); return 0; }\n',
        encoding="utf-8",
    )
    program = tmp_path / "try"
    subprocess.run(["gcc", "-Wall", "-Werror", f"-I{out}", source, "-o", program], check=True, timeout=PATIENCE_S)
    said = subprocess.run([program], capture_output=True, text=True, check=True, timeout=PATIENCE_S).stdout
    found = result["accelerometers"]["gyro"]
    expected = np.array(found["correction_matrix"]) @ (np.array([1.0, -2.0, 9.0]) - found["bias_m_s2"])
    assert np.array(said.split(), dtype=np.float64) == pytest.approx(expected, rel=1e-5)


@pytest.mark.proof
@pytest.mark.thorough
def test_turning_it_over_tells_its_own_bias_from_the_arms_field(
    finished: tuple[Path, dict[str, Any], str], tmp_path: Path
) -> None:
    turned = {"sensors": {"gyro": {"mounting": OVER}}, "magnetometers": {"compass": {"mounting": OVER}}}
    over = tmp_path / "over"
    done = rig("run", configuration(tmp_path, merge(LABORATORY, turned), IMU), "--out", over)
    assert done.returncode == 0, done.stdout + done.stderr
    told = rig("reversal", finished[0], over, "--json", "--out", tmp_path / "reversal.json")
    assert told.returncode == 0, told.stderr
    found = json.loads(told.stdout)["magnetometers"]["compass"]
    assert found["arm_field_in_bias"] == [True, False, False]
    assert found["scale_std"] == pytest.approx([0.01 / 3**0.5 * k for k in found["scale"]], rel=0.1)  # shared by both
    off = np.array(found["bias_t"]) - 1e-6 * np.array(TRUTH["bias_ut"])
    assert np.all(np.abs(off) < 3 * np.array(found["bias_std_t"]))
    assert found["arm_field_t"][2] == pytest.approx(1e-6 * ARM_FIELD_UT, abs=4 * found["arm_field_std_t"][2])
    assert (tmp_path / "reversal.json").read_text(encoding="utf-8") == told.stdout
    said = rig("reversal", finished[0], over).stdout
    assert "x: never turned over" in said
    refused = rig("reversal", finished[0], finished[0])
    assert refused.returncode == 2 and "mounting_not_turned" in refused.stderr


@pytest.mark.thorough
@pytest.mark.parametrize(
    "world",
    [
        {"site": {"magnetic_gradient_ut_m": [2.0, 1.0, -3.0, 1.0, 1.0]}},
        pytest.param(
            {
                "arm": {"iron": {"housing": {"moment_a_m2": [0.12, 0.12, 0.1]}}},
                "magnetometers": {"compass": {"offset_mm": [0, 0, 100]}},
            },
            marks=[pytest.mark.proof, pytest.mark.thorough],
        ),
    ],
    ids=["gradient", "iron"],
)
def test_a_room_or_an_arm_that_bends_the_field_is_refused(tmp_path: Path, world: dict[str, Any]) -> None:
    out = tmp_path / "run"
    done = rig("run", configuration(tmp_path, merge(LABORATORY, {"world": world}), ATTITUDES), "--out", out)
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert result["magnetometers"]["compass"]["error"].startswith("field_not_uniform: ")
    assert "was recorded and not calibrated: field_not_uniform" in (out / "certificate.html").read_text(
        encoding="utf-8"
    )


@pytest.mark.proof
@pytest.mark.thorough
def test_sweeps_record_a_magnetometer_and_say_that_they_do_not_calibrate_it(tmp_path: Path) -> None:
    """Also beside a verification, in which its samples stay raw."""
    laboratory = merge(LABORATORY, {"sensors": {"gyro": {"acceleration": None}}})
    out = tmp_path / "run"
    done = rig("run", configuration(tmp_path, laboratory), "--out", out)
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert result["magnetometers"]["compass"]["error"].startswith("no_attitudes: ")
    assert set(result["gyroscopes"]) == set(
        yaml.safe_load((out / "config.yaml").read_text(encoding="utf-8"))["sensors"]
    )
    assert "compass, magnetometer, not calibrated: no_attitudes" in done.stdout.replace("\n", " ")
    assert len(recorded(out).samples["compass"]) > 100


Damage = Callable[[RunData], RunData]


def read_as(change: Callable[[np.ndarray], np.ndarray]) -> Damage:
    """The field of the recording changed, (n, 3) counts."""

    def damaged(run: RunData) -> RunData:
        samples = run.samples["compass"].copy()
        samples["field_counts"] = np.round(change(samples["field_counts"].astype(np.float64)))
        return replace(run, samples={**run.samples, "compass": samples})

    return damaged


def without_a_reference(run: RunData) -> RunData:
    assert run.settings.site is not None
    return replace(run, settings=replace(run.settings, site=replace(run.settings.site, magnetic_field_t=None)))


def with_every_third_sample_lost(run: RunData) -> RunData:
    samples = run.samples["compass"]
    return replace(run, samples={**run.samples, "compass": samples[np.arange(len(samples)) % 3 > 0]})


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("damage", "name"),
    [
        (without_a_reference, "field_strength_unknown"),
        (with_every_third_sample_lost, "lost_samples"),
        (read_as(lambda counts: np.clip(20.0 * counts, -32767, 32767)), "saturation"),
        (read_as(lambda counts: counts[:, [1, 2, 0]]), "swapped_axes"),
        (read_as(lambda counts: counts * [-1, 1, 1]), "mirrored_axis"),
        (read_as(lambda counts: counts + np.linspace(0, 1000, len(counts))[:, None]), "field_drifts"),
        (read_as(lambda counts: counts + 30 * np.sin(counts[:, :1] / 40)), "field_not_uniform"),  # the same at home
    ],
)
def test_a_field_that_does_not_calibrate_says_why_and_costs_the_accelerometer_nothing(
    finished: tuple[Path, dict[str, Any], str], damage: Damage, name: str
) -> None:
    outcome = calibrate([damage(recorded(finished[0]))])
    assert outcome.magnetometers.faults["compass"].name == name
    assert set(outcome.accelerometers) == {"gyro"}
    wanted = (
        list[str]() if name == "field_strength_unknown" else ["compass.field_unsolved"]
    )  # what asks for it is not there
    assert [check.name for check in outcome.checks if not check.passed] == wanted
