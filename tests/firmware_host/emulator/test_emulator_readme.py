"""The emulator's README says what is so."""

import doctest

from firmware_host.parts import BOARD_PARTS
from support.paths import ROOT

EMULATOR = ROOT / "firmware_host" / "emulator"
README = EMULATOR / "README.md"


def test_the_readme_s_example_runs() -> None:
    result = doctest.testfile(str(README), module_relative=False, encoding="utf-8")
    assert result.failed == 0 < result.attempted


def test_the_readme_names_every_module() -> None:
    text = README.read_text(encoding="utf-8")
    parts = {f"{part.model.split(':')[0]}.py" for part in BOARD_PARTS.values()}  # one line tells of them all
    modules = {file.name for file in EMULATOR.rglob("*.py")} - {"__init__.py"} - parts
    assert {name for name in modules if f"`{name}`" not in text} == set()
