"""A command that shows a page, in a process of its own as an operator starts it."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from support.processes.waiting import wait_for
from support.processes.warm import start_module

TOLD = "page: "


@contextmanager
def start_with_page(log: Path, *words: str | Path) -> Iterator[tuple["subprocess.Popen[bytes]", str]]:
    """`rig …` without a terminal, and the address that it tells; all it says goes into the file `told`."""
    with (
        log.open("wb") as file,
        start_module(*words, stdin=subprocess.DEVNULL, stdout=file, stderr=file) as process,
    ):
        try:
            yield process, wait_for(lambda: _address(log), "its page")
        finally:
            process.kill()


def _address(log: Path) -> str:
    """What stands behind the first `TOLD`; empty where nothing is told yet."""
    lines = [line for line in log.read_text(encoding="utf-8").splitlines(keepends=True) if line.startswith(TOLD)]
    return lines[0].removeprefix(TOLD).strip() if lines and lines[0].endswith("\n") else ""
