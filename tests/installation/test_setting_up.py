"""What `make` does on a machine that lacks something: it installs it, brings it, or says what to do."""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.paths import ROOT
from support.processes.waiting import PATIENCE_S

TOOLS = (
    "bash",
    "env",
    "dirname",
    "grep",
    "cat",
    "nproc",
    "uname",
    "ldd",
)  # of every machine; a compiler is none of them
NOBODY = 65534
SYSCONFIG = "# system configuration generated and used by the sysconfig module\nbuild_time_vars = {}\n"


@pytest.fixture
def checkout() -> Iterator[Path]:
    """The scripts of the checkout, where they may write and anybody may read, and a PATH of nearly nothing in `bin`."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        place.chmod(0o755)
        shutil.copytree(ROOT / "requirements", place / "requirements")
        (place / "bin").mkdir()
        for tool in TOOLS:
            if found := shutil.which(tool):
                (place / "bin" / tool).symlink_to(found)
        yield place


def program(checkout: Path, name: str, text: str) -> None:
    path = checkout / "bin" / name
    path.write_text(f"#!/bin/bash\n{text}\n", encoding="utf-8")
    path.chmod(0o755)


def newer_python(checkout: Path) -> None:
    """A Python for which the arm's client has no wheels."""
    told = 'case "${2:-}" in *"((3, 11), (3, 12))"*) exit 1;; *"(3, 13)"*) exit 0;; esac'
    program(checkout, "python3", f'{told}\nexec {sys.executable} "$@"')


def run(checkout: Path, script: str, *arguments: str, **more: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [checkout / "requirements" / script, *arguments],
        env={"PATH": str(checkout / "bin"), "HOME": str(checkout), **more},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )


def test_what_is_missing_elsewhere_than_on_debian_is_named(checkout: Path) -> None:
    ended = run(checkout, "system.sh", "test")
    assert ended.returncode == 2 and "make: this machine lacks, by Debian's names: git gcc " in ended.stderr


@pytest.mark.skipif(os.geteuid() != 0, reason="only root becomes somebody else")
def test_who_may_not_install_is_told_the_command(checkout: Path) -> None:
    program(checkout, "apt-get", "exit 1")
    ended = subprocess.run(
        [checkout / "requirements" / "system.sh", "test"],
        env={"PATH": str(checkout / "bin")},
        user=NOBODY,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert ended.returncode == 2
    assert "As root: apt-get update && apt-get install -y --no-install-recommends git gcc " in ended.stderr


def test_root_installs_what_is_missing_and_says_what(checkout: Path) -> None:
    program(checkout, "apt-get", f'echo "$@" >> {checkout}/asked')
    program(checkout, "sudo", 'exec "$@"')
    ended = run(checkout, "system.sh", "test")
    assert ended.returncode == 0 and "make: installing git gcc " in ended.stderr
    updated, installed = (checkout / "asked").read_text(encoding="utf-8").splitlines()
    assert updated == "update -qq" and " gcc-arm-none-eabi " in installed


@pytest.mark.thorough
@pytest.mark.slow
def test_a_newer_python_gets_an_older_one_beside_it_from_a_mirror(checkout: Path) -> None:
    newer_python(checkout)
    (checkout / "bin" / "uv").symlink_to(Path(sysconfig.get_path("scripts")) / "uv")
    brought = checkout / "python"
    (brought / "bin").mkdir(parents=True)
    (brought / "lib" / "python3.12").mkdir(parents=True)
    (brought / "lib" / "python3.12" / "_sysconfigdata__linux_x86_64-linux-gnu.py").write_text(SYSCONFIG)
    (brought / "bin" / "python3.12").write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n', encoding="utf-8")
    (brought / "bin" / "python3.12").chmod(0o755)
    (brought / "bin" / "python").symlink_to("python3.12")
    with tarfile.open(checkout / "python.tar.gz", "w:gz") as archive:
        archive.add(brought, "python")
    machine = os.uname().machine
    offered = {
        "name": "cpython",
        "arch": {"family": machine, "variant": None},
        "os": "linux",
        "libc": "gnu",
        "major": 3,
        "minor": 12,
        "patch": 99,
        "prerelease": "",
        "url": (checkout / "python.tar.gz").as_uri(),
        "sha256": None,
        "variant": None,
        "build": None,
    }
    (checkout / "offers.json").write_text(json.dumps({f"cpython-3.12.99-linux-{machine}-gnu": offered}))
    ended = run(checkout, "environment.sh", "venv", UV_PYTHON_DOWNLOADS_JSON_URL=(checkout / "offers.json").as_uri())
    assert ended.returncode == 0, ended.stderr
    assert "bringing Python 3.12 into build/python" in ended.stderr
    assert (checkout / "venv" / "bin" / "python").exists()


@pytest.mark.slow
def test_where_neither_a_python_nor_a_compiler_is_to_be_had_one_command_is_named(checkout: Path) -> None:
    newer_python(checkout)
    (checkout / "bin" / "uv").symlink_to(Path(sysconfig.get_path("scripts")) / "uv")
    nowhere = (checkout / "none.json").as_uri()
    ended = run(checkout, "environment.sh", "venv", UV_PYTHON_DOWNLOADS_JSON_URL=nowhere)
    assert ended.returncode == 2 and not (checkout / "venv").exists()
    assert "make: neither is to be had. Install Python 3.12, for instance by: uv python install 3.12" in ended.stderr


def test_what_is_built_is_the_client_that_the_program_asks_for() -> None:
    asked = next(line for line in (ROOT / "pyproject.toml").read_text().splitlines() if '"ur-rtde==' in line)
    built = (ROOT / "requirements" / "client.txt").read_text(encoding="utf-8")
    version = asked.split("==")[1].split(";")[0]
    assert f"ur-rtde=={version} " in built
    assert built.split("--hash=")[1].strip() in (ROOT / "requirements" / "demo.txt").read_text(encoding="utf-8")
