"""Links that somebody lays into a folder while a run or a command writes there: nothing is written through one."""

import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from firmware_host.emulator.chip.flash_memory import FlashMemory
from rig.world.board.flash_file import open_flash
from support.laboratories.commands import configuration, rig_here
from support.paths import RECORDINGS
from support.processes.waiting import PATIENCE_S, alive, wait_for
from support.processes.warm import start_module

WRITTEN = ("certificate.html", "calibration.h", "result.json")


def linked(link: Path) -> Path:
    """What `link` leads to from now on, which is not to be touched."""
    target = link.parent.parent / f"precious {link.name}"
    target.write_text("mine", encoding="utf-8")
    link.symlink_to(target)
    return target


def run_with(links: Sequence[str], tmp_path: Path) -> tuple[int, str, list[Path]]:
    """A run in whose folder the links lie as soon as it is there: exit status, stderr, and where they led."""
    out = tmp_path / "run"
    command = ("run", configuration(tmp_path), "--out", out, "--yes")
    with start_module(*command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        wait_for((out / "config.yaml").exists, "the run's folder", meanwhile=alive(process))
        targets = [linked(out / name) for name in links]
        errors = process.communicate(timeout=PATIENCE_S)[1]
    return process.returncode, errors, targets


@pytest.mark.thorough
@pytest.mark.slow
def test_a_run_replaces_what_is_laid_where_it_writes(tmp_path: Path) -> None:
    links = [*WRITTEN, *(f"{name}.part" for name in (*WRITTEN, "run.h5"))]
    status, errors, targets = run_with(links, tmp_path)
    assert status == 0, errors
    assert {target.read_text(encoding="utf-8") for target in targets} == {"mine"}
    assert not any((tmp_path / "run" / name).is_symlink() for name in WRITTEN)


@pytest.mark.thorough
@pytest.mark.slow
def test_a_run_does_not_begin_where_its_client_would_write_through_a_link(tmp_path: Path) -> None:
    status, errors, (target,) = run_with(["arm_client.log"], tmp_path)
    assert status == 2 and "rig: not_written_through: " in errors and target.read_text(encoding="utf-8") == "mine"


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return Path(shutil.copytree(RECORDINGS / "six_observation", tmp_path / "run"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("certificate.html.part", ["report", "RUN"]),
        ("gyro.csv", ["export", "RUN", "--format", "csv", "--out", "RUN"]),
        ("gyro.csv.part", ["export", "RUN", "--format", "csv", "--out", "RUN"]),
        ("allan_gyro.png", ["allan", "RUN", "--plot", "RUN"]),
        ("allan_gyro.svg.part", ["allan", "RUN", "--plot", "RUN"]),
        ("convergence.csv", ["study", "convergence", "--runs", "10", "--out", "RUN"]),
    ],
)
def test_a_command_writes_through_no_link(run: Path, name: str, command: Sequence[str]) -> None:
    target = linked(run / name)
    done = rig_here(*(str(run) if word == "RUN" else word for word in command))
    assert target.read_text(encoding="utf-8") == "mine"
    assert done.returncode == 0 or "rig: not_written_through: " in done.stderr, done.stderr


@pytest.mark.slow
def test_a_run_folder_may_be_named_by_a_link_of_one_s_own(run: Path) -> None:
    (run.parent / "latest").symlink_to(run)
    assert rig_here("report", run.parent / "latest").returncode == 0
    assert rig_here("export", run.parent / "latest", "--format", "csv", "--out", run.parent / "latest").returncode == 0


@pytest.mark.parametrize("beside", ["flash.bin.new", "flash.bin.part"])
def test_a_simulated_board_s_flash_is_kept_without_following_a_link(tmp_path: Path, beside: str) -> None:
    (tmp_path / "bench").mkdir()
    target = linked(tmp_path / "bench" / beside)
    memory: FlashMemory = open_flash(tmp_path / "bench" / "flash.bin")
    changed: Callable[[], None] = memory.on_change
    changed()
    assert target.read_text(encoding="utf-8") == "mine" and (tmp_path / "bench" / "flash.bin").stat().st_size >= 262_144
