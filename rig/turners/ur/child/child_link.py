"""The parent's end of the link to the supervised child. It starts the child, passes messages, and detects silence."""

import multiprocessing
import os
import select
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from pathlib import Path

from rig.data.processes.process_silence import Silence
from rig.errors import Problem
from rig.turners.ur.child import client_process as child
from rig.turners.ur.child.client_problems import LINK_REMEDY
from rig.turners.ur.child_messages import Alive, ChildHeartbeat, Message, Request
from rig.turners.ur.controller.listener import find_listener, resolve_address
from rig.turners.ur.controller.rtde_packages import PORT

TICK_S = 0.05
SILENT_TICKS = 10  # 0.5 s without a heartbeat
MAX_STARVED_FACTOR = 4  # factor on these limits while the main thread in question is ready to run but gets no processor
FROZEN_TICKS = 16  # 0.8 s with heartbeats but no new state
MAX_LINK_SILENCE_S = 0.8  # of a remote controller, whose pace does not depend on the load of this machine
STALE_TICKS = 2  # a child that ends after 0.1 s without a new state had lost the arm before
CRASH_STATUSES = (-signal.SIGSEGV, -signal.SIGABRT)  # exit statuses of the client after the arm closes a connection
PATIENT_TICKS = 240  # 12 s while a client's constructor holds the child's interpreter, at worst until its 5 s time-out


