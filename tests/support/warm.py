"""Processes of `python -m rig …` that need not import everything anew, which takes longer than most of them run.

They are forked from one process that has imported what they need. Of those that the system starts they differ in this
alone that /proc shows another command line. Tests of what a process imports, of how soon it starts, of how much memory
it takes and of variables of Python's own start one by the system, and so does all of `make proof`.
"""

import atexit
import inspect
import json
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path
from threading import Lock
from typing import Any

NURSERY = Path(__file__).with_name("nursery.py")


class _Nursery:
    """The process that all are forked from; it is started when the first is wanted, and ends with this one."""

    def __init__(self) -> None:
        self._orders: socket.socket | None = None
        self._starting = Lock()
        self.closed = False  # nothing is forked: all are processes that the system starts

    def bear(self, order: dict[str, Any], streams: list[int]) -> tuple[int, socket.socket]:
        """A new process: its identity, and where its status is told (as of `os.waitpid`, 4 bytes) when it has ended."""
        with self._starting:
            if self._orders is None:
                self._orders = self._begun()
        kept, given = socket.socketpair()
        with given:
            socket.send_fds(self._orders, [json.dumps(order).encode()], [*streams, given.fileno()])
        return _number(kept), kept

    def _begun(self) -> socket.socket:
        kept, given = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with given:
            number = given.fileno()
            command = [sys.executable, str(NURSERY), str(number)]
            process = subprocess.Popen(command, pass_fds=[number], stdin=subprocess.DEVNULL)

        def end() -> None:
            kept.close()
            process.kill()  # it has nothing to put away, and whoever starts tests on many processes does not wait long
            process.wait()

        atexit.register(end)
        return kept


nursery = _Nursery()


def _number(told: socket.socket, flags: int = 0) -> int:
    number = told.recv(4, flags)
    assert number, "the process that all are forked from has ended"
    return int.from_bytes(number, "little")


class _Forked(subprocess.Popen[Any]):
    """As Popen, but for its birth and its end: it is no child of this process, so its status comes through a socket."""

    def _execute_child(self, *given: Any) -> None:
        of_popen = super()._execute_child  # type: ignore[misc]
        named = inspect.signature(of_popen).bind(*given).arguments
        module, *words = named["args"]
        order = {
            "module": module,
            "words": words,
            "environment": dict(os.environ if named["env"] is None else named["env"]),
            "folder": str(named["cwd"] or Path.cwd()),
            "new_session": named["start_new_session"],
            "ignored": [number for number in signal.valid_signals() if signal.getsignal(number) == signal.SIG_IGN],
        }
        ends = ("p2cread", "c2pwrite", "errwrite")
        inherited_or_given = [number if named[end] == -1 else named[end] for number, end in enumerate(ends)]
        self.pid, self._status = nursery.bear(order, inherited_or_given)
        self._child_created = True
        self._close_pipe_fds(  # type: ignore[attr-defined]
            *(named[end] for end in ("p2cread", "p2cwrite", "c2pread", "c2pwrite", "errread", "errwrite"))
        )

    def _internal_poll(self, _deadstate: int | None = None) -> int | None:
        if self.returncode is None and self._waitpid_lock.acquire(blocking=False):  # type: ignore[attr-defined]
            try:
                pid, status = self._try_wait(os.WNOHANG)
                if pid == self.pid:
                    self._handle_exitstatus(status)  # type: ignore[attr-defined]
            finally:
                self._waitpid_lock.release()  # type: ignore[attr-defined]
        return self.returncode

    def _try_wait(self, wait_flags: int) -> tuple[int, int]:
        try:
            status = _number(self._status, socket.MSG_DONTWAIT if wait_flags & os.WNOHANG else 0)
        except BlockingIOError:
            return 0, 0
        self._status.close()
        return self.pid, status


def started(*words: str | Path, module: str = "rig", **options: Any) -> "subprocess.Popen[Any]":
    """`python -m MODULE WORDS …`; `options` as of Popen, but for those of what is done before the program begins."""
    if nursery.closed:
        return of_system(*words, module=module, **options)
    return _Forked([module, *map(str, words)], **options)


def of_system(*words: str | Path, module: str = "rig", **options: Any) -> "subprocess.Popen[Any]":
    """As `started`, always by the system."""
    return subprocess.Popen([sys.executable, "-m", module, *map(str, words)], **options)
