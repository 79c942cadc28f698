"""The simulated laboratory as a command starts it: when it does not come up, the command says why."""

import os
import sys
from pathlib import Path

import pytest

from rig.commands.laboratory.laboratory_process import run_simulated_laboratory
from rig.errors import Refused
from support.laboratories.commands import rig
from support.laboratories.worlds import World
from support.paths import DEMO

pytestmark = pytest.mark.slow


@pytest.mark.thorough
def test_a_laboratory_whose_port_is_taken_is_refused_by_the_worlds_own_words_and_a_command_moves_its_own(
    world: World,
) -> None:
    running = world()
    with (
        pytest.raises(Refused, match=f"port_in_use: .*cannot listen on {running.host}:29999"),
        run_simulated_laboratory(running.config_path.read_text(encoding="utf-8")),
    ):
        pass
    done = rig("check", running.config_path)
    assert done.returncode == 0 and done.stdout.endswith("ready\n"), done
    assert f"another one is at {running.host}, so this one is at 127.0." in done.stderr
    assert running.host not in done.stdout


def test_a_laboratory_that_breaks_before_it_is_ready_says_how_it_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An emulator's engine that cannot be loaded."""
    (tmp_path / "unicorn.py").write_text("raise SystemExit(7)\n")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))
    with (
        pytest.raises(Refused, match=r"world_not_ready: .* ended with status 7"),
        run_simulated_laboratory(DEMO.read_text(encoding="utf-8")),
    ):
        pass
