"""The command line as a user types it, on fast simulated laboratories of their own."""

import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import yaml

from rig.cli import main
from rig.config.load import load
from support.laboratories.worlds import fresh_host, merge
from support.paths import CONFIGS
from support.processes.waiting import PATIENCE_S, wait_for
from support.processes.warm import start_module

CI = CONFIGS / "ci.yaml"


def rig(
    *arguments: str | Path, timeout_s: float = PATIENCE_S, stdin: int = subprocess.DEVNULL
) -> subprocess.CompletedProcess[str]:
    """Run `rig …` to its end."""
    with start_module(*arguments, stdin=stdin, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            output, errors = process.communicate(timeout=timeout_s)
        finally:
            process.kill()
    return subprocess.CompletedProcess([*map(str, arguments)], process.returncode, output, errors)


def python(*arguments: str | Path, timeout_s: float = PATIENCE_S) -> subprocess.CompletedProcess[str]:
    """Run `python …` to its end."""
    command = [sys.executable, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False)


def rig_here(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run `rig …` in this process, which saves a second: for commands that only read and compute."""
    output, errors = StringIO(), StringIO()
    words = [*map(str, arguments)]
    with redirect_stdout(output), redirect_stderr(errors):
        status = main(words)
    return subprocess.CompletedProcess(words, status, output.getvalue(), errors.getvalue())


def configuration(folder: Path, changes: dict[str, Any] | None = None, procedure: dict[str, Any] | None = None) -> Path:
    """Write ci.yaml with an address of its own and with changes, or with another `procedure`."""
    host = fresh_host()
    address = {"arm": {"host": host}, "board": {"port": f"socket://{host}:7321"}}
    document = merge(merge(yaml.safe_load(load(CI).text), address), changes or {})
    if procedure is not None:
        document["procedure"] = procedure
    path = folder / "config.yaml"
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


def wait_for_log(folder: Path, words: str, times: int = 1) -> None:
    """Wait until the run's log contains these words `times` times."""
    log = folder / "log.txt"

    def has_appeared() -> bool:
        return log.exists() and log.read_text(encoding="utf-8").count(words) >= times

    wait_for(has_appeared, f"{words!r} in {log}")
