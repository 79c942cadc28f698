"""Watches, while the arm is under control, that the rig could still stop it without its client.

Local control takes every independent stop away, and neither the states nor the client tell of it. What tells: the
dashboard, which is asked (from 5.6 on); the Robot API of a PolyScope X (from 10.12 on); and the primary interface,
whose connections the controller closes in that moment (the maker's client library, and issue 459 of his ROS driver). A
controller of the CB3 series does not know local control.
"""

import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Literal

from rig.errors import Problem
from rig.turners.ur.condition import switched_to_local_control
from rig.turners.ur.controller.controller_words import ProgramException, ProgramStopped, words_in
from rig.turners.ur.controller.dashboard import Dashboard
from rig.turners.ur.controller.primary import PORT, ROBOT_MESSAGE, packages
from rig.turners.ur.controller.robot_api import RobotApi
from rig.turners.ur.identity import is_polyscope_x

ASK_S = 0.5  # the control mode is asked so often
LOOK_S = 0.1  # the thread ends within this when it is no longer wanted
ANSWER_S = 0.8
GONE_S, CLOSED_S = 1.0, 0.25  # with states that go on for so long beside it, a port that is gone is gone by itself

Remote = bool | None  # None: the controller does not tell
ControlMode = Remote | Literal["gone"]


class ControlWatch:
    """A thread that calls `on_problem` once, when the arm at `host` can no longer be stopped by its ports.

    `newest_s()` tells when the newest state came (monotonic time): with a link that is lost the ports are lost too,
    and it is the link's affair to say so.
    """

    def __init__(
        self,
        host: str,
        version: tuple[int, ...],
        robot_api_port: int,
        newest_s: Callable[[], float],
        on_problem: Callable[[Problem], None],
    ) -> None:
        self._host = host
        self._is_x = is_polyscope_x(version)
        self._api = RobotApi(host, robot_api_port, ANSWER_S)
        self._newest_s, self._on_problem = newest_s, on_problem
        self._dashboard: Dashboard | None = None
        self._primary: socket.socket | None = None
        self._buffer = bytearray()
        self._closed_s: float | None = None  # when the primary interface last closed its connection
        self._gone_since_s: float | None = None  # since when no port answers
        self.exception: str | None = None  # why the controller ended a program, the last time that it said so
        self.stopped_programs: set[str] = set()  # by their names
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="arm control watch", daemon=True)

    def start(self) -> None:
        """Begin to watch."""
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._ending.set()
        if self._thread.ident is not None and self._thread is not threading.current_thread():
            self._thread.join(2 * ANSWER_S)

    def _run(self) -> None:
        try:
            while not self._ending.is_set():
                remote = self._ask()
                if (problem := self._problem(remote)) is not None:
                    self._on_problem(problem)
                    return
                self._listen(remote)
        finally:
            for connection in (self._dashboard, self._primary):
                if connection is not None:
                    connection.close()

    def _problem(self, remote: ControlMode) -> Problem | None:
        """What the last look means."""
        if remote is False:
            return switched_to_local_control(self._host, "its pendant was switched to local control")
        if self._is_x and remote is None and self._closed_beside_states():
            how = (
                "the controller closed its primary interface, as it does when the pendant is switched to local control"
            )
            return switched_to_local_control(self._host, how)
        if self._primary is not None or not (self._is_x or remote == "gone"):
            self._gone_since_s = None
            return None
        self._gone_since_s = self._gone_since_s or time.monotonic()
        if not self._lasts(self._gone_since_s, GONE_S):
            return None
        return _no_port_to_stop(self._host, "primary interface" if self._is_x else "dashboard and primary interface")

    def _closed_beside_states(self) -> bool:
        """Whether the primary interface alone has closed its connection: the link has not."""
        return self._closed_s is not None and self._lasts(self._closed_s, CLOSED_S)

    def _lasts(self, since_s: float, duration_s: float) -> bool:
        """Whether states have come for so long since then."""
        return self._newest_s() - since_s >= duration_s

    def _ask(self) -> ControlMode:
        """Whether the pendant has handed control over, and goes on to."""
        if self._is_x:
            return self._api.in_remote_control()
        for _ in range(2):  # one that closes the connection, as some do with local control, is asked again
            try:
                self._dashboard = self._dashboard or Dashboard(self._host, ANSWER_S)
                return self._dashboard.in_remote_control()
            except OSError:
                if self._dashboard is not None:
                    self._dashboard.close()
                self._dashboard = None
        return "gone"

    def _listen(self, remote: ControlMode) -> None:
        """Hear what the primary interface says until it is time to ask again; returns at once when it closes."""
        ends_s = time.monotonic() + ASK_S
        # One that does not tell the control mode takes a connection in local control too, and tells that of nobody.
        may_open = not (self._is_x and remote is None and self._closed_s is not None)
        if self._primary is None and may_open:
            with suppress(OSError):
                self._primary = socket.create_connection((self._host, PORT), ANSWER_S)
                self._buffer.clear()
        while self._primary is not None and not self._ending.is_set() and time.monotonic() < ends_s:
            try:
                self._primary.settimeout(LOOK_S)
                self._hear(self._primary)
            except TimeoutError:
                continue
            except OSError:
                self._primary.close()
                self._primary, self._closed_s = None, time.monotonic()
                return
        if self._primary is None:
            self._ending.wait(ASK_S)

    def _hear(self, primary: socket.socket) -> None:
        """Keep what is said of programs that were ended. Raises `OSError` when the connection has closed."""
        data = primary.recv(65536)
        if not data:
            raise ConnectionError("the primary interface closed the connection")
        self._buffer += data
        for kind, payload in packages(self._buffer):
            match words_in(payload) if kind == ROBOT_MESSAGE else None:
                case ProgramException(text):
                    self.exception = text
                case ProgramStopped(program):
                    self.stopped_programs.add(program)


def _no_port_to_stop(host: str, ports: str) -> Problem:
    return Problem(
        "stop_ports_closed",
        f"{ports} of the arm at {host} no longer answer: without the client nothing could stop it any more",
        "Look whether somebody has changed the services in the security settings, or a firewall; then start again",
    )
