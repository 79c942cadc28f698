"""On a system without Linux' modules, what needs no arm works, and the rest is refused by name."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from rig.commands.laboratory.only_on_linux import refuse_unless_linux
from rig.errors import Refused
from support.external.handled_body import TWELVE, handle, write
from support.paths import ROOT
from support.processes.waiting import PATIENCE_S

HIDDEN = """
import os, signal, sys
for name in ("fcntl", "grp", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty"):
    sys.modules[name] = None
del os.getloadavg, os.O_NOFOLLOW, os.O_NONBLOCK, os.setsid
for name in ("SIGHUP", "SIGQUIT", "SIGTSTP", "SIGUSR1", "SIGALRM", "SIGRTMIN", "pthread_kill", "setitimer"):
    delattr(signal, name)
"""
COMMANDS = """
import sys
import rig
from rig.cli import main
frozen, by_hand, folder = sys.argv[1:]
certificate = f"{folder}/certificate.html"
statuses = {}
for words in (
    ["solve", frozen],
    ["show", frozen, "--all"],
    ["solve", by_hand, "--turns", "--clock-ppm", "50"],
    ["history", "import", frozen],
    ["history"],
    ["report", frozen, "--out", folder],
    ["verify", certificate, "--history", f"{folder}/history.sqlite"],
):
    statuses[" ".join(words[:2])] = main(words)
assert rig.solve(rig.load(frozen))["gyro"].scale.shape == (3,)
print(*statuses.values(), file=sys.stderr)
"""


@pytest.mark.slow
def test_what_needs_no_arm_works_without_the_modules_of_linux(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(HIDDEN, encoding="utf-8")
    frozen = ROOT / "tests" / "fixtures" / "recordings" / "six_observation"
    by_hand = write(tmp_path / "samples.csv", handle(TWELVE, 1))
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)]),
        "RIG_HISTORY": str(tmp_path / "history.sqlite"),
    }
    words = [sys.executable, "-c", COMMANDS, *map(str, (frozen, by_hand, tmp_path))]
    done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines()[-1] == "0 0 0 0 0 0 0", done.stdout + done.stderr


@pytest.mark.parametrize(("system", "called"), [("win32", "Windows"), ("darwin", "macOS"), ("freebsd14", "freebsd14")])
def test_an_arm_and_a_simulated_laboratory_are_refused_by_name_elsewhere(system: str, called: str) -> None:
    with pytest.raises(Refused, match=f"the simulated laboratory runs on Linux, and this is {called}") as refused:
        refuse_unless_linux("the simulated laboratory", system)
    assert refused.value.name == "only_on_linux"
    refuse_unless_linux("the simulated laboratory", "linux")
