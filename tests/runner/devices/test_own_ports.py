"""A run with sensors on ports of their own and no board: a KVH 1775, and beside it a device that prints lines."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig.analysis.gyroscope.calibration import observe_recordings
from rig.data.quantity import PRESSURE, TEMPERATURE
from rig.data.recording.run_file import read_run
from rig.notebook.runs import load
from support.laboratories.commands import rig
from support.laboratories.ideal import ideal_document
from support.laboratories.worlds import fresh_host, merge
from support.paths import CONFIGS

pytestmark = pytest.mark.slow

QUICK: dict[str, Any] = {
    "arm": {"transfer_speed_deg_s": 170},
    "sensors": {"kvh": {"rate_hz": 100, "acceleration": None}},
    "procedure": {"speed_deg_s": 170, "acceleration_deg_s2": 700, "rest_s": 0.5},
    "limits": {"scale_deviation": 0.05, "scale_std": 0.01, "bias_rad_s": 0.1, "bias_std_rad_s": 0.05},
    "world": {"time_scale": 12},
}
PRINTED: dict[str, Any] = {
    "columns": ["time", "gx", "gy", "gz", "ax", "ay", "az", "temperature", "air", "room"],
    "scalars": {"air": {"unit": "hPa"}, "room": {"unit": "K"}},
}
TRUTH = {
    "kvh": [1.0004, 0.9997, 1.0002, 4.8e-6, -2.9e-6, 3.9e-6],
    "imu": [1.011, 0.993, 1.006, 0.012, -0.02, 0.007],
}


def configuration(folder: Path) -> Path:
    """kvh1775.yaml, and the device of lines.yaml with a barometer and a thermometer of the room."""
    host = fresh_host()
    lines = yaml.safe_load((CONFIGS / "own_port" / "lines.yaml").read_text(encoding="utf-8"))
    device = merge(
        lines["sensors"]["imu"], {"rate_hz": 50, "lines": PRINTED, "serial": {"port": f"socket://{host}:7341"}}
    )
    simulated = merge(lines["world"]["sensors"]["imu"], {"lines": {"scalars": {"air": 964.8, "room": 294.65}}})
    beside = {"sensors": {"imu": device}, "world": {"sensors": {"imu": simulated}}}
    own = {"arm": {"host": host}, "sensors": {"kvh": {"serial": {"port": f"socket://{host}:7331"}}}}
    document = merge(merge(merge(ideal_document(CONFIGS / "own_port" / "kvh1775.yaml"), QUICK), beside), own)
    path = folder / "config.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any], str]:
    """The folder of the run, its result, and what it said."""
    folder = tmp_path_factory.mktemp("own ports")
    done = rig("run", configuration(folder), "--out", folder / "run")
    assert done.returncode == 0, done.stderr + done.stdout
    result: dict[str, Any] = json.loads((folder / "run" / "result.json").read_text(encoding="utf-8"))
    return folder / "run", result, done.stderr


@pytest.mark.parametrize("name", TRUTH)
def test_the_truth_is_found_without_a_board(finished: tuple[Path, dict[str, Any], str], name: str) -> None:
    entry = finished[1]["gyroscopes"][name]
    std = np.sqrt(np.diag(entry["covariance_combined"]))
    assert (np.abs(np.subtract(entry["scale"] + entry["bias_rad_s"], TRUTH[name])) < 4 * std).all()
    assert std[:3].max() < {"kvh": 1e-4, "imu": 1e-2}[name]


def test_a_kvh_1775_is_set_right_and_timed_by_its_own_oscillator(finished: tuple[Path, dict[str, Any], str]) -> None:
    folder, result, said = finished
    assert "ROTUNITS was DEG, corrected" in said
    assert result["provenance"]["board_unique_id"] == "none"
    assert result["provenance"]["sensor_serial_numbers"] == {"kvh": "1775-0042", "imu": "ESP32-7"}
    (observed,) = observe_recordings([read_run(folder / "run.h5")])
    clock = observed.sensors["kvh"].time_base
    assert clock.drift == pytest.approx(8e-6, abs=5 * clock.drift_std + 1e-6), "its oscillator is 8 ppm slow"


def test_what_a_device_prints_beside_its_rates_comes_out_of_every_way_out(
    finished: tuple[Path, dict[str, Any], str], tmp_path: Path
) -> None:
    """Its barometer, and its thermometer of the room, as the configuration names them."""
    folder, *_ = finished
    run = read_run(folder / "run.h5")
    assert {name: sensor.channels[0].measures for name, sensor in run.sensors.items() if not sensor.has_axes} == {
        "imu_air": PRESSURE,
        "imu_room": TEMPERATURE,
    }
    assert run.sensors["imu_air"].channel(PRESSURE).values(run.samples["imu_air"]) == pytest.approx(96_480)
    shown = rig("show", folder, "--sensor", "imu_air")
    assert "pressure mean 964.80, 964.80 to 964.80 hPa" in shown.stdout, shown.stderr
    assert rig("export", folder, "--format", "csv", "--out", tmp_path / "tables").returncode == 0
    header, first, *_ = (tmp_path / "tables" / "imu_room.csv").read_text(encoding="utf-8").splitlines()
    assert header == "time_s,temperature_c" and float(first.split(",")[1]) == pytest.approx(21.5)
    frame = load(folder)["imu_air"].to_frame()
    assert frame["pressure_pa"].iloc[0] == pytest.approx(96_480)
    assert frame.index[0] == pytest.approx(load(folder)["imu"].to_frame().index[0], abs=1e-6), "on one clock"
