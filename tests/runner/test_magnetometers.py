"""A magnetometer beside the gyroscopes from end to end: real clients, real firmware, simulated laboratory."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from firmware_host.samples import FIELD_SAMPLE_DTYPE
from rig.analysis.outcome import calibrated
from rig.data.run_file import RunData, read_run
from rig.errors import Fault
from support.commands import configuration, rig
from support.worlds import merge

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
ATTITUDES = {"name": "static_attitudes", "attitudes": NINE, "dwell_s": 0.6, "acceleration_deg_s2": 700}
LABORATORY: dict[str, Any] = {
    "arm": {"transfer_speed_deg_s": 170},
    "sensors": {"gyro": {"acceleration": {"range_g": 2}}},
    "magnetometers": {"compass": COMPASS},
    "site": SITE,
    "limits": {
        "acceleration_scale_deviation": 0.1,
        "acceleration_scale_std": 0.01,
        "acceleration_bias_m_s2": 1,
        "acceleration_bias_std_m_s2": 0.05,
    },
    "world": {
        "time_scale": 20,
        "site": {"magnetic_field_ut": 50.0, "magnetic_dip_deg": 60, "magnetic_declination_deg": 30},
        "magnetometers": {"compass": TRUTH},
    },
}

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any], str]:
    """The run folder, result.json, and what was printed."""
    folder = tmp_path_factory.mktemp("compass")
    out = folder / "run"
    done = rig("run", configuration(folder, LABORATORY, ATTITUDES), "--out", out)
    assert done.returncode == 0, done.stdout + done.stderr
    return out, json.loads((out / "result.json").read_text(encoding="utf-8")), done.stdout


def recorded(out: Path) -> RunData:
    return read_run(out / "run.h5")


def test_the_field_is_recorded_beside_the_rates_and_nothing_is_lost(
    finished: tuple[Path, dict[str, Any], str],
) -> None:
    run = recorded(finished[0])
    assert set(run.magnetometers) == {"compass"} and "compass" not in run.sensors
    compass, samples = run.magnetometers["compass"], run.samples["compass"]
    assert compass.rate_hz == 80 and compass.range_t == pytest.approx(4e-4)
    assert samples.dtype == FIELD_SAMPLE_DTYPE
    assert samples["sequence"].tolist() == list(range(len(samples)))
    assert np.diff(samples["board_time_us"].astype(float)).mean() == pytest.approx(12_500, rel=1e-3)
    assert run.provenance.sensor_serial_numbers["compass"] == "LSM9DS1-001"


def test_dwells_tell_scale_bias_and_angles_as_they_are(finished: tuple[Path, dict[str, Any], str]) -> None:
    _, result, printed = finished
    found = result["magnetometers"]["compass"]
    std = np.sqrt(np.diag(found["covariance"]))
    off = np.array(found["scale"] + found["bias_t"]) - [*TRUTH["scale"], *(1e-6 * np.array(TRUTH["bias_ut"]))]
    assert np.abs(off / std).max() < 4
    assert std[:3].max() < 0.01 and std[3:].max() < 0.5e-6
    skew = np.array(found["non_orthogonality_rad"]) - np.radians([0.4, -0.3, 0.5])
    assert np.all(np.abs(skew) < 4 * np.array(found["non_orthogonality_std_rad"]))
    assert len(found["dwells"]) == 9 and found["field_t"] == 50e-6
    # North lies along the base's x axis, the field's level part 30° clockwise of it, towards −y.
    level, down = 50e-6 * np.cos(np.radians(60)), 50e-6 * np.sin(np.radians(60))
    true = [level * np.cos(np.radians(30)), -level * np.sin(np.radians(30)), -down]
    assert found["field_base_t"] == pytest.approx(true, abs=1e-6)
    assert "magnetometer as mounted" in printed and "no limit judges it" in printed
    assert not [check for check in result["checks"] if check["name"].startswith("compass")]


def test_solving_the_recording_equals_the_run(finished: tuple[Path, dict[str, Any], str]) -> None:
    out, result, _ = finished
    assert json.loads(rig("solve", out, "--json").stdout)["magnetometers"] == result["magnetometers"]


def test_sweeps_record_a_magnetometer_and_say_that_they_do_not_calibrate_it(tmp_path: Path) -> None:
    """Also beside a verification, in which its samples stay raw."""
    laboratory = merge(LABORATORY, {"sensors": {"gyro": {"acceleration": None}}})
    out = tmp_path / "run"
    done = rig("run", configuration(tmp_path, laboratory), "--out", out)
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert result["magnetometers"]["compass"]["error"].startswith("no_attitudes: ")
    assert set(result["sensors"]) == set(yaml.safe_load((out / "config.yaml").read_text(encoding="utf-8"))["sensors"])
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


@pytest.mark.parametrize(
    ("damage", "name"),
    [
        (without_a_reference, "field_strength_unknown"),
        (with_every_third_sample_lost, "lost_samples"),
        (read_as(lambda counts: np.clip(20.0 * counts, -32767, 32767)), "saturation"),
        (read_as(lambda counts: counts[:, [1, 2, 0]]), "swapped_axes"),
        (read_as(lambda counts: counts * [-1, 1, 1]), "mirrored_axis"),
        (read_as(lambda counts: counts + np.linspace(0, 1000, len(counts))[:, None]), "attitude_untrustworthy"),
    ],
)
def test_a_field_that_does_not_calibrate_says_why_and_costs_the_accelerometer_nothing(
    finished: tuple[Path, dict[str, Any], str], damage: Damage, name: str
) -> None:
    outcome = calibrated([damage(recorded(finished[0]))])
    fault = outcome.magnetometers["compass"]
    assert isinstance(fault, Fault) and fault.name == name, fault
    assert outcome.passed and set(outcome.accelerometers) == {"gyro"}
