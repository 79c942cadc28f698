"""A procedure of one's own in one file: run, interrupted, resumed by the same script or not at all."""

import hashlib
import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from math import radians
from pathlib import Path

import pytest
import yaml

from support.laboratories.commands import configuration, python, rig, rig_here, wait_for_log
from support.laboratories.worlds import merge
from support.paths import ROOT
from support.processes.waiting import PATIENCE_S
from support.recordings.stated import find_differences

OWN = ROOT / "tests" / "support" / "motions" / "unequal_sweeps.py"
SECTION = {"procedure": {"name": "unequal_sweeps", "wrist_2_deg_s": 100}}

pytestmark = pytest.mark.slow


def own_configuration(folder: Path) -> Path:
    """ci.yaml for the procedure of one's own, slowly enough to be interrupted."""
    path = configuration(folder, {"world": {"time_scale": 4}})
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    path.write_text(yaml.safe_dump({**document, **SECTION}, sort_keys=False), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The folder of a run of one's own script that was interrupted after two sweeps."""
    folder = tmp_path_factory.mktemp("own")
    out, copy = folder / "run", folder / "mine.py"
    copy.write_text(OWN.read_text(encoding="utf-8"), encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, "-m", "rig", "run", str(own_configuration(folder)), "--script", str(copy), "--out", str(out)],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    wait_for_log(out, "done: sweep wrist_1 cw")
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130, errors
    copy.write_text("a later version, which is another script", encoding="utf-8")
    yield out


@pytest.mark.thorough
def test_resuming_by_another_script_is_refused(interrupted: Path) -> None:
    kept = interrupted / "script.py"
    text = kept.read_text(encoding="utf-8")
    assert text == OWN.read_text(encoding="utf-8")
    kept.write_text(text.replace("a short ", "a changed "), encoding="utf-8")
    changed = rig("resume", interrupted)
    kept.unlink()
    missing = rig("resume", interrupted)
    kept.write_text(text, encoding="utf-8")
    for refused in (changed, missing):
        assert refused.returncode == 2 and "rig: another_script: " in refused.stderr, refused.stderr


@pytest.mark.proof
@pytest.mark.thorough
def test_an_interrupted_script_of_ones_own_is_resumed_by_itself(interrupted: Path) -> None:
    used = interrupted / "config.yaml"
    faster = merge(yaml.safe_load(used.read_text(encoding="utf-8")), {"world": {"time_scale": 12}})
    used.write_text(yaml.safe_dump(faster, sort_keys=False), encoding="utf-8")
    resumed = rig("resume", interrupted)
    assert resumed.returncode == 0, resumed.stderr
    assert "resuming: 2 of 6 sweeps" in resumed.stderr and "done: a short rest" in resumed.stderr
    result = json.loads((interrupted / "result.json").read_text(encoding="utf-8"))
    observations = result["gyroscopes"]["gyro"]["observations"]
    assert [o["joint"] for o in observations] == [f"wrist_{joint}" for joint in (1, 1, 3, 3, 2, 2)]
    speeds = [o["speed_rad_s"] for o in observations]
    assert speeds == pytest.approx([radians(speed) for speed in (150, 150, 150, 150, 100, 100)], rel=1e-3)
    assert result["provenance"]["script"] == "mine.py"
    assert result["provenance"]["script_sha256"] == hashlib.sha256(OWN.read_bytes()).hexdigest()
    solved = rig_here("solve", interrupted, "--json")
    assert find_differences(interrupted, solved.stdout) == [], solved.stderr
    (interrupted / "script.py").write_text("PROCEDURE = None", encoding="utf-8")
    assert "rig: another_script: " in rig_here("solve", interrupted).stderr, "it is judged as it was, or not at all"


@pytest.mark.thorough
def test_it_runs_as_a_script_too_and_is_planned(tmp_path: Path) -> None:
    config = own_configuration(tmp_path)
    planned = rig_here("plan", config, "--script", OWN, "--json")
    sweeps = [step for step in json.loads(planned.stdout)["steps"] if step["kind"] == "sweep"]
    assert [sweep["joint_name"] for sweep in sweeps] == [f"wrist_{joint}" for joint in (1, 1, 3, 3, 2, 2)]
    assert sweeps[-1]["speed_rad_s"] == pytest.approx(radians(100))
    done = python(OWN, config, "--set", "world.time_scale=12", "--out", tmp_path / "run")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run" / "script.py").read_text(encoding="utf-8") == OWN.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("text", "name"),
    [("import nothing_of_that_name", "script_failed"), ("x = 1", "not_a_script"), (None, "no_script")],
)
def test_a_file_that_is_no_script_is_refused(tmp_path: Path, text: str | None, name: str) -> None:
    script = tmp_path / "script.py"
    if text is not None:
        script.write_text(text, encoding="utf-8")
    refused = rig_here("plan", configuration(tmp_path), "--script", script)
    assert refused.returncode == 2 and f"rig: {name}: " in refused.stderr, refused.stderr


def test_keys_of_another_procedure_are_unknown_to_a_script_of_ones_own(tmp_path: Path) -> None:
    refused = rig_here("plan", configuration(tmp_path), "--script", OWN)
    assert refused.returncode == 2 and "procedure.rest_s" in refused.stderr and "wrist_2_deg_s" in refused.stderr
