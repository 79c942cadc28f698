"""On a system without Linux' modules, what needs no arm works, and the rest is refused by name."""

import sys
from pathlib import Path

import pytest

from rig.commands.laboratory.only_on_linux import refuse_unless_linux
from rig.errors import Refused
from support.paths import ROOT
from support.processes.other_systems import run_without_linux_modules


@pytest.mark.slow
def test_what_needs_no_arm_works_without_the_modules_of_linux(tmp_path: Path) -> None:
    assert run_without_linux_modules(sys.executable, tmp_path, [ROOT]).startswith(str(ROOT))


@pytest.mark.parametrize(("system", "called"), [("win32", "Windows"), ("darwin", "macOS"), ("freebsd14", "freebsd14")])
def test_an_arm_and_a_simulated_laboratory_are_refused_by_name_elsewhere(system: str, called: str) -> None:
    with pytest.raises(Refused, match=f"the simulated laboratory runs on Linux, and this is {called}") as refused:
        refuse_unless_linux("the simulated laboratory", system)
    assert refused.value.name == "only_on_linux"
    refuse_unless_linux("the simulated laboratory", "linux")
