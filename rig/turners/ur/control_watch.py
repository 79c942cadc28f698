"""Detects that only the client program could still stop an arm, as after a change to local control.

In local control the controller ignores every stop by another route, dashboard or primary interface. Neither the states
nor the client report the mode, but the dashboard reports it if polled (since 5.6), as does the Robot API of a PolyScope
X (since 10.12). When the mode changes, the controller also closes the connections of the primary interface (as the
maker's client library and issue 459 of its ROS driver show). A controller of the CB3 series has no local control.
"""

import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Literal

from rig.errors import Problem
from rig.turners.ur.condition import local_control_during_run
from rig.turners.ur.controller.controller_words import ProgramException, ProgramStopped, decode_message
from rig.turners.ur.controller.dashboard import Dashboard
from rig.turners.ur.controller.primary_interface import PORT, ROBOT_MESSAGE, packages
from rig.turners.ur.controller.robot_api import RobotApi
from rig.turners.ur.identity import is_polyscope_x

POLL_S = 0.5  # of the control mode
CLOSING_S = 0.1  # time within which the thread ends after `close`
MAX_ANSWER_S = 0.8
GONE_PROOF_S, CLOSED_PROOF_S = 1.0, 0.25  # for which states must show that only the port is gone, or has closed

Remote = bool | None  # None: unknown to the controller
ControlMode = Remote | Literal["gone"]


class ControlWatch:
    """A thread that calls `on_problem` once, if the arm at `host` can no longer be stopped through its ports.

    `newest_s()` returns the monotonic time of the newest state. If no states come, the link itself reports this.
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
        self._api = RobotApi(host, robot_api_port, MAX_ANSWER_S)
        self._newest_s, self._on_problem = newest_s, on_problem
        self._dashboard: Dashboard | None = None
        self._primary: socket.socket | None = None
        self._buffer = bytearray()
        self._closed_s: float | None = None  # time at which the primary interface last closed its connection
        self._gone_since_s: float | None = None  # time since which no port answers
        self.exception: str | None = None  # the controller's latest reason for ending a program
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
            self._thread.join(2 * MAX_ANSWER_S)

    def _run(self) -> None:
        """Watch control mode and primary interface until the end, or until a problem is found."""
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
        """Return the problem that the control mode shows; None if there is no problem."""
        if remote is False:
            return local_control_during_run(f"the pendant of the arm at {self._host} was switched to local control")
        if self._is_x and remote is None and self._has_lost_primary_alone():
            return local_control_during_run(
                f"the arm at {self._host} closed its primary interface, as it does when its pendant is switched to "
                "local control"
            )
        if self._primary is not None or not (self._is_x or remote == "gone"):
            self._gone_since_s = None
            return None
        self._gone_since_s = self._gone_since_s or time.monotonic()
        if not self._lasts(self._gone_since_s, GONE_PROOF_S):
            return None
        return _no_port_to_stop(self._host, "primary interface" if self._is_x else "dashboard and primary interface")

    def _has_lost_primary_alone(self) -> bool:
        """Return whether the primary interface has closed its connection although states continue."""
        return self._closed_s is not None and self._lasts(self._closed_s, CLOSED_PROOF_S)

    def _lasts(self, since_s: float, duration_s: float) -> bool:
        """Return whether states have continued for `duration_s` since `since_s`."""
        return self._newest_s() - since_s >= duration_s

    def _ask(self) -> ControlMode:
        """Return whether the pendant is in remote control; None if unknown, "gone" if the controller is silent."""
        if self._is_x:
            return self._api.is_in_remote_control()
        for _ in range(2):  # some controllers close the connection on the change to local control; ask once more
            try:
                self._dashboard = self._dashboard or Dashboard(self._host, MAX_ANSWER_S)
                return self._dashboard.is_in_remote_control()
            except OSError:
                if self._dashboard is not None:
                    self._dashboard.close()
                self._dashboard = None
        return "gone"

    def _listen(self, remote: ControlMode) -> None:
        """Read messages of the primary interface for `POLL_S`; return at once if it closes."""
        ends_s = time.monotonic() + POLL_S
        # A PolyScope X that hides its control mode accepts connections in local control too. So after it has closed
        # one, a new connection would not prove remote control, and none is opened.
        may_open = not (self._is_x and remote is None and self._closed_s is not None)
        if self._primary is None and may_open:
            with suppress(OSError):
                self._primary = socket.create_connection((self._host, PORT), MAX_ANSWER_S)
                self._buffer.clear()
        while self._primary is not None and not self._ending.is_set() and time.monotonic() < ends_s:
            try:
                self._primary.settimeout(CLOSING_S)
                self._hear(self._primary)
            except TimeoutError:
                continue
            except OSError:
                self._primary.close()
                self._primary, self._closed_s = None, time.monotonic()
                return
        if self._primary is None:
            self._ending.wait(POLL_S)

    def _hear(self, primary: socket.socket) -> None:
        """Record messages about ended programs. Raise `OSError` if the connection has closed."""
        data = primary.recv(65536)
        if not data:
            raise ConnectionError("the primary interface closed the connection")
        self._buffer += data
        for kind, payload in packages(self._buffer):
            match decode_message(payload) if kind == ROBOT_MESSAGE else None:
                case ProgramException(text):
                    self.exception = text
                case ProgramStopped(program):
                    self.stopped_programs.add(program)


def _no_port_to_stop(host: str, ports: str) -> Problem:
    return Problem(
        "stop_ports_closed",
        f"{ports} of the arm at {host} no longer answer: without the client nothing could stop it any more",
        "Check whether the services in the security settings, or a firewall, were changed; then start again",
    )
