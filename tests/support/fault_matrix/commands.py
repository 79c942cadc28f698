"""The command `rig`: started anew, or by a process that has imported already what half of a short run is spent on."""

import multiprocessing
import os
import runpy
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from threading import Lock
from typing import Protocol

from support.paths import ROOT

NEEDED = [
    "rig.commands.carry_out",
    "rig.analysis.judging",
    "rig.history.finished",
    "rig.history.series",
    "rig.history.store",
    "rig.report.certificate.writer",
    "rig.report.writers",
    "scipy.interpolate",
    "scipy.optimize",
    "matplotlib.pyplot",
]


class Command(Protocol):
    """A command that has been started, in a session of its own as a terminal would start it."""

    @property
    def pid(self) -> int: ...
    @property
    def status(self) -> int | None:
        """None while it runs; minus the number of the signal that ended it."""


Start = Callable[[Sequence[str], Path, Mapping[str, str]], Command]  # its arguments, where stderr goes, its environment


class _Anew:
    def __init__(self, process: "subprocess.Popen[bytes]") -> None:
        self._process = process
        self.pid = process.pid

    @property
    def status(self) -> int | None:
        return self._process.poll()


class _Forked:
    _asking = Lock()  # who asks second reads nothing, and takes that for a status

    def __init__(self, process: ForkServerProcess) -> None:
        self._process = process
        with self._asking:
            process.start()
        assert process.pid is not None
        self.pid = process.pid

    @property
    def status(self) -> int | None:
        with self._asking:
            return self._process.exitcode


def anew(arguments: Sequence[str], errors: Path, environment: Mapping[str, str]) -> Command:
    """By a new interpreter, as a user would."""
    with errors.open("wb") as file:
        return _Anew(
            subprocess.Popen(
                [sys.executable, "-m", "rig", *arguments],
                cwd=ROOT,
                env={**os.environ, **environment},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=file,
                start_new_session=True,
            )
        )


def forking() -> Start:
    """By a process that has imported what is needed; a command with an environment of its own is started anew."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["__main__", *NEEDED])

    def start(arguments: Sequence[str], errors: Path, environment: Mapping[str, str]) -> Command:
        if environment:
            return anew(arguments, errors, environment)
        return _Forked(context.Process(target=_carry_out, args=(tuple(arguments), errors)))

    return start


def _carry_out(arguments: Sequence[str], errors: Path) -> None:
    """What `python -m rig` does."""
    os.setsid()
    os.chdir(ROOT)
    for descriptor, path, flags in ((0, os.devnull, os.O_RDONLY), (1, os.devnull, os.O_WRONLY)):
        os.dup2(os.open(path, flags), descriptor)
    os.dup2(os.open(errors, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644), 2)
    sys.argv = ["rig", *arguments]
    runpy.run_module("rig", run_name="__main__", alter_sys=True)
