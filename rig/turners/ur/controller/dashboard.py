"""The arm's dashboard server over plain TCP: the stop path that does not depend on `ur_rtde`."""

import socket
import time
from types import TracebackType
from typing import Self

from rig.errors.quoting import printable

DASHBOARD_PORT = 29999
GREETING = "Connected:"
STOPPED, FAILED = "Stopped", "Failed to execute"  # the answers to `stop`, beside that it is not allowed
ANSWER = 160  # characters of an answer that are repeated
LINE_BYTES = 4096  # the longest answer has some dozens


class Dashboard:
    """One connection to the dashboard server of the controller at `host`.

    Every method raises `OSError` when the controller does not answer a command within `timeout_s`.
    """

    name = "dashboard"
    tells_of_programs = True

    def __init__(self, host: str, timeout_s: float) -> None:
        self.refusal: str | None = None
        self.acknowledged = False
        self._socket = socket.create_connection((host, DASHBOARD_PORT), timeout=timeout_s)
        self._heard = bytearray()
        self._timeout_s = timeout_s

    def ask(self, command: str) -> str:
        """Send one command and return the controller's answer, without the line end.

        The first command does not wait for the greeting: a controller that is slow to greet still finds the `stop`.
        """
        deadline_s = time.monotonic() + self._timeout_s
        self._socket.sendall(command.encode() + b"\n")
        while (line := self._line(deadline_s)).startswith(GREETING):
            continue
        return line

    def stop_program(self) -> None:
        """Stop the running program, and with it the arm.

        In local control it refuses in a sentence. Where no program runs it may fail to execute the command, which is
        no refusal.
        """
        answer = self.ask("stop")
        self.acknowledged = answer == STOPPED
        if not self.acknowledged and not (answer.startswith(FAILED) and not self.program_running()):
            self.refusal = f'"{answer[:ANSWER]}"'

    def program_running(self) -> bool:
        """Whether any program runs on the controller."""
        return self.ask("running").lower().endswith("true")

    def in_remote_control(self) -> bool | None:
        """Whether the pendant has handed control over; None when the controller does not know the question."""
        return {"true": True, "false": False}.get(self.ask("is in remote control").lower())

    def polyscope(self) -> str:
        """The controller's software version, as it says it."""
        return self.ask("PolyscopeVersion")

    def serial_number(self) -> str:
        """The arm's serial number."""
        return self.ask("get serial number")

    def robot_model(self) -> str:
        """What it calls the arm; other words from one that does not know the question."""
        return self.ask("get robot model")

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _line(self, deadline_s: float) -> str:
        while b"\n" not in self._heard:
            left_s = deadline_s - time.monotonic()
            if left_s <= 0.0:
                raise TimeoutError("the dashboard server does not answer in time")
            if len(self._heard) > LINE_BYTES:
                raise ConnectionError("this is no dashboard server")
            self._socket.settimeout(left_s)
            data = self._socket.recv(LINE_BYTES)
            if not data:
                raise ConnectionError("the dashboard server closed the connection")
            self._heard += data
        line, _, rest = self._heard.partition(b"\n")
        self._heard = rest
        return printable(line.decode(errors="replace").strip())
