"""Accelerometers from end to end in attitudes alone; test_magnetometers.py has the run with sweeps."""

import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig.analysis.analyses import calibrate
from rig.data.recording.recorded_events import DwellFinished, DwellStarted
from rig.data.recording.run_data import RunData
from rig.data.recording.run_file import read_run
from rig.errors import Fault
from support.laboratories.commands import configuration, rig, rig_here, wait_for_log
from support.laboratories.worlds import merge
from support.processes.waiting import PATIENCE_S

ACCELEROMETER: dict[str, Any] = {
    "scale": [1.02, 0.985, 1.01],
    "bias_m_s2": [0.3, -0.2, 0.4],
    "noise_m_s2": 0.015,
    "non_orthogonality_deg": [0.3, -0.2, 0.1],
    "delay_ms": 3.0,
}
LABORATORY: dict[str, Any] = {
    "arm": {"transfer_speed_deg_s": 170},
    "sensors": {"gyro": {"acceleration": {"range_g": 2}}},
    "limits": {
        "scale_std": 1,
        "bias_std_rad_s": 1,
        "acceleration_scale_deviation": 0.1,
        "acceleration_scale_std": 0.01,
        "acceleration_bias_m_s2": 1,
        "acceleration_bias_std_m_s2": 0.05,
        "acceleration_verification_m_s2": 0.02,
    },
    "world": {
        "time_scale": 20,
        "sensors": {
            "gyro": {"noise_rad_s": 0.005, "offset_mm": [20, -15, 30], "accelerometer": ACCELEROMETER},
        },
    },
}
NINE = [[0, -90, 0], [-90, -90, 0], [-90, -90, 90], [-180, -90, 45], [90, -90, -45], [45, -90, 90], [-45, -90, -90]]
NINE += [[-135, -90, 135], [0, -90, -135]]
ATTITUDES = {"name": "static_attitudes", "attitudes": NINE, "dwell_s": 0.6, "acceleration_deg_s2": 700}

pytestmark = pytest.mark.slow

Finished = tuple[Path, dict[str, Any], dict[str, Any], str]


def finished(folder: Path, procedure: dict[str, Any]) -> Finished:
    """The run folder, result.json, the truth of the part, and everything `rig show` prints."""
    config = configuration(folder, LABORATORY, procedure)
    out = folder / "run"
    done = rig("run", config, "--out", out)
    assert done.returncode == 0, done.stdout + done.stderr
    world = yaml.safe_load(config.read_text(encoding="utf-8"))["world"]["sensors"]["gyro"]
    shown = rig_here("show", out, "--all").stdout
    return out, json.loads((out / "result.json").read_text(encoding="utf-8")), world, shown