class ChildLink:
    """One child process. Threads of the link call `on_message` for each message, and `on_lost` if the link is lost."""

    def __init__(
        self,
        host: str,
        state_rate_hz: float,
        on_message: Callable[[Message], None],
        on_lost: Callable[[Problem], None],
        *,
        robot_api_port: int,
        log: Path | None,
    ) -> None:
        """Prepare the child process and its threads; `start` starts them.

        `log`: the file for the output of the `ur_rtde` client, None to discard it.
        """
        self._host = host
        self._on_message = on_message
        self._on_lost = on_lost
        self._ended = threading.Event()
        self._sending = threading.Lock()
        self._patient = False
        self._silent = Silence(0, spared=MAX_STARVED_FACTOR)  # ticks without a message; counted once the child runs
        self._beaten = False  # whether a heartbeat came since the guard's last tick
        self._frozen = Silence(0, spared=MAX_STARVED_FACTOR)  # ticks with heartbeats, but without a new state
        self._silent_s = 0.0  # time without data from the controller
        self._is_remote = False  # whether the controller runs on another machine
        context = multiprocessing.get_context("spawn")
        self._pipe: Connection[Request, Message]
        self._pipe, self._child_pipe = context.Pipe()
        self._process = context.Process(
            target=child.main,
            args=(self._child_pipe, host, state_rate_hz, robot_api_port, str(log) if log else None),
            name="arm",
            daemon=True,
        )
        self._threads = (
            threading.Thread(target=self._read, name="arm reader", daemon=True),
            threading.Thread(target=self._guard, name="arm guard", daemon=True),
        )

    def start(self) -> None:
        """Start the child process, whose first message is `Connected` or `RequestFailed`.

        Watch for silence of the child, and of a controller that is a process of this computer.
        """
        ip = resolve_address(self._host)
        self._is_remote = ip is None or not ip.is_loopback
        if ip is not None and not self._is_remote and (controller_pid := find_listener(ip, PORT)) is not None:
            self._frozen = Silence(controller_pid, spared=MAX_STARVED_FACTOR, thread=controller_pid)
        with _block_interrupts():
            self._process.start()
        self._child_pipe.close()
        assert self._process.pid is not None
        # Its main thread sends the heartbeats; delays of the client's own threads do not count.
        self._silent = Silence(self._process.pid, spared=MAX_STARVED_FACTOR, thread=self._process.pid)
        for thread in self._threads:
            thread.start()

    def send(self, request: Request) -> None:
        """Pass a request to the child; the reader thread reports a child that has ended."""
        with self._sending:
            try:
                self._pipe.send(request)
            except OSError:
                return

    @contextmanager
    def patience(self) -> Iterator[None]:
        """Accept a long silence in the block, in which a constructor of the client blocks the child."""
        self._patient = True
        try:
            yield
        finally:
            self._silent.heard()
            self._frozen.heard()
            self._patient = False

    @property
    def ended(self) -> bool:
        """Whether messages can no longer come."""
        return self._ended.is_set()

    def close(self) -> None:
        """Stop an arm under control, then end the child and both threads."""
        self._ended.set()
        if self._process.pid is None:
            self._pipe.close()
            self._child_pipe.close()
            return
        self.kill()
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(1.0)
        self._pipe.close()
        with suppress(ValueError):  # killed, but still in a system call; it ends after that
            self._process.close()

    def kill(self) -> None:
        """Kill the child: its client may hang, and the client's destructors may block or abort."""
        self._process.kill()
        self._process.join(1.0)

    def _read(self) -> None:
        """Receive the child's messages until the child ends, and report an unexpected end."""
        try:
            while True:
                message = self._pipe.recv()
                self._silent.heard()
                if isinstance(message, ChildHeartbeat):
                    self._beaten, self._silent_s = True, message.silent_s
                    if message.states:
                        self._frozen.heard()
                self._on_message(message)
        except (EOFError, OSError):
            if not self._ended.is_set():
                self._ended.set()
                stale = self._frozen.ticks > STALE_TICKS
                self._process.join(0.2)
                status = self._process.exitcode
                name = "arm_link_lost" if stale or status in CRASH_STATUSES else "arm_driver_died"
                self._lose(name, f"the process that talks to the arm at {self._host} ended (exit status {status})")

    def _guard(self) -> None:
        """Exchange heartbeats with the process; end it when it hangs or when no new state arrives."""
        while not self._ended.wait(TICK_S):
            self._say_alive()
            self._silent.tick(unheard=_readable(self._pipe))
            if self._beaten:
                self._frozen.tick()
            self._beaten = False
            if self._silent.lasts_over(PATIENT_TICKS if self._patient else SILENT_TICKS):
                return self._give_up("arm_driver_hung", "the process that talks to the arm no longer answers")
            frozen = self._frozen.lasts_over(PATIENT_TICKS if self._patient else FROZEN_TICKS)
            if frozen or (self._is_remote and not self._patient and self._silent_s > MAX_LINK_SILENCE_S):
                return self._give_up("arm_link_lost", f"no new state arrives from the arm at {self._host}")
        return None

    def _say_alive(self) -> None:
        """Send a sign of life without waiting: a full pipe shows that the child does not read."""
        if not self._sending.acquire(blocking=False):
            return
        try:
            if _writable(self._pipe):
                self._pipe.send(Alive())
        except OSError:
            return
        finally:
            self._sending.release()

    def _give_up(self, name: str, what: str) -> None:
        """End an unresponsive child, whose client could upload its script again; report the problem `name`, `what`."""
        self._ended.set()
        self._process.kill()
        self._lose(name, what)

    def _lose(self, name: str, what: str) -> None:
        self._on_lost(Problem(name, what, LINK_REMEDY))


def _readable(pipe: "Connection[Request, Message]") -> bool:
    """Return whether a message waits in the pipe; False if the system cannot say."""
    return os.name == "posix" and bool(select.select([pipe.fileno()], [], [], 0)[0])


def _writable(pipe: "Connection[Request, Message]") -> bool:
    """Return whether the pipe takes a message at once; True if the system cannot say."""
    if os.name != "posix":
        return True
    return bool(select.select([], [pipe.fileno()], [], 0)[1])


@contextmanager
def _block_interrupts() -> Iterator[None]:
    """Hold back Ctrl-C in the block: the parent receives it afterwards, a child started in the block never does."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows: the child ignores Ctrl-C once it runs
        yield
        return
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
