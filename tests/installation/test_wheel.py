"""Without a checkout: the sdist, the wheel made of it, and the demonstration that runs from the wheel."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

from support.paths import ROOT
from support.processes.other_systems import run_without_linux_modules
from support.processes.waiting import PATIENCE_S

pytestmark = pytest.mark.slow
NO_SOURCES = shutil.ignore_patterns(".*", "build", "dist", "runs", "*.egg-info", "__pycache__", "tests")


def python(*arguments: str | Path, cwd: Path) -> str:
    command = [sys.executable, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False, cwd=cwd)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def built(what: str, source: Path, into: Path) -> Path:
    """An sdist or a wheel, by the back end that pyproject.toml names."""
    program = f"from setuptools import build_meta; print(build_meta.build_{what}({str(into)!r}))"
    return into / python("-c", program, cwd=source).splitlines()[-1]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment that has the wheel, and of this one all the other packages."""
    folder = tmp_path_factory.mktemp("installed")
    shutil.copytree(ROOT, folder / "source", ignore=NO_SOURCES)
    sdist = built("sdist", folder / "source", folder)
    subprocess.run(["tar", "-xzf", sdist, "-C", folder], check=True, timeout=PATIENCE_S)
    wheel = built("wheel", folder / sdist.name.removesuffix(".tar.gz"), folder)
    home = folder / "home"
    venv.create(home, symlinks=True)
    interpreter = home / "bin" / "python"
    pip = ["-m", "pip", "--python", str(interpreter), "install", "--quiet", "--no-deps", "--no-index"]
    pip.append("--no-compile")  # what the demonstration does not import is not compiled
    python(*pip, wheel, cwd=folder)
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    others = home / "lib" / version / "site-packages" / "others.pth"
    others.write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    return home


def test_the_demonstration_runs_from_the_wheel_and_finds_the_truth(installed: Path, tmp_path: Path) -> None:
    where = [str(installed / "bin" / "python"), "-P", "-c", "import rig; print(rig.__file__)"]
    assert subprocess.run(where, capture_output=True, text=True, check=True).stdout.startswith(str(installed))
    rig = installed / "bin" / "rig"
    subprocess.run([rig, "demo", "--files", tmp_path], check=True, timeout=PATIENCE_S, capture_output=True)
    assert (tmp_path / "examples" / "solve_and_apply.py").exists()
    demo = [rig, "demo"]
    environment = {**os.environ, "RIG_HISTORY": str(tmp_path / "history.sqlite")}
    done = subprocess.run(
        demo, cwd=tmp_path, env=environment, timeout=PATIENCE_S, capture_output=True, text=True, check=False
    )
    assert done.stdout.splitlines()[-1:] == ["verdict: PASS"], done.stdout + done.stderr
    assert re.search("simulated truth: [4-6] of 6 values within U of it", done.stdout)
    (run,) = (tmp_path / "runs").iterdir()
    assert {file.name for file in run.iterdir()} >= {"certificate.html", "calibration.h", "result.json"}


@pytest.mark.thorough
def test_what_needs_no_arm_works_from_the_wheel_without_the_modules_of_linux(installed: Path, tmp_path: Path) -> None:
    assert run_without_linux_modules(installed / "bin" / "python", tmp_path).startswith(str(installed))
