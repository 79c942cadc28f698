"""On a system without Linux' modules, what needs no arm works, and the rest is refused by name."""

import sys
from pathlib import Path

import pytest

from rig.commands.laboratory.only_on_linux import refuse_unless_linux
from rig.errors import Refused
from rig.sensors.errors import SensorError
from rig.sensors.own_port import open_device_port
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


def test_a_python_without_the_modules_that_open_a_port_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fcntl", None)
    with pytest.raises(Refused, match="the simulated laboratory runs on Linux, and this Python lacks fcntl") as refused:
        refuse_unless_linux("the simulated laboratory", "linux")
    assert refused.value.name == "only_on_linux"


def test_a_port_without_pyserial_is_no_port_and_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "serial"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(SensorError, match="/dev/ttyUSB0 does not open: pyserial cannot be loaded") as refused:
        open_device_port("/dev/ttyUSB0", 115200)
    assert refused.value.name == "no_port"
