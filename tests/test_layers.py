"""The layers contract in pyproject.toml holds for what is there, and catches what does not belong."""

import ast
import graphlib
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from support.paths import ROOT
from support.processes.waiting import PATIENCE_S

MOST_FILES = 18  # side by side
LINT = [str(Path(sys.executable).with_name("lint-imports")), "--no-cache"]


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """The packages' sources and the contracts in a folder of their own."""
    for package in ("rig", "firmware_host", "procedures"):
        for source in (ROOT / package).rglob("*.py"):
            target = tmp_path / source.relative_to(ROOT)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, target)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        LINT,
        cwd=folder,
        env={"PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )


def module(room: str) -> str:
    return room.removesuffix(".py").replace("/", ".")


@pytest.mark.slow
def test_a_module_that_breaks_a_contract_is_named(copy: Path) -> None:
    """Each in a room of its own; that the house itself keeps its contracts is `make lint`."""
    laboratory = "from rig.world.laboratory import Laboratory\n\nTRUTH = Laboratory\n"
    of_the_world = ["rig/data/memory.py", "rig/analysis/peeking.py", "rig/commands/look.py"]
    emulator = "from firmware_host.emulator.machine import EmulatedBoard\n\nBOARD = EmulatedBoard\n"
    of_the_emulator = ["rig/notebook/peek.py", "rig/board/peek.py", "firmware_host/peek.py", "procedures/peek.py"]
    early = "from rig.analysis.verdict import Check\n\nEARLY = Check\n"
    broken = {
        **dict.fromkeys([*of_the_world, "rig/world_view.py"], laboratory),
        **dict.fromkeys(of_the_emulator, emulator),
        "rig/observation/early.py": early,
        "rig/memory.py": '"""A room nobody gave a place to."""\n',
    }
    for room, text in broken.items():
        (copy / room).write_text(text, encoding="utf-8")
    found = lint(copy)
    assert found.returncode == 1
    assert "rig.memory" in found.stdout and "rig.world_view" in found.stdout, "they stand on no layer"
    for room in of_the_world:
        assert f"{module(room)} -> rig.world.laboratory" in found.stdout
    assert "Only the world knows the emulator BROKEN" in found.stdout
    for room in of_the_emulator:
        assert f"{module(room)} -> firmware_host.emulator.machine" in found.stdout
    assert "rig.observation is not allowed to import rig.analysis" in found.stdout


def test_at_most_four_modules_lie_flat() -> None:
    flat = sorted(path.name for path in (ROOT / "rig").glob("*.py"))
    assert len(flat) <= 4, flat


def test_no_folder_holds_more_than_one_surveys() -> None:
    tops = ("rig", "firmware_host", "procedures", "tests", "benchmarks", "configs", "docs", "examples")
    folders = (folder for top in tops for folder in (ROOT / top, *(ROOT / top).rglob("*/")))
    files = {folder: sum(path.is_file() for path in folder.glob("*")) for folder in folders if folder.is_dir()}
    assert not [
        f"{folder.relative_to(ROOT)}: {count}"
        for folder, count in files.items()
        if count > MOST_FILES and folder.name != "__pycache__"
    ]


def imports_of(source: Path, known: set[str]) -> set[str]:
    """The modules among `known` that a file imports, wherever in it the import stands."""
    found = set()
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {f"{node.module}.{alias.name}" for alias in node.names} | {node.module}
    return found & known


@pytest.mark.slow
def test_no_imports_go_round_in_a_circle() -> None:
    """Not even those inside functions or for types alone; packages themselves hold only what they say of themselves."""
    sources = {
        ".".join(source.relative_to(ROOT).with_suffix("").parts): source
        for package in ("rig", "firmware_host", "procedures")
        for source in (ROOT / package).rglob("*.py")
        if source.name != "__init__.py"
    }
    graph = {name: imports_of(source, set(sources)) - {name} for name, source in sources.items()}
    tuple(graphlib.TopologicalSorter(graph).static_order())  # raises CycleError, which names the circle