@pytest.fixture(scope="module")
def in_attitudes(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    return finished(tmp_path_factory.mktemp("attitudes"), {**ATTITUDES, "repeats": 2})


def over_std(result: dict[str, Any], world: dict[str, Any]) -> np.ndarray:
    """(6,) how far scale and bias are from the truth, in standard deviations."""
    found = result["accelerometers"]["gyro"]
    truth = world["accelerometer"]["scale"] + world["accelerometer"]["bias_m_s2"]
    return np.asarray((np.array(found["scale"] + found["bias_m_s2"]) - truth) / np.sqrt(np.diag(found["covariance"])))


@pytest.mark.thorough
def test_attitudes_alone_calibrate_the_accelerometer(in_attitudes: Finished) -> None:
    out, result, world, printed = in_attitudes
    assert np.abs(over_std(result, world)).max() < 4
    found = result["accelerometers"]["gyro"]
    assert result["gyroscopes"] == {} and found["lever_arm_m"] is None and found["alignment"] is None
    assert len(found["dwells"]) == 9 and found["validation"]["dwells"] == 9
    skew = np.array(found["non_orthogonality_rad"]) - np.radians([0.1, -0.2, 0.3])
    assert np.all(np.abs(skew) < 4 * np.array(found["non_orthogonality_std_rad"]))
    assert {check["name"] for check in result["checks"] if check["unit"] != "1" or "scale" in check["name"]} == {
        f"gyro.acceleration_{name}"
        for name in ("scale_deviation", "scale_std", "bias", "bias_std", "verification", "scale_changed")
    }
    assert {"gyro.acceleration_even_term", "gyro.acceleration_stuck_axis"} <= {c["name"] for c in result["checks"]}
    assert "attitude error found" in printed and "held out" in printed
    lines = {line["name"]: line for line in found["budget"]["contributors"]}
    assert {"noise", "arm's attitudes", "gravity"} <= lines.keys() and "filter's lag" not in lines  # nothing was swept
    std = np.sqrt(np.diag(found["covariance_combined"]))
    assert found["budget"]["expanded"] == pytest.approx(list(found["budget"]["coverage_factors"] * std))
    assert np.all(np.diag(np.subtract(found["covariance_combined"], found["covariance"])) >= -1e-15)
    assert "uncertainty budget" in printed
    for suffix in (".png", ".svg"):
        assert (out / f"accelerometer_gyro{suffix}").stat().st_size > 10_000


Damage = Callable[[RunData], RunData]


def read_as(change: Callable[[np.ndarray], np.ndarray]) -> Damage:
    """The accelerations of the recording changed, (n, 3) counts."""

    def damaged(run: RunData) -> RunData:
        samples = run.samples["gyro"].copy()
        samples["acceleration_counts"] = np.round(change(samples["acceleration_counts"].astype(np.float64)))
        return replace(run, samples={"gyro": samples})

    return damaged


def turned_by(joint: int, angle_deg: float, dwell: int) -> Damage:
    """The arm says that a joint stood elsewhere in one dwell."""

    def damaged(run: RunData) -> RunData:
        began_s, ended_s = (
            event.controller_time_s
            for event in run.events
            if isinstance(event.event, DwellStarted | DwellFinished) and event.event.dwell.index == dwell
        )
        assert began_s is not None and ended_s is not None
        arm = run.states.copy()
        inside = (arm["time_s"] > began_s - 0.1) & (arm["time_s"] < ended_s + 0.1)
        arm["q_rad"][inside, joint] += np.radians(angle_deg)
        return replace(run, states=arm)

    return damaged


def saturated(counts: np.ndarray) -> np.ndarray:
    clipped: np.ndarray = np.clip(2.2 * counts, -32767, 32767)
    return clipped


@pytest.mark.thorough
@pytest.mark.one_in(4)
@pytest.mark.parametrize(
    ("damage", "name"),
    [
        (read_as(lambda counts: counts[:, [1, 0, 2]]), "mirrored_axis|swapped_axes"),
        (read_as(lambda counts: counts[:, [1, 2, 0]]), "swapped_axes"),
        (read_as(lambda counts: counts * [-1, -1, 1]), "mirrored_axis"),
        (read_as(lambda counts: counts * [1, 1, -1]), "mirrored_axis"),
        (read_as(lambda counts: counts / 9.80665), "wrong_unit"),
        (read_as(lambda counts: counts * 9.80665 / 4), "wrong_unit|saturation"),
        (read_as(saturated), "saturation"),
        (read_as(lambda counts: 0 * counts + 100), "stuck_sensor|duplicated_observation|zero_reading|wrong_unit"),
        (turned_by(5, 2.0, 1), "attitude_untrustworthy"),
        (turned_by(3, -2.0, 4), "attitude_untrustworthy"),
    ],
)
def test_a_recording_that_is_wrong_is_refused_by_name(in_attitudes: Finished, damage: Damage, name: str) -> None:
    run = read_run(in_attitudes[0] / "run.h5")
    with pytest.raises(Fault) as refused:
        calibrate([damage(run)])
    assert re.fullmatch(name, refused.value.name), refused.value


@pytest.mark.thorough
def test_a_board_that_goes_on_swinging_is_not_measured(tmp_path: Path) -> None:
    swings = {"world": {"arm": {"settling_rad": 2e-3, "settling_hz": 10, "settling_decay_s": 10}}}
    config = configuration(tmp_path, merge(LABORATORY, swings), {**ATTITUDES, "settle_s": 1})
    done = rig("run", config, "--out", tmp_path / "run")
    assert done.returncode == 3 and "rig: not_settled: 1 s after the arm came to dwell" in done.stderr, done.stderr
    assert "times as much as at rest" in done.stderr


@pytest.mark.thorough
def test_a_turned_tool_frame_is_refused_before_attitudes(tmp_path: Path) -> None:
    turned = {"world": {"arm": {"tcp_rotation_deg": [0, 0, 45]}}}
    config = configuration(tmp_path, merge(LABORATORY, turned), ATTITUDES)
    looked, ran = rig("check", config), rig("run", config, "--out", tmp_path / "run")
    assert looked.returncode == ran.returncode == 2, looked.stdout + ran.stdout
    assert "missing: tcp_rotated: the tool's frame on the pendant is turned by 45°" in looked.stderr
    assert "rig: tcp_rotated: " in ran.stderr and "to zero on the pendant" in ran.stderr


@pytest.mark.proof
@pytest.mark.thorough
def test_an_interrupted_run_goes_on_where_it_stood(tmp_path: Path) -> None:
    """Dwells that are finished are not repeated; in `make test`, test_drifting.py kills such a run and resumes it."""
    config, out = configuration(tmp_path, LABORATORY, ATTITUDES), tmp_path / "run"
    command = [sys.executable, "-m", "rig", "run", str(config), "--out", str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        wait_for_log(out, "done: dwell at", times=5)  # in fewer attitudes the board's clock is not told
        running.send_signal(signal.SIGINT)
        running.communicate(timeout=PATIENCE_S)
    assert running.returncode == 130
    resumed = rig("resume", out)
    assert resumed.returncode == 0, resumed.stdout + resumed.stderr
    first, second = read_run(out / "run.h5"), read_run(out / "run-2.h5")
    done = [
        event.event.dwell.index
        for run in (first, second)
        for event in run.events
        if isinstance(event.event, DwellFinished)
    ]
    assert sorted(done) == list(range(9))
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert len(result["accelerometers"]["gyro"]["dwells"]) == 9
