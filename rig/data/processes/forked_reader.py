"""A reading process forked from this one, which saves the tenth of a second that loading modules takes.

Only a process of one thread is forked, because a lock of another thread would stay locked in the child for ever.
"""

import os
import select
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import BinaryIO, NoReturn

HDF5_PLUGINS = {"HDF5_PLUGIN_PRELOAD": "::"}  # no plugins: a foreign file must load none


def can_fork() -> bool:
    """Return whether a reading process may be forked from this one.

    A forked process inherits HDF5 with the plugins that were named when it was loaded, and a foreign file must use none
    of them. So nothing but `load_hdf5` may have loaded HDF5 in this process.
    """
    if sys.platform != "linux" or not hasattr(os, "pidfd_open") or ("h5py" in sys.modules and not load_hdf5()):
        return False
    return len(list(Path("/proc/self/task").iterdir())) == 1


@cache
def load_hdf5() -> bool:
    """Load HDF5 without plugins, for all reading processes that a program forks when it reads many files.

    Return False if it was already loaded, with the plugins that the environment names.
    """
    if "h5py" in sys.modules:
        return False
    os.environ.update(HDF5_PLUGINS)
    import_module("h5py")
    return True


def measure_address_space() -> int:
    """Return the size of this process' address space, which a forked process also has."""
    return int(Path("/proc/self/statm").read_text("ascii").split()[0]) * os.sysconf("SC_PAGE_SIZE")


class ForkedReader:
    """A forked process that calls `read` and ends, with the attributes of `subprocess.Popen` that its owner needs.

    Its output goes to the files `out` and `stderr`; no other file of this process remains open in it.
    """

    def __init__(
        self, read: Callable[[], NoReturn], out: BinaryIO, stderr: BinaryIO, environment: Mapping[str, str]
    ) -> None:
        self.returncode: int | None = None
        self.stderr = stderr
        self.pid = os.fork()
        if self.pid == 0:
            _run_forked(read, out.fileno(), self.stderr.fileno(), environment)
        self._ended = os.pidfd_open(self.pid)

    def communicate(self, timeout: float) -> tuple[None, bytes]:
        """Return None and the process' stderr, as `Popen` does, once it has ended. Raise subprocess.TimeoutExpired."""
        self.wait(timeout)
        self.stderr.seek(0)
        return None, self.stderr.read()

    def wait(self, timeout: float) -> int:
        """Return the exit status, once the process has ended. Raise subprocess.TimeoutExpired."""
        if self.returncode is None:
            if not select.select([self._ended], [], [], timeout)[0]:
                raise subprocess.TimeoutExpired("a forked reader", timeout)
            self.returncode = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
            os.close(self._ended)
        return self.returncode

    def kill(self) -> None:
        """End the process, if it has not ended."""
        if self.returncode is None:
            os.kill(self.pid, signal.SIGKILL)


def _run_forked(read: Callable[[], NoReturn], out: int, complaints: int, environment: Mapping[str, str]) -> NoReturn:
    """Redirect stdout, stderr (`complaints`) and signals of a forked process; then call `read`, which ends it."""
    try:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(out, 1)
        os.dup2(complaints, 2)
        os.closerange(3, os.sysconf("SC_OPEN_MAX"))
        for number in (signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        os.environ.update(environment)
        tempfile.tempdir = None  # which it has looked up in the other environment
        sys.path[:] = filter(None, sys.path)  # not from the working folder, where any file could pass for a module
        read()
    finally:
        os._exit(1)
