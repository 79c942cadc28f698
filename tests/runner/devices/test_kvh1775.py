"""Runs with a KVH 1775 on its own serial port: alone, and beside a board whose reference verifies it."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig.analysis.gyroscope.calibration import observe_recordings
from rig.config.load import ConfigurationRefused, load
from rig.data.recording.run_file import read_run
from rig.estimation.earth import DEG_H, EARTH_RATE_RAD_S
from support.laboratories.commands import rig
from support.laboratories.ideal import ideal_document
from support.laboratories.worlds import fresh_host, merge
from support.paths import CONFIGS, DEMO

KVH = CONFIGS / "own_port" / "kvh1775.yaml"
QUICK: dict[str, Any] = {
    "arm": {"transfer_speed_deg_s": 170},
    "sensors": {"kvh": {"rate_hz": 100, "acceleration": None}},
    "procedure": {"speed_deg_s": 170, "acceleration_deg_s2": 700, "rest_s": 0.5},
    "limits": {"bias_std_rad_s": 0.001, "scale_std": 0.001},
    "world": {"time_scale": 12},
}
BOARD: dict[str, Any] = {
    "board": {},
    "sensors": {"reference": {"part": "adis16465", "serial_number": "ADIS-1", "role": "reference"}},
    "limits": {"verification_rms_rad_s": 0.02, "verification_mean_rad_s": 0.002},
    "world": {
        "sensors": {
            "reference": {"scale": [1.0, 1.0, 1.0], "bias_rad_s": [0.0, 0.0, 0.0], "noise_rad_s": 0.002},
            "kvh": {"scale": [1.0015, 0.999, 1.001], "bias_rad_s": [3e-4, -2e-4, 4e-4]},
        }
    },
}


def configuration(folder: Path, *changes: dict[str, Any]) -> Path:
    """kvh1775.yaml so changed, on an address of its own."""
    host = fresh_host()
    document = ideal_document(KVH)
    for change in (QUICK, *changes):
        document = merge(document, change)
    document["arm"]["host"] = host
    document["sensors"]["kvh"]["serial"]["port"] = f"socket://{host}:7331"
    if "board" in document:
        document["board"] = {"port": f"socket://{host}:7321"}
    path = folder / "config.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


def sensor(result: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """(6,) scale and bias of the KVH 1775 as stated, and their standard deviations."""
    entry = result["gyroscopes"]["kvh"]
    return np.array(entry["scale"] + entry["bias_rad_s"]), np.sqrt(np.diag(entry["covariance_combined"]))


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.thorough  # test_own_ports.py has B; tests/sensors reads both
@pytest.mark.parametrize("message", ["A", "B"])
def test_without_a_board(message: str, tmp_path: Path) -> None:
    serial = {"sensors": {"kvh": {"serial": {"message": message}}}}
    done = rig("run", configuration(tmp_path, serial), "--out", tmp_path / "run")
    assert done.returncode == 0, done.stderr + done.stdout
    assert "ROTUNITS was DEG, corrected" in done.stderr
    result = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    stated, std = sensor(result)
    truth = [1.0004, 0.9997, 1.0002, 4.8e-6, -2.9e-6, 3.9e-6]
    assert (np.abs(stated - truth) < 4 * std).all()
    assert std[:3].max() < 1e-4
    assert result["provenance"]["board_unique_id"] == "none"
    assert result["provenance"]["sensor_serial_numbers"] == {"kvh": "1775-0042"}
    (observed,) = observe_recordings([read_run(tmp_path / "run" / "run.h5")])
    clock = observed.sensors["kvh"].time_base
    assert clock.drift == pytest.approx(8e-6, abs=5 * clock.drift_std + 1e-6), "its oscillator is 8 ppm slow"


@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.slow
def test_beside_a_board_whose_reference_verifies_it(tmp_path: Path) -> None:
    verify = {"procedure": {"verify": True}}
    done = rig("run", configuration(tmp_path, BOARD, verify), "--out", tmp_path / "run")
    assert done.returncode == 0, done.stderr + done.stdout
    result = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    stated, std = sensor(result)
    assert (np.abs(stated - [1.0015, 0.999, 1.001, 3e-4, -2e-4, 4e-4]) < 4 * std).all()
    verification = result["verification"]["kvh"]
    assert verification["after"]["delay_s"] == [], "two clocks tell nothing of it"
    before, after = (
        np.abs([turn["error_rad_s"] for turn in verification[when]["revolutions"]]).max()
        for when in ("before", "after")
    )
    assert before > 0.002 > after, "the host has corrected its readings by what was found"
    recorded = read_run(tmp_path / "run" / "verify.h5").sensors
    assert recorded["kvh"].mode == "calibrated" and recorded["reference"].mode == "raw"


@pytest.mark.thorough
@pytest.mark.slow
def test_its_magnetometer_is_calibrated_in_format_c(tmp_path: Path) -> None:
    nine = [[0, -90, 0], [-90, -90, 0], [-90, -90, 90], [-180, -90, 45], [90, -90, -45], [45, -90, 90], [-45, -90, -90]]
    field: dict[str, Any] = {
        "sensors": {"kvh": {"rate_hz": 250, "acceleration": {"range_g": 10}, "serial": {"message": "C"}}},
        "procedure": {"name": "static_attitudes", "attitudes": [*nine, [-135, -90, 135], [0, -45, 90]], "dwell_s": 0.8},
        "limits": {"acceleration_scale_std": 0.01, "acceleration_bias_std_m_s2": 0.05},
        "site": {"magnetic_field_ut": 48},
        "world": {"sensors": {"kvh": {"magnetometer": {"bias_ut": [3, -2, 5], "noise_ut": 0.1}}}},
    }
    document = yaml.safe_load(configuration(tmp_path, field).read_text(encoding="utf-8"))
    document["procedure"] = {**field["procedure"], "acceleration_deg_s2": 400, "field_test_s": 4}
    (tmp_path / "config.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    done = rig("run", tmp_path / "config.yaml", "--out", tmp_path / "run")
    assert done.returncode == 0, done.stderr + done.stdout
    found = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))["magnetometers"]["kvh_field"]
    std = np.sqrt(np.diag(found["covariance"]))
    off = np.array(found["scale"] + found["bias_t"]) - [1, 1, 1, 3e-6, -2e-6, 5e-6]
    assert (np.abs(off) < 4 * std).all() and std[3:].max() < 0.1e-6
    assert (found["part"], found["serial_number"], found["arm_field_in_bias"]) == (
        "kvh1775_magnetometer",
        "1775-0042",
        True,
    )


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.thorough
def test_its_accelerometers_are_calibrated_where_those_of_the_board_are(tmp_path: Path) -> None:
    imu: dict[str, Any] = {
        "sensors": {"kvh": {"rate_hz": 250, "acceleration": {"range_g": 10}}},
        "procedure": {"name": "imu", "dwell_s": 2},
        "site": {"gravity_m_s2": 9.80665, "gravity_uncertainty_m_s2": 1e-4},
    }
    done = rig("run", configuration(tmp_path, imu), "--out", tmp_path / "run")
    assert done.returncode == 0, done.stderr + done.stdout
    result = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    entry = result["accelerometers"]["kvh"]
    assert entry["scale"] == pytest.approx([1.001, 0.9995, 1.0008], abs=2e-4)
    assert entry["bias_m_s2"] == pytest.approx([0.004, -0.006, 0.005], abs=2e-3)


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.timeout(3600)
def test_it_finds_the_earths_rate_beside_what_the_paper_found(tmp_path: Path) -> None:
    """TRIAX, section III-A, which is 0.36 °/h off: whole runs on an arm that vibrates, at another heading each."""
    off = []
    over = []
    parameters = []
    for seed in range(1, 7):
        heading_deg = 47 * seed % 360
        world = {"world": {"seed": seed, "site": {"heading_deg": heading_deg}}}
        result = earth_run(tmp_path / str(seed), world)
        earth = result["gyroscopes"]["kvh"]["earth_rate"]
        off.append((earth["norm_rad_s"] - EARTH_RATE_RAD_S) / DEG_H)
        over.append((earth["norm_rad_s"] - EARTH_RATE_RAD_S) / earth["norm_std_rad_s"])
        turned = np.angle(np.exp(1j * (earth["heading_rad"] - np.radians(heading_deg))))
        assert abs(turned) < 4 * earth["heading_std_rad"] + np.radians(0.1)
        assert abs(earth["latitude_rad"] - np.radians(38.777888)) < 4 * earth["latitude_std_rad"] + np.radians(0.1)
        stated, std = sensor(result)
        truth = [0.99959967, 0.99869272, 1.00028956, 2.634478e-6, -9.332663e-7, 1.35263e-7]
        beside = result["accelerometers"]["kvh"]
        bent = np.subtract(beside["second_order_s2_m"], [9.72e-6, -9.478e-5, -1.764e-5])
        parameters.extend([*(stated - truth) / std, *bent / beside["second_order_std_s2_m"]])
        print(f"seed {seed}: {off[-1]:+.3f} deg/h, {over[-1]:+.2f} σ")
    rms, ratio = np.sqrt(np.mean(np.square(off))), np.sqrt(np.mean(np.square(over)))
    print(f"norm {rms:.3f} deg/h RMS, over σ {ratio:.2f}; F, b and φ at most {np.abs(parameters).max():.1f} σ off")
    assert rms < 0.1
    assert ratio < 1.8, "six of them: within four of its own deviations of 1"
    assert np.mean(np.abs(parameters) < 3) > 0.95 and np.abs(parameters).max() < 5, "54 of them"


def earth_run(folder: Path, changes: dict[str, Any]) -> dict[str, Any]:
    """The result of kvh1775_earth.yaml so changed, on an address of its own."""
    folder.mkdir()
    host = fresh_host()
    document = merge(yaml.safe_load(load(CONFIGS / "own_port" / "kvh1775_earth.yaml").text), changes)
    document["arm"]["host"] = host
    document["sensors"]["kvh"]["serial"]["port"] = f"socket://{host}:7331"
    path = folder / "config.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    done = rig("run", path, "--out", folder / "run")
    assert done.returncode == 0, done.stderr + done.stdout
    assert "the Earth's rate in the arm's base, °/h" in done.stdout
    assert "Earth's rate found: 1" in rig("show", folder / "run", "--all").stdout
    assert (folder / "run" / "earth_rate_kvh.png").stat().st_size > 10_000
    result: dict[str, Any] = json.loads((folder / "run" / "result.json").read_text(encoding="utf-8"))
    return result


@pytest.mark.thorough
@pytest.mark.slow
def test_axes_that_somebody_left_refuse_the_run_before_anything_moves(tmp_path: Path) -> None:
    axes = {"world": {"sensors": {"kvh": {"kvh1775": {"settings": {"AXES": "0,1,0,1,0,0,0,0,1"}}}}}}
    done = rig("run", configuration(tmp_path, axes), "--out", tmp_path / "run")
    assert done.returncode == 2 and "kvh_axes_not_identity" in done.stderr
    assert "pre-flight" not in done.stderr, "nothing has moved"


@pytest.mark.thorough
@pytest.mark.slow
def test_check_and_info_say_what_is_there(tmp_path: Path) -> None:
    left = {"world": {"sensors": {"kvh": {"kvh1775": {"settings": {"FILTTYPE,G": "CUSTOM"}, "serial_number": "9"}}}}}
    config = configuration(tmp_path, left)
    done = rig("check", config)
    assert done.returncode == 2
    assert "serial number 9" in done.stdout and "a run sets it to B" in done.stdout
    assert "kvh_other_serial_number" in done.stderr and "kvh_custom_filter" in done.stderr
    done = rig("kvh", "info", config, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["serial_number"] == "9" and found["settings"]["FILTTYPE,G"] == "CUSTOM"
    assert found["built_in_test"] == " ".join(["7f"] * 6) and found["messages"] > 100 and found["lost"] == 0
    assert found["acceleration_g"][2] == pytest.approx(-1.0, abs=0.02), "at home the flange looks down"


@pytest.mark.parametrize(
    ("file", "override", "said"),
    [
        (KVH, "sensors.kvh.serial=null", "kvh1775 is not on the board: give its section serial"),
        (DEMO, "sensors.gyro.serial={port: /dev/ttyUSB0}", "lsm9ds1 is on the board: leave serial out"),
        (KVH, "sensors.kvh.serial.baud=9600", "its line cannot carry this rate: 250 Hz × 40 bytes = 10000 bytes/s"),
        (KVH, "sensors.kvh.serial.port=/dev/ttyUSB0", "sensors.kvh.serial.port"),
        (DEMO, "board=null", "the board reads gyro, but there is no section board"),
        (DEMO, "world.sensors.gyro.kvh1775={}", "no such instrument; the sensor is on the board"),
    ],
)
def test_a_sensor_has_a_port_of_its_own_or_is_on_the_board(file: Path, override: str, said: str) -> None:
    with pytest.raises(ConfigurationRefused) as caught:
        load(file, [override])
    assert any(said in problem for problem in caught.value.problems), caught.value.problems
