"""A command with a page, started in a process of its own as by an operator."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from support.processes.waiting import alive, wait_for
from support.processes.warm import start_module

ADDRESS_PREFIX = "page: "


@contextmanager
def start_with_page(log: Path, *words: str | Path) -> Iterator[tuple["subprocess.Popen[bytes]", str]]:
    """Yield a process of `rig …` without a terminal, and the address of its page; its output goes to the file `log`."""
    with (
        log.open("wb") as file,
        start_module(*words, stdin=subprocess.DEVNULL, stdout=file, stderr=file) as process,
    ):
        try:
            yield process, wait_for(lambda: _address(log), "its page", meanwhile=alive(process))
        finally:
            process.kill()


def _address(log: Path) -> str:
    """Return the text behind the first `ADDRESS_PREFIX`; empty if there is none yet."""
    text = log.read_text(encoding="utf-8")
    lines = [line for line in text.splitlines(keepends=True) if line.startswith(ADDRESS_PREFIX)]
    return lines[0].removeprefix(ADDRESS_PREFIX).strip() if lines and lines[0].endswith("\n") else ""
