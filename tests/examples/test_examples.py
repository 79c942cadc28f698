"""Every file in examples/ runs, and shows what it says."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from support.laboratories.commands import configuration, python
from support.paths import CONFIGS, RECORDINGS, ROOT
from support.processes.waiting import PATIENCE_S

EXAMPLES = ROOT / "examples"
pytestmark = pytest.mark.slow


def recorded(folder: Path) -> Path:
    """Return a copy of a frozen recording."""
    return Path(shutil.copytree(RECORDINGS / "six_observation", folder / "run"))


def test_every_example_is_run_here() -> None:
    run_here = {"laboratory", "own_check", "own_export", "solve_and_apply", "turner"}
    assert {file.stem for file in EXAMPLES.glob("*.py")} == run_here


@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("name", "shows"), [("solve_and_apply", "gyro: at the end"), ("own_export", "calibration.toml")]
)
def test_a_recorded_run_is_enough(name: str, shows: str, tmp_path: Path) -> None:
    done = python(EXAMPLES / f"{name}.py", recorded(tmp_path))
    assert done.returncode == 0 and shows in done.stdout, done.stderr


@pytest.mark.thorough
@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("name", "arguments", "shows"),
    [("own_check", ("--out", "RUN"), "gyro.warming"), ("laboratory", ("RUN",), "gyro.scale_std")],
)
def test_a_simulated_run_passes(name: str, arguments: tuple[str, ...], shows: str, tmp_path: Path) -> None:
    run = tmp_path / "run"
    words = [str(run) if argument == "RUN" else argument for argument in arguments]
    done = python(EXAMPLES / f"{name}.py", configuration(tmp_path), *words, "--yes")
    assert done.returncode == 0, done.stderr
    assert shows in (run / "result.json").read_text(encoding="utf-8") and (run / "certificate.html").is_file()


def test_a_package_brings_the_turner(tmp_path: Path) -> None:
    package = tmp_path / "turner-1.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: turner\nVersion: 1\n", encoding="utf-8")
    entry = "[rig.turners]\nturntable_by_hand = turner:TURNTABLE_BY_HAND\n"
    (package / "entry_points.txt").write_text(entry, encoding="utf-8")
    document = yaml.safe_load((CONFIGS / "by_hand.yaml").read_text(encoding="utf-8"))
    document["turner"] = {"kind": "turntable_by_hand", "bearing": "A7"}
    config = tmp_path / "config.yaml"
    config.write_text(yaml.safe_dump(document), encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), str(EXAMPLES), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-m", "rig", "plan", str(config)],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
        cwd=ROOT,
    )
    assert done.returncode == 0 and "turn" in done.stdout, done.stderr
