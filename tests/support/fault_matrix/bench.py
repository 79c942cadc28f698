"""One run on a bench of its own: a laboratory, wires to it, the command `rig run`, and control over all of them."""

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import yaml

from support.fault_matrix.wires import ARM_PORTS, Wire, wires
from support.laboratories.worlds import WorldHandle, hardware, worlds
from support.paths import ROOT
from support.processes.warm import start_by_system, start_module

BOARD_PORT = 7321
QUICK, REAL = 8.0, 1.0  # paces of the laboratory: on the way to the fault, and from it on
START_S = 180.0  # wall time for a busy machine
END_S = 900.0  # with RTDE 0.3 s late every motion takes ten times as long
POLL_S = 0.02


class Bench:
    """A laboratory with a run in it. `wire`: the wires by name, those of the arm and `board`."""

    def __init__(self, world: WorldHandle, wire: dict[str, Wire], config: Path, environment: Mapping[str, str]) -> None:
        self.world, self.wire, self.config = world, wire, config
        self.out = config.parent / "run"
        self.process: subprocess.Popen[bytes] | None = None
        self._environment = environment
        self.companions: list[subprocess.Popen[str]] = []  # other programs that a fault has started

    # -- the command -------------------------------------------------------------------------------------------------
    def start(self) -> None:
        self.process = self.rig("run", str(self.config), "--out", str(self.out), "--yes")

    def rig(self, *arguments: str) -> "subprocess.Popen[bytes]":
        """Start `rig …` in a session of its own, like a terminal; with an environment, the system starts it."""
        start = start_by_system if self._environment else start_module
        with (self.config.parent / f"{arguments[0]}.txt").open("wb") as errors:
            return start(
                *arguments,
                cwd=ROOT,
                env={**os.environ, **self._environment},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=errors,
                start_new_session=True,
            )

    @property
    def running(self) -> bool:
        assert self.process is not None
        return self.process.poll() is None

    @property
    def pid(self) -> int:
        assert self.process is not None
        return self.process.pid

    @property
    def driver_pid(self) -> int | None:
        """The process id of the child that communicates with the arm."""
        for pid in children(self.pid):
            with suppress(OSError):
                if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes():
                    return pid
        return None

    def send(self, number: signal.Signals) -> None:
        """Send a signal to all processes of the command in the foreground, like a terminal."""
        with suppress(ProcessLookupError):
            os.killpg(self.pid, number)

    def until(self, condition: Callable[[dict[str, Any]], bool], timeout_s: float, *, running: bool = True) -> bool:
        """Wait for a state of the world while the command runs; return whether it occurred."""
        deadline_s = time.monotonic() + timeout_s
        while not condition(self.world.state()):
            if time.monotonic() > deadline_s or (running and not self.running):
                return False
            time.sleep(POLL_S)
        return True

    def ended(self, timeout_s: float) -> bool:
        """Wait for the end of the command."""
        deadline_s = time.monotonic() + timeout_s
        while self.running and time.monotonic() < deadline_s:
            time.sleep(POLL_S)
        return not self.running

    def read_output(self, command: str) -> str:
        """Return the text that `rig COMMAND` has written to stderr."""
        return (self.config.parent / f"{command}.txt").read_text(encoding="utf-8", errors="replace")

    # -- the laboratory ----------------------------------------------------------------------------------------------
    def pace(self, time_scale: float) -> None:
        self.world.control({"do": "pace", "time_scale": time_scale})

    def end(self) -> None:
        """Kill all processes that still run, and wait for their end."""
        going_on = self.process is not None and self.running  # an ended process' id may belong to another by now
        pids = [self.pid, *filter(None, [self.driver_pid])] if going_on else []
        for pid in pids:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        for companion in self.companions:
            companion.kill()
            companion.wait()
        if self.process is not None:
            self.ended(END_S)


def children(pid: int) -> list[int]:
    """Return the process ids of a process' children; none if it has ended."""
    with suppress(OSError):
        return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    return []


def alive(pid: int) -> bool:
    """Return whether a process runs or hangs; a zombie does neither."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    return False


@contextmanager
def bench(folder: Path, changes: Mapping[str, Any], environment: Mapping[str, str]) -> Iterator[Bench]:
    """Yield a laboratory with these changes to the ideal demonstration, wired to a rig that has not started."""
    folder.mkdir(parents=True)
    with ExitStack() as stack:
        world = stack.enter_context(worlds(folder))(changes)
        host, wire = stack.enter_context(wires(world.host, {**ARM_PORTS, "board": BOARD_PORT}))
        wire["board"].delivered = []
        config = hardware(world.config_path, folder)
        document = yaml.safe_load(config.read_text(encoding="utf-8"))
        document["arm"]["host"], document["board"]["port"] = host, f"socket://{host}:{BOARD_PORT}"
        config.write_text(yaml.safe_dump(document), encoding="utf-8")
        running = Bench(world, wire, config, environment)
        stack.callback(running.end)
        yield running
