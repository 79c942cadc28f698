"""Sensors on somebody else's turntable: recorded by `rig record`, solved with the attitudes that the table wrote."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from rig.cli import main
from rig.commands.laboratory.laboratory_process import run_simulated_laboratory
from rig.motion.carried import FlangeLoad
from rig.motion.geometry import flange_attitude, flange_rate
from rig.motion.steps import Transfer, trapezoid_duration, travel
from rig.motion.turner_state import ArmState, Joints
from rig.turners.ur.arm_driver import Arm
from support.laboratories.commands import rig_here
from support.laboratories.ideal import ideal_document
from support.laboratories.worlds import fresh_host, hardware, merge
from support.paths import CONFIGS
from support.processes.waiting import PATIENCE_S
from support.processes.warm import start_module

KVH = CONFIGS / "own_port" / "kvh1775.yaml"
DURATION_S = 28.0
WAYS = ((0, 0, 2), (0, -2, 0), (2, 0, 0), (0, 1.5, -2), (-2, 0.5, 0))  # of the wrists, rad
COLUMNS = "start_s,end_s,qw,qx,qy,qz,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s"


def to(start: Joints, way: tuple[float, ...]) -> Transfer:
    target = tuple(a + b for a, b in zip(start, (0, 0, 0, *way), strict=True))
    longest = max(map(abs, travel(start, target)))
    return Transfer("test move", start, target, 1.0, 4.0, trapezoid_duration(longest, 1.0, 4.0))


def attitudes(states: list[ArmState]) -> str:
    """What a table's controller would have written: on its own clock, the rig knows nothing of it."""
    q, qd = (np.array([getattr(state, name) for state in states]) for name in ("q_rad", "qd_rad_s"))
    to_table = np.swapaxes(flange_attitude(q), -1, -2)
    quaternions = Rotation.from_matrix(to_table).as_quat()[:, [3, 0, 1, 2]]
    middles_s = np.array([state.time_s for state in states])
    rows = np.column_stack([middles_s - 0.004, middles_s + 0.004, quaternions, flange_rate(q, qd)])
    return "\n".join([COLUMNS, *(",".join(f"{value:.9f}" for value in row) for row in rows.tolist())]) + "\n"


@pytest.mark.thorough
@pytest.mark.slow
def test_a_sensor_on_a_table_with_a_clock_of_its_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    host = fresh_host()
    document = merge(ideal_document(KVH), {"arm": {"host": host}, "world": {"time_scale": 6}})
    document["sensors"]["kvh"]["serial"]["port"] = f"socket://{host}:7331"
    document["world"]["sensors"]["kvh"]["mounting_error_deg"] = [0, 0, 0]
    document["world"]["arm"] = {}  # a table does not vibrate as an arm does
    config = tmp_path / "config.yaml"
    config.write_text(yaml.safe_dump(document), encoding="utf-8")
    states: list[ArmState] = []
    with run_simulated_laboratory(config.read_text(encoding="utf-8")), Arm(host, states.append) as table:
        out = tmp_path / "recorded"
        command = ("record", hardware(config, tmp_path), "--out", out, "--duration-s", f"{DURATION_S}")
        with start_module(*command, stdout=subprocess.PIPE, text=True) as recording:
            while not (out / "kvh.csv").exists():
                table.check()
                assert recording.poll() is None
            table.take_control(FlangeLoad(0.95, (0.0, 0.0, 0.04)))
            for way in WAYS:
                table.move(to(table.latest.q_rad, way))
            said, _ = recording.communicate(timeout=PATIENCE_S)
    assert recording.returncode == 0 and ", 0 lost" in said
    table_file = tmp_path / "table.csv"
    table_file.write_text(attitudes(states), encoding="utf-8")
    given = [str(out / "kvh.csv"), "--attitudes", str(table_file), "--estimate-clock-offset", "--only", "gyroscope"]
    assert main(["solve", *given, "--json"]) == 0
    rate = json.loads(capsys.readouterr().out)["gyroscopes"]["imu"]
    assert rate["time_bases"][0]["offset_std_s"] < 1e-3
    truth = document["world"]["sensors"]["kvh"]
    # Seconds of turning, with rates told every 8 ms while they change: a table's own dwells know them far better, and
    # accelerations are not to be had from a table that does not stand.
    assert np.allclose(rate["scale"], truth["scale"], atol=2e-3)
    assert np.allclose(rate["bias_rad_s"], truth["bias_rad_s"], atol=1.5e-3)


def sensors_alone(folder: Path, **more: object) -> Path:
    config = folder / "table.yaml"
    sensor = {"part": "kvh1775", "serial_number": "1", "rate_hz": 250, "serial": {"port": str(folder / "no_port")}}
    config.write_text(yaml.safe_dump({"sensors": {"kvh": sensor}, **more}), encoding="utf-8")
    return config


def test_sensors_are_all_that_a_configuration_needs(tmp_path: Path) -> None:
    config = sensors_alone(tmp_path)
    done = rig_here("record", config, "--out", tmp_path / "out", "--duration-s", "1")
    assert done.returncode == 2 and "no_port" in done.stderr, done


def test_a_duration_that_is_none_is_refused(tmp_path: Path) -> None:
    done = rig_here("record", KVH, "--out", tmp_path, "--duration-s", "0")
    assert done.returncode == 2 and "bad_option" in done.stderr, done


def test_what_else_a_configuration_says_must_be_right_all_the_same(tmp_path: Path) -> None:
    config = sensors_alone(tmp_path, arm={"host": "192.0.2.1", "payload_kg": -1}, site={"altitude": 3})
    done = rig_here("record", config, "--out", tmp_path / "out", "--duration-s", "1")
    assert done.returncode == 2 and "arm.payload_kg" in done.stderr and "site.altitude" in done.stderr, done


def test_who_turns_the_sensors_needs_to_know_the_arm(tmp_path: Path) -> None:
    planned = rig_here("plan", sensors_alone(tmp_path))
    assert planned.returncode == 2 and "arm: missing" in planned.stderr and "limits: missing" in planned.stderr, planned
    config = sensors_alone(tmp_path, world={"sensors": {}})
    simulated = rig_here("record", config, "--out", tmp_path / "out", "--duration-s", "1")
    assert simulated.returncode == 2 and "arm: missing" in simulated.stderr, simulated


@pytest.mark.slow
@pytest.mark.parametrize("crystal", [True, False], ids=["crystal", "none"])
def test_a_boards_times_are_those_of_its_crystal_or_it_says_so(crystal: bool, tmp_path: Path) -> None:
    board = f"world.board={{crystal: {str(crystal).lower()}, crystal_ppm: 0}}"
    address = f"board.port=socket://{fresh_host()}:7321"
    config, told = CONFIGS / "by_hand.yaml", ("--set", board, "--set", address)
    done = rig_here("record", config, "--out", tmp_path, "--duration-s", "2", *told)
    assert done.returncode == 0, done
    assert ("does not follow its crystal" in done.stderr) is not crystal
    if crystal:
        time_s = np.loadtxt(tmp_path / "gyro.csv", delimiter=",", skiprows=1)[:, 0]
        assert np.diff(time_s).mean() == pytest.approx(1 / 238, rel=1e-5)
