"""A stop by a script line that ends the program, sent to the primary interface over plain TCP.

The line is read by the controller itself; the dashboard, in contrast, is served by the program on the pendant's screen.
The controller accepts lines only in remote control, and acknowledges no line. In local control it answers each line
with an error, C210. Its states, ten a second, show whether a program runs. Sources: the maker's client library,
`PrimaryClient::commandStop`; client interface description: robot mode data, sub-package 0 of a robot state.
"""

import socket
import struct
import time
from collections.abc import Iterator

from rig.turners.ur.controller.controller_words import READ_ONLY_ERROR, ErrorCode, ProgramStopped, decode_message
from rig.turners.ur.controller.primary_interface import PORT, ROBOT_MESSAGE, ROBOT_STATE, packages

ROBOT_MODE_DATA = 0
# Time stamp; real robot connected, enabled, power on, emergency stop, protective stop, program runs, program is paused.
MODE_DATA = struct.Struct(">Q7?")


class PrimaryStop:
    """One connection to the primary interface of the controller at `host`.

    Every method raises `OSError` if the controller does not answer within `timeout_s`.
    """

    name = "primary interface"
    reports_programs = True
    acknowledged = False  # the interface never acknowledges

    def __init__(self, host: str, timeout_s: float) -> None:
        self.refusal: str | None = None
        self.stopped_programs: set[str] = set()  # names of programs that it reported as ended
        self._socket = socket.create_connection((host, PORT), timeout_s)
        self._timeout_s = timeout_s
        self._buffer = bytearray()
        self._greeted = False

    def send(self, script: str) -> None:
        """Send a script of complete lines, without acknowledgement."""
        self._socket.settimeout(self._timeout_s)
        self._socket.sendall(script.encode())

    def stop_program(self) -> None:
        """Stop the running program, and with it the arm."""
        self.send("stop program\n")

    def program_running(self) -> bool:
        """Return whether any program runs or is paused on the controller, according to its next state.

        The first state is skipped, because it may be older than the last script.
        """
        deadline_s = time.monotonic() + self._timeout_s
        while True:
            for running in self._decode_states():
                if self._greeted:
                    return running
                self._greeted = True
            remaining_s = deadline_s - time.monotonic()
            if remaining_s <= 0.0:
                raise TimeoutError("the primary interface does not report in time whether a program runs")
            self._socket.settimeout(remaining_s)
            data = self._socket.recv(65536)
            if not data:
                raise ConnectionError("the primary interface closed the connection")
            self._buffer += data

    def close(self) -> None:
        self._socket.close()

    def _decode_states(self) -> Iterator[bool]:
        """Yield for each received state, oldest first, whether there is a program, either running or paused."""
        for kind, payload in packages(self._buffer):
            if kind == ROBOT_MESSAGE:
                match decode_message(payload):
                    case ErrorCode(code=code) as error if code == READ_ONLY_ERROR:
                        self.refusal = f"{error.words}: it is read-only in local control"
                    case ProgramStopped(program):
                        self.stopped_programs.add(program)
            elif kind == ROBOT_STATE:
                for part, content in packages(bytearray(payload)):
                    if part == ROBOT_MODE_DATA and len(content) >= MODE_DATA.size:
                        *_, runs, paused = MODE_DATA.unpack_from(content)
                        yield runs or paused
