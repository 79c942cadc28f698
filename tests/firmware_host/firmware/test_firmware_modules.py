"""The core's modules stand one upon the other: none needs, by including or by calling, what needs it."""

import re
import subprocess
from collections import defaultdict
from collections.abc import Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

from support.paths import FIRMWARE

CORE = FIRMWARE / "core"
INCLUDES = [f"-I{folder}" for folder in (CORE, *CORE.glob("*/"))]
Needs = Mapping[str, set[str]]  # module, which is its .c and its .h → the modules it needs


def included(sources: list[Path]) -> Needs:
    """By #include. Headers of no module in the core (the compiler's own) are left out."""
    needs: dict[str, set[str]] = defaultdict(set)
    for source in sources:
        for header in re.findall(r'^#include "(\w+)\.h"', source.read_text(encoding="utf-8"), re.MULTILINE):
            needs[source.stem] |= {header} - {source.stem}
    return needs


def called(objects: list[Path]) -> Needs:
    """By symbols: what an object leaves undefined, another one defines. The port's are left out."""
    home: dict[str, str] = {}
    missing: dict[str, set[str]] = {}
    for file in objects:
        with file.open("rb") as opened:
            table = ELFFile(opened).get_section_by_name(".symtab")
            assert isinstance(table, SymbolTableSection)
            symbols = [symbol for symbol in table.iter_symbols() if symbol.entry["st_info"]["bind"] == "STB_GLOBAL"]
        defined = {symbol.name for symbol in symbols if symbol.entry["st_shndx"] != "SHN_UNDEF"}
        missing[file.stem] = {symbol.name for symbol in symbols} - defined
        home |= dict.fromkeys(defined, file.stem)
    return {module: {home[name] for name in names if name in home} for module, names in missing.items()}


def circle(needs: Needs) -> list[str]:
    """The modules of one circle, in its order; none when there is none."""
    try:
        TopologicalSorter(needs).prepare()
    except CycleError as error:
        found: list[str] = error.args[1]
        return found
    return []


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The core, compiled for this machine, one object for each source."""
    out = tmp_path_factory.mktemp("objects")
    sources = sorted(CORE.rglob("*.c"))
    subprocess.run(["gcc", "-std=gnu11", *INCLUDES, "-c", *map(str, sources)], cwd=out, check=True)
    return sorted(out.glob("*.o"))


def test_no_module_of_the_core_includes_what_includes_it() -> None:
    needs = included(sorted(CORE.rglob("*.[ch]")))
    assert {"setups", "link", "kept", "solver"} <= needs["calibrating"]
    assert circle(needs) == []


@pytest.mark.slow
def test_no_module_of_the_core_calls_what_calls_it(objects: list[Path]) -> None:
    needs = called(objects)
    assert {"setups", "calibrating", "stored", "acquisition"} <= needs["board"]
    assert circle(needs) == []


@pytest.mark.slow
def test_includes_and_calls_together_make_no_circle(objects: list[Path]) -> None:
    by_include, by_call = included(sorted(CORE.rglob("*.[ch]"))), called(objects)
    both = {module: by_include.get(module, set()) | by_call.get(module, set()) for module in {*by_include, *by_call}}
    assert circle(both) == []


def test_a_circle_is_found(tmp_path: Path) -> None:
    """As it was: board.c called calibrating.c, and that asked board.c what is configured."""
    sources = {
        "board": "void calibrating_reset(void);\nint board_check(void) { calibrating_reset(); return 0; }",
        "calibrating": "int board_check(void);\nvoid calibrating_reset(void) { board_check(); }",
    }
    for name, text in sources.items():
        (tmp_path / f"{name}.c").write_text(text)
    subprocess.run(["gcc", "-c", "board.c", "calibrating.c"], cwd=tmp_path, check=True)
    assert sorted(circle(called(sorted(tmp_path.glob("*.o"))))[1:]) == ["board", "calibrating"]
    (tmp_path / "board.c").write_text('#include "calibrating.h"')
    (tmp_path / "calibrating.c").write_text('#include "board.h"')
    assert sorted(circle(included(sorted(tmp_path.glob("*.c"))))[1:]) == ["board", "calibrating"]
