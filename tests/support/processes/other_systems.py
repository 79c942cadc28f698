"""Commands without an arm, run by an interpreter without the modules that only Linux has, and without optional ones."""

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from support.external.handled_body import TWELVE, handle, write
from support.paths import CONFIGS, RECORDINGS
from support.processes.waiting import PATIENCE_S

HIDDEN = """
import os, signal, sys
for name in ("fcntl", "grp", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty"):
    sys.modules[name] = None
for name in ("cryptography", "lxml", "matplotlib", "pandas", "psycopg", "pyhanko", "segno", "signxml", "unicorn"):
    sys.modules[name] = None
del os.getloadavg, os.pidfd_open, os.O_NOFOLLOW, os.O_NONBLOCK, os.setsid
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
    ["demo"],
    ["run", f"{folder}/configs/by_hand_lines.yaml"],
):
    statuses[" ".join(words[:2])] = main(words)
result = rig.solve(rig.load(frozen))
assert result["gyro"].scale.shape == (3,) and "gyro" in result._repr_html_()
assert sys.modules["fcntl"] is None
print(rig.__file__)
print(*statuses.values(), file=sys.stderr)
"""


def run_without_linux_modules(interpreter: str | Path, folder: Path, paths: Sequence[Path] = ()) -> str:
    """Solve, show, verify and enter in the new `folder`; assert that all succeeds, and return the file of `rig`.

    A simulated laboratory is refused by name, and leaves no files. `paths`: search paths for packages that the
    interpreter lacks.
    """
    (folder / "sitecustomize.py").write_text(HIDDEN, encoding="utf-8")
    (folder / "configs").mkdir()
    shutil.copy(CONFIGS / "by_hand_lines.yaml", folder / "configs")
    by_hand = write(folder / "samples.csv", handle(TWELVE, 1))
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(map(str, (folder, *paths))),
        "RIG_HISTORY": str(folder / "history.sqlite"),
    }
    words = [interpreter, "-c", COMMANDS, RECORDINGS / "six_observation", by_hand, folder]
    done = subprocess.run(
        [*map(str, words)],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
        env=environment,
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines()[-1] == "0 0 0 0 0 0 0 2 2", done.stdout + done.stderr
    refusals = [line for line in done.stderr.splitlines() if line.startswith("rig: ")]
    assert [line.split(":")[1] for line in refusals] == [" only_on_linux"] * 2, refusals
    assert not (folder / "runs").exists()
    return done.stdout.splitlines()[-1]
