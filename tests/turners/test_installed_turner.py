"""A turner that a package adds, a turntable of one joint, is configured, recorded, shown; no line of rig knows it."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from support.paths import ROOT
from support.processes.waiting import PATIENCE_S

pytestmark = pytest.mark.slow

ENTRIES = """
[rig.turners]
turntable = support.extensions.turntable:KIND
[rig.procedures]
one_axis = support.extensions.turntable:PROCEDURE
"""
READ = """
import sys
from pathlib import Path
from rig.data.recording.run_file import read_run
from rig.page.arm import stance
from rig.page.replay import moments
from rig.station.events import ArmSeen
run = read_run(Path(sys.argv[1]))
seen = [stance(each.event.state) for each in moments(run) if isinstance(each.event, ArmSeen)]
print(run.turner.to_json())
print(run.states.dtype.names, run.states["q_rad"].shape[1:], sorted(seen[0]), len(seen[0]["q_rad"]))
"""
# One process for all commands: each would take a second to import the same.
IN_TURN = """
import io, json, sys
from contextlib import redirect_stderr, redirect_stdout
from rig.cli import main
ended = []
for command in json.loads(sys.argv[1]):
    with redirect_stdout(io.StringIO()) as output, redirect_stderr(io.StringIO()) as errors:
        status = main(command)
    ended.append((status, output.getvalue(), errors.getvalue()))
print(json.dumps(ended))
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of somebody who has installed the package."""
    folder = tmp_path_factory.mktemp("site")
    package = folder / "turntable-1.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: turntable\nVersion: 1\n", encoding="utf-8")
    (package / "entry_points.txt").write_text(ENTRIES, encoding="utf-8")
    path = os.pathsep.join([str(folder), str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")])
    return {**os.environ, "PYTHONPATH": path}


@pytest.fixture(scope="module")
def recorded(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of it, with its result."""
    folder = tmp_path_factory.mktemp("run")
    ran(installed, "-m", "support.extensions.turned_run", str(folder))
    result = ran(installed, "-m", "rig", "solve", str(folder), "--json")
    (folder / "result.json").write_text(result, encoding="utf-8")
    return folder


def ran(environment: dict[str, str], *command: str, status: int = 0) -> str:
    done = subprocess.run(
        [sys.executable, *command],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
        cwd=ROOT,
        env=environment,
    )
    assert done.returncode == status, done.stderr
    return done.stdout + (done.stderr if status else "")


@pytest.mark.thorough
def test_its_states_come_back_as_it_told_them(recorded: Path, installed: dict[str, str]) -> None:
    described, shapes = ran(installed, "-c", READ, str(recorded / "run.h5")).splitlines()
    turner = json.loads(described)
    assert (turner["kind"], turner["maker"], turner["joints"]) == ("turntable", "Toys", ["table"])
    assert turner["geometry"]["d_m"] == [0.2] and turner["fields"] == [{"name": "current_a", "type": "f4"}]
    names = "('time_s', 'host_time_s', 'q_rad', 'qd_rad_s', 'current_a')"
    assert shapes == f"{names} (1,) ['let_go', 'q_rad', 'qd_rad_s'] 1"


@pytest.mark.thorough
def test_its_recording_is_solved_shown_and_exported(recorded: Path, installed: dict[str, str], tmp_path: Path) -> None:
    result = json.loads((recorded / "result.json").read_text(encoding="utf-8"))
    assert result["verdict"] == "pass" and [check["name"] for check in result["checks"]] == ["gyro.speed"]
    assert result["provenance"]["turner_kind"] == "turntable" and result["provenance"]["arm_model"] == "T1"
    assert "verdict: PASS" in ran(installed, "-m", "rig", "show", str(recorded))
    ran(installed, "-m", "rig", "report", str(recorded))
    page = (recorded / "certificate.html").read_text(encoding="utf-8")
    assert "Equipment: turntable Toys T1, serial number T-7, software 1.0" in page
    ran(installed, "-m", "rig", "export", str(recorded), "--format", "csv", "--out", str(tmp_path / "csv"))
    header, *rows = (tmp_path / "csv" / "arm.csv").read_text(encoding="utf-8").splitlines()
    assert header == "time_s,table_rad,table_rad_s" and len(rows) > 1000
    header, *turns = (tmp_path / "csv" / "gyro_sweeps.csv").read_text(encoding="utf-8").splitlines()
    assert len([row for row in turns if not row.endswith(",0")]) == 2


def test_it_is_planned_and_looked_at_by_its_configuration(recorded: Path, installed: dict[str, str]) -> None:
    config = str(recorded / "config.yaml")
    plan, machine, checked, too_fast, misspelt, another = commands_in_turn(
        installed,
        ["plan", config],
        ["plan", config, "--json"],
        ["check", config, "--json"],
        ["plan", config, "--set", "procedure.speed_deg_s=400"],
        ["plan", config, "--set", "turner.kind=turntabel"],
        ["plan", config, "--set", "procedure.name=six_observation"],
    )
    assert plan.status == 0 and "joint 1 +0.0 → " in plan.output and "2 sweeps" in plan.output
    assert "that the checks detect in 95 of 100 runs" in " ".join(plan.output.split())
    limits = json.loads(machine.output)["detection_limits"]["gyro"]
    assert all(each["size"] is None or each["size"] > 0 for each in limits) and any(each["size"] for each in limits)
    report = json.loads(checked.output)
    assert checked.status == 2 and "table at /dev/ttyUSB7: Toys T1, serial number T-7" in report["seen"]
    assert [problem["name"] for problem in report["missing"]] == ["no_port"]
    assert [refused.status for refused in (too_fast, misspelt, another)] == [2, 2, 2]
    assert "joint_speed" in too_fast.output + too_fast.errors
    allowed = "did you mean turntable?; allowed: ur, hand, servo, turntable"
    assert f"turner.kind (--set): 'turntabel' is not allowed, {allowed}" in misspelt.errors
    assert "other_turner" in another.errors


class Ended(NamedTuple):
    """A command's exit status and what it printed."""

    status: int
    output: str
    errors: str


def commands_in_turn(environment: dict[str, str], *commands: list[str]) -> list[Ended]:
    return [Ended(*each) for each in json.loads(ran(environment, "-c", IN_TURN, json.dumps(commands)))]
