"""What is missing is installed by the command that the program prints, however the program itself was installed."""

import json
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from rig.cli import main
from support.paths import ROOT
from support.processes.waiting import PATIENCE_S

SHOWN = "from firmware_host.installation import install_command; print(install_command('study'))"


def printed(folder: Path, said: dict[str, Any] | None, program: Path = ROOT) -> list[str]:
    """The words of the command, of a program whose installer has `said` from where it came."""
    info = folder / "calibration_rig-9.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: calibration-rig\nVersion: 9\n", encoding="utf-8")
    if said is not None:
        (info / "direct_url.json").write_text(json.dumps(said), encoding="utf-8")
    path = os.pathsep.join([str(folder), str(program)])
    command = [sys.executable, "-c", SHOWN]
    done = subprocess.run(
        command,
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=True,
        env={**os.environ, "PYTHONPATH": path},
    )
    return shlex.split(done.stdout)


@pytest.mark.slow
def test_a_folder_of_sources_stays_the_folder_it_runs_from(tmp_path: Path) -> None:
    sources = tmp_path / "my rig"
    sources.mkdir()
    command = printed(tmp_path, {"url": sources.as_uri(), "dir_info": {"editable": True}})
    assert command == [sys.executable, "-m", "pip", "install", "-e", f"{sources}[study]"]


@pytest.mark.slow
def test_a_wheel_is_installed_once_more_with_the_extra(tmp_path: Path) -> None:
    wheel = tmp_path / "calibration_rig-9-py3-none-any.whl"
    wheel.touch()
    command = printed(tmp_path, {"url": wheel.as_uri(), "archive_info": {}})
    assert command == [sys.executable, "-m", "pip", "install", f"{wheel}[study]"]


@pytest.mark.slow
def test_what_came_from_an_index_comes_from_there_again(tmp_path: Path) -> None:
    assert printed(tmp_path, None)[3:] == ["install", "calibration-rig[study]"]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "library"), [("parquet", "pyarrow"), ("ros2", "rosbags")])
def test_an_export_without_its_extra_names_the_command_and_leaves_no_folder(
    name: str, library: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, library, None)  # as if it were not installed
    assert main(["export", str(tmp_path), "--format", name]) == 2
    told = capsys.readouterr().err
    assert "missing_extra" in told and f"{sys.executable} -m pip install" in told and f"[{name}]" in told
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_wheel_in_site_packages_is_no_folder_of_sources(tmp_path: Path) -> None:
    wheel = tmp_path / "calibration_rig-9-py3-none-any.whl"
    wheel.touch()
    packages = tmp_path / "site-packages"
    shutil.copytree(ROOT / "firmware_host", packages / "firmware_host", ignore=shutil.ignore_patterns("firmware"))
    assert printed(packages, {"url": wheel.as_uri(), "archive_info": {}}, packages)[3:] == [
        "install",
        f"{wheel}[study]",
    ]
