"""The Robot API of a PolyScope X: which answers of it there are, by the version of its software, and one HTTP exchange.

The maker's client library (`DashboardClientImplX`) says what is asked and since when it is answered. Of the orders
those about the program that runs are simulated, which are forbidden in local control.
"""

import json
import re
from collections.abc import Callable
from http import HTTPStatus

from rig.world.ur10e.modes import RuntimeState
from rig.world.ur10e.robot import Robot

BASE = "/universal-robots/robot-api"
SINCE = (10, 11)  # versions before it have none
REQUEST_BYTES = 1 << 14
END = b"\r\n\r\n"
PROGRAM_STATE = "/program/v1/state"
LENGTH = re.compile(rb"^content-length:\s*(\d{1,4})\s*$", re.IGNORECASE | re.MULTILINE)

Answer = Callable[[Robot], dict[str, str]]
PAUSED = (RuntimeState.PAUSING, RuntimeState.PAUSED)


def _program_state(robot: Robot) -> dict[str, str]:
    stopped = "PAUSED" if robot.runtime_state in PAUSED else "STOPPED"
    return {"state": "PLAYING" if robot.robot_status_bits >> 1 & 1 else stopped}


QUESTIONS: dict[str, tuple[tuple[int, int], Answer]] = {
    PROGRAM_STATE: (SINCE, _program_state),
    "/system/v1/controlmode": ((10, 12), lambda robot: {"mode": "REMOTE" if robot.remote_control else "LOCAL"}),
    "/system/v1/information": (
        (10, 14),
        lambda robot: {"serialNumber": robot.identity.serial_number, "robotType": robot.model.name},
    ),
}


def has_robot_api(robot: Robot) -> bool:
    """Whether its software has a Robot API."""
    return robot.identity.polyscope >= SINCE


class RobotApiSession:
    """One connection: a request, its answer, and the end."""

    dialogue = False

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._buffer = bytearray()
        self.closing = False

    def greeting(self) -> bytes:
        return b""

    def receive(self, data: bytes) -> bytes:
        self._buffer += data
        head, ended, body = bytes(self._buffer).partition(END)
        length = LENGTH.search(head)
        whole = ended and len(body) >= (int(length[1]) if length else 0)
        if self.closing or (not whole and len(self._buffer) <= REQUEST_BYTES):
            return b""
        self.closing = True
        method, _, rest = head.partition(b"\r\n")[0].decode(errors="replace").partition(" ")
        return self._answer(method, rest.partition(" ")[0], body)

    def tick(self) -> bytes:
        return b""

    def handle_close(self) -> None:
        pass

    def _answer(self, method: str, path: str, body: bytes) -> bytes:
        since, answer = QUESTIONS.get(path.removeprefix(BASE), (None, None))
        if answer is None or since is None or self._robot.identity.polyscope < since or not path.startswith(BASE):
            return _http(HTTPStatus.NOT_FOUND, {"message": "not found"})
        if method == "PUT" and path == BASE + PROGRAM_STATE:
            return self._ordered(body)
        if method != "GET":
            return _http(HTTPStatus.METHOD_NOT_ALLOWED, {"message": "not simulated"})
        return _http(HTTPStatus.OK, answer(self._robot))

    def _ordered(self, body: bytes) -> bytes:
        """The answer to an order about the program that runs."""
        if self._robot.local_control:
            return _http(HTTPStatus.FORBIDDEN, {"message": "the robot is in local control mode"})
        try:
            action = json.loads(body)["action"]
        except (ValueError, TypeError, KeyError, RecursionError):
            return _http(HTTPStatus.BAD_REQUEST, {"message": "no action"})
        match action:
            case "stop":
                self._robot.stop_program("stopped by the Robot API")
            case "pause":
                self._robot.pause()
            case "resume":
                self._robot.resume()
            case _:
                return _http(HTTPStatus.BAD_REQUEST, {"message": f"not simulated: {action}"[:200]})
        return _http(HTTPStatus.OK, {"message": "ok"})


def _http(status: HTTPStatus, body: dict[str, str]) -> bytes:
    content = json.dumps(body).encode()
    head = f"HTTP/1.1 {status} {status.phrase}\r\nContent-Type: application/json\r\n"
    return f"{head}Content-Length: {len(content)}\r\nConnection: close\r\n\r\n".encode() + content
