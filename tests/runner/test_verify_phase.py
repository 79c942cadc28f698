"""Between the halves of a run nobody is asked again, unless the arm was moved meanwhile."""

import os
import pty
import socket
import subprocess
import sys
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest

from support.laboratories.worlds import QUICK_EXPERIMENT, World, hardware
from support.processes.waiting import PATIENCE_S

pytestmark = pytest.mark.slow
NUDGE = b"def nudge():\n movej([0.2, -1.57, 1.57, -1.57, -1.57, 0], a=20, v=3)\nend\n"


@pytest.mark.proof
@pytest.mark.thorough
def test_an_arm_that_was_moved_between_the_halves_goes_on_only_if_somebody_agrees(world: World, tmp_path: Path) -> None:
    handle = world(QUICK_EXPERIMENT)
    config, out = hardware(handle.config_path, tmp_path), tmp_path / "run"
    operator, terminal = pty.openpty()
    said = b""

    def read_until(words: bytes, times: int = 1) -> None:
        nonlocal said
        while said.count(words) < times:
            said += os.read(operator, 4096)

    command = [sys.executable, "-m", "rig", "run", str(config), "--out", str(out)]
    wide = {**os.environ, "COLUMNS": "250"}
    with (
        subprocess.Popen(command, stdin=terminal, stdout=subprocess.DEVNULL, stderr=terminal, env=wide) as process,
        ExitStack() as failed,
    ):
        failed.callback(process.kill)
        os.close(terminal)
        read_until(b"Type go to start")
        assert b"without another question, 6 sweeps verify it, for " in said
        os.write(operator, b"go\n")
        read_until(b"stored on the board: gyro")
        with socket.create_connection((handle.host, 30002)) as pendant:
            pendant.sendall(NUDGE)
            read_until(b"Type go to start", times=2)
        assert b"First it goes home: base -11" in said
        os.write(operator, b"no\n")
        with suppress(OSError):  # a terminal whose other end has closed
            while more := os.read(operator, 4096):
                said += more
        assert process.wait(PATIENCE_S) == 3
        failed.pop_all()
    os.close(operator)
    assert b"rig: not_confirmed: " in said and b"continue with: rig resume" in said, said
    state = handle.state()
    assert not state["moving"] and abs(state["q_rad"][0] - 0.2) < 1e-3
