"""Processes of `python -m rig …` without the imports, which take longer than most of them run.

They are forked from one process that has imported all they need, and so are the laboratories that they start; readers
of run files are forked from another. They differ from processes started by the system only in command line and parent,
as shown by /proc. Tests of a process' imports, start time and memory, and of Python's own variables start it by the
system, and so does all of `make proof`.
"""

import atexit
import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import Any

from rig.data.processes.reading_process import ENVIRONMENT
from support.processes.nursery import READER, Forked, fork_modules

NURSERY = Path(__file__).with_name("nursery.py")


class _Nursery:
    """The processes from which all others are forked. They start with the first use, and end with this process.

    `addresses`: where orders are sent. Several test processes share those of the process that started them, because
    importing everything takes seconds.
    """

    def __init__(self) -> None:
        self.addresses: dict[str, str] | None = None
        self._starting = Lock()
        self.closed = False  # nothing is forked: all are processes that the system starts

    def address(self, module: str) -> str:
        """Return the address that takes orders for processes of that module; modules of tests share one."""
        with self._starting:
            if self.addresses is None:
                self.addresses = self.begin()
        return self.addresses.get(module, self.addresses["rig"])

    def begin(self) -> dict[str, str]:
        """Start the processes; return their addresses."""
        command = [sys.executable, str(NURSERY), json.dumps(ENVIRONMENT)]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert process.stdin is not None and process.stdout is not None
        pipes = (process.stdin, process.stdout)

        def end() -> None:
            for pipe in pipes:
                pipe.close()
            process.kill()  # it has nothing to save, and a parallel test run does not wait long
            process.wait()

        atexit.register(end)
        addresses: dict[str, str] = json.loads(process.stdout.readline())
        return addresses


nursery = _Nursery()


def readers_forked() -> None:
    """Fork the readers of run files for this process too."""
    fork_modules((READER,), nursery.address)


@contextmanager
def readers_of_system() -> Iterator[None]:
    """Start the readers by the system during the block."""
    forking = vars(subprocess.Popen).get("__new__")
    if forking is None:  # as in `make proof`: once assigned, the inherited one would refuse its arguments
        yield
        return
    subprocess.Popen.__new__ = lambda kind, *_, **__: object.__new__(kind)  # pyrefly: ignore[bad-assignment, method-assign]  # of CPython itself
    try:
        yield
    finally:
        subprocess.Popen.__new__ = forking  # pyrefly: ignore[method-assign]  # of CPython itself


def start_module(*words: str | Path, module: str = "rig", **options: Any) -> "subprocess.Popen[Any]":
    """Start `python -m MODULE WORDS …`. `options`: those of Popen, except for actions before the program begins."""
    if nursery.closed:
        return start_by_system(*words, module=module, **options)
    return Forked(nursery.address(module), [module, *map(str, words)], safe_path=False, **options)


def start_by_system(*words: str | Path, module: str = "rig", **options: Any) -> "subprocess.Popen[Any]":
    """Start a module as `start_module` does, but always by the system."""
    return subprocess.Popen([sys.executable, "-m", module, *map(str, words)], **options)
