"""The Robot API of PolyScope X: its answers, by the version of the software, over one HTTP exchange.

The maker's client library (`DashboardClientImplX`) shows the requests and the versions that answer them. Only the
orders about the running program are simulated; they are forbidden in local control.
"""

import json
import re
from collections.abc import Callable
from http import HTTPStatus

from rig.world.ur10e.modes import RuntimeState
from rig.world.ur10e.robot import Robot

BASE = "/universal-robots/robot-api"
SINCE = (10, 11)  # older versions have no Robot API
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
    """Return whether the controller's software has a Robot API."""
    return robot.identity.polyscope >= SINCE


class RobotApiSession:
    """The world's side of one connection: a request, its answer, and the end."""

    dialogue = False

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._buffer = bytearray()
        self.closing = False

    def greeting(self) -> bytes:
        return b""

    def receive(self, data: bytes) -> bytes:
        self._buffer += data
        head, has_end, body = bytes(self._buffer).partition(END)
        length = LENGTH.search(head)
        is_complete = has_end and len(body) >= (int(length[1]) if length else 0)
        if self.closing or (not is_complete and len(self._buffer) <= REQUEST_BYTES):
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
            return self._obey(body)
        if method != "GET":
            return _http(HTTPStatus.METHOD_NOT_ALLOWED, {"message": "not simulated"})
        return _http(HTTPStatus.OK, answer(self._robot))

    def _obey(self, body: bytes) -> bytes:
        """Carry out an order about the running program and return the answer."""
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
