"""A script around ur_rtde in a process of its own, for tests in which the client may hang or crash."""

import subprocess
import sys
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager

from support.laboratories.worlds import WorldHandle
from support.processes.waiting import PATIENCE_S

BEGIN = """
import os, sys, time
from rtde_control import RTDEControlInterface
from rtde_receive import RTDEReceiveInterface
host = sys.argv[1]
home = [0.0, -1.5707963, 1.5707963, -1.5707963, -1.5707963, 0.0]
there = [*home[:5], 3.0]
def say(*words): print("\\n>", *words, flush=True)  # ur_rtde may be in the middle of a line
def until(condition):
    end = time.monotonic() + patience_s
    while not condition():
        if time.monotonic() > end: say("waited in vain"); os._exit(1)
        time.sleep(0.002)
"""
CONNECT = "control, receive = RTDEControlInterface(host), RTDEReceiveInterface(host)\nsay('connected')\n"


class Client:
    """A script around ur_rtde in its own process, with output line by line."""

    def __init__(self, host: str, script: str, connect: bool) -> None:
        code = (
            f"patience_s = {PATIENCE_S}\n"
            + BEGIN
            + (CONNECT if connect else "")
            + textwrap.dedent(script)
            + "\nos._exit(0)\n"
        )
        self.process = subprocess.Popen(
            [sys.executable, "-c", code, host], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        assert self.process.stdout is not None
        self._lines = self.process.stdout

    def says(self, line: str) -> None:
        answer = self.next()
        assert answer == line, f"the client said {answer!r} instead of {line!r}"

    def next(self) -> str:
        """Return the next line of the script, without ur_rtde's own output."""
        for line in self._lines:
            if line.startswith(">"):
                return line[1:].strip()
        raise AssertionError(f"the client ended with status {self.process.wait()} without another word")

    def end(self) -> None:
        self.process.kill()
        self.process.wait()
        self._lines.close()


@contextmanager
def client(world: WorldHandle, script: str, connect: bool = True) -> Iterator[Client]:
    running = Client(world.host, script, connect)
    try:
        if connect:
            running.says("connected")
        yield running
    finally:
        running.end()
