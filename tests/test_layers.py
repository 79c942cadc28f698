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
def test_the_house_keeps_its_contracts(copy: Path) -> None:
    found = lint(copy)
    assert found.returncode == 0, found.stdout


@pytest.mark.slow
def test_a_module_that_stands_on_no_layer_is_refused(copy: Path) -> None:
    (copy / "rig" / "memory.py").write_text('"""A room nobody gave a place to."""\n', encoding="utf-8")
    view = copy / "rig" / "world_view.py"
    view.write_text("from rig.world.laboratory import Laboratory\n\nTRUTH = Laboratory\n", encoding="utf-8")
    found = lint(copy)
    assert found.returncode == 1
    assert "rig.memory" in found.stdout and "rig.world_view" in found.stdout


@pytest.mark.slow
def test_nothing_but_the_world_imports_the_world(copy: Path) -> None:
    rooms = ["rig/data/memory.py", "rig/analysis/peeking.py", "rig/commands/look.py"]
    for room in rooms:
        (copy / room).write_text("from rig.world.laboratory import Laboratory\n\nTRUTH = Laboratory\n")
    found = lint(copy)
    assert found.returncode == 1
    for room in rooms:
        assert f"{module(room)} -> rig.world.laboratory" in found.stdout


@pytest.mark.slow
def test_nothing_but_the_world_imports_the_emulator(copy: Path) -> None:
    rooms = ["rig/notebook/peek.py", "rig/board/peek.py", "firmware_host/peek.py", "procedures/peek.py"]
    for room in rooms:
        (copy / room).write_text("from firmware_host.emulator.machine import EmulatedBoard\n\nBOARD = EmulatedBoard\n")
    found = lint(copy)
    assert found.returncode == 1
    assert "Only the world knows the emulator BROKEN" in found.stdout
    for room in rooms:
        assert f"{module(room)} -> firmware_host.emulator.machine" in found.stdout


@pytest.mark.slow
def test_a_room_does_not_import_from_the_rooms_after_it(copy: Path) -> None:
    (copy / "rig" / "observation" / "early.py").write_text(
        "from rig.analysis.verdict import Check\n\nEARLY = Check\n", encoding="utf-8"
    )
    found = lint(copy)
    assert found.returncode == 1
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
