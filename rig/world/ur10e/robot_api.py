"""The Robot API of a PolyScope X: which answers of it there are, by the version of its software, and one HTTP exchange.

The maker's client library (`DashboardClientImplX`) says what is asked and since when it is answered. Only questions are
simulated, not the orders.
"""

import json
from collections.abc import Callable
from http import HTTPStatus

from rig.world.ur10e.robot import Robot

BASE = "/universal-robots/robot-api"
SINCE = (10, 11)  # versions before it have none
REQUEST_BYTES = 1 << 14
END = b"\r\n\r\n"

Answer = Callable[[Robot], dict[str, str]]
QUESTIONS: dict[str, tuple[tuple[int, int], Answer]] = {
    "/system/v1/controlmode": ((10, 12), lambda robot: {"mode": "REMOTE" if robot.remote_control else "LOCAL"}),
    "/system/v1/information": (
        (10, 14),
        lambda robot: {"serialNumber": robot.identity.serial_number, "robotType": robot.model.name},
    ),
}


def offered(robot: Robot) -> bool:
    """Whether its software has a Robot API."""
    return robot.identity.polyscope >= SINCE


class RobotApiSession:
    """One connection: a request, its answer, and the end."""

    dialogue = True

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._buffer = bytearray()
        self.closing = False

    def greeting(self) -> bytes:
        return b""

    def receive(self, data: bytes) -> bytes:
        self._buffer += data
        if self.closing or (END not in self._buffer and len(self._buffer) <= REQUEST_BYTES):
            return b""
        self.closing = True
        method, _, rest = self._buffer.partition(b"\r\n")[0].decode(errors="replace").partition(" ")
        return self._answer(method, rest.partition(" ")[0])

    def tick(self) -> bytes:
        return b""

    def closed(self) -> None:
        pass

    def _answer(self, method: str, path: str) -> bytes:
        since, answer = QUESTIONS.get(path.removeprefix(BASE), (None, None))
        if answer is None or since is None or self._robot.identity.polyscope < since or not path.startswith(BASE):
            return _http(HTTPStatus.NOT_FOUND, {"message": "not found"})
        if method != "GET":
            return _http(HTTPStatus.METHOD_NOT_ALLOWED, {"message": "not simulated"})
        return _http(HTTPStatus.OK, answer(self._robot))


def _http(status: HTTPStatus, body: dict[str, str]) -> bytes:
    content = json.dumps(body).encode()
    head = f"HTTP/1.1 {status} {status.phrase}\r\nContent-Type: application/json\r\n"
    return f"{head}Content-Length: {len(content)}\r\nConnection: close\r\n\r\n".encode() + content
