"""The arm's dashboard server over plain TCP: the stop path that is independent of `ur_rtde`."""

import socket
import time
from types import TracebackType
from typing import Self

from rig.errors.quoting import printable

DASHBOARD_PORT = 29999
GREETING = "Connected:"
STOPPED_ANSWER, FAILED_ANSWER = "Stopped", "Failed to execute"  # answers to `stop`; a refusal is a sentence
MAX_ANSWER_CHARACTERS = 160  # in a message
LINE_BYTES = 4096  # the longest answer has some dozens


class Dashboard:
    """One connection to the dashboard server of the controller at `host`.

    Every method raises `OSError` if the controller does not answer a command within `timeout_s`.
    """

    name = "dashboard"
    reports_programs = True

    def __init__(self, host: str, timeout_s: float) -> None:
        self.refusal: str | None = None
        self.acknowledged = False
        self._socket = socket.create_connection((host, DASHBOARD_PORT), timeout=timeout_s)
        self._received = bytearray()
        self._timeout_s = timeout_s

    def ask(self, command: str) -> str:
        """Send one command and return the controller's answer, without the line end.

        The first command does not wait for the greeting, so that a `stop` also reaches a slow controller.
        """
        deadline_s = time.monotonic() + self._timeout_s
        self._socket.sendall(command.encode() + b"\n")
        while (line := self._line(deadline_s)).startswith(GREETING):
            continue
        return line

    def stop_program(self) -> None:
        """Stop the running program, and with it the arm.

        In local control the controller refuses the command, and its answer becomes the `refusal`. If no program runs,
        the controller answers that the command failed, which does not count as a refusal.
        """
        answer = self.ask("stop")
        self.acknowledged = answer == STOPPED_ANSWER
        if not self.acknowledged and not (answer.startswith(FAILED_ANSWER) and not self.program_running()):
            self.refusal = f'"{answer[:MAX_ANSWER_CHARACTERS]}"'

    def program_running(self) -> bool:
        """Return whether any program runs on the controller."""
        return self.ask("running").lower().endswith("true")

    def is_in_remote_control(self) -> bool | None:
        """Return whether the pendant is in remote control; None if the controller does not know the command."""
        return {"true": True, "false": False}.get(self.ask("is in remote control").lower())

    def polyscope(self) -> str:
        """Return the controller's answer to a request for its software version."""
        return self.ask("PolyscopeVersion")

    def serial_number(self) -> str:
        """Return the arm's serial number."""
        return self.ask("get serial number")

    def robot_model(self) -> str:
        """Return the arm's name; a controller that does not know the command returns an error text."""
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
        """Return the next line from the dashboard. Raise TimeoutError, ConnectionError."""
        while b"\n" not in self._received:
            remaining_s = deadline_s - time.monotonic()
            if remaining_s <= 0.0:
                raise TimeoutError("the dashboard server does not answer in time")
            if len(self._received) > LINE_BYTES:
                raise ConnectionError("this is not a dashboard server")
            self._socket.settimeout(remaining_s)
            data = self._socket.recv(LINE_BYTES)
            if not data:
                raise ConnectionError("the dashboard server closed the connection")
            self._received += data
        line, _, rest = self._received.partition(b"\n")
        self._received = rest
        return printable(line.decode(errors="replace").strip())
