"""The Robot API of PolyScope X: its answers, by the version of the software, over one HTTP exchange.

The maker's client library (`DashboardClientImplX`) shows the requests and the versions that answer them. An order is
answered when it has been carried out. In local control orders that move or power the arm are forbidden.
"""

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any
from urllib.parse import unquote

from rig.world.clock import TICKS_PER_SECOND
from rig.world.ur10e.interfaces.stored_programs import DEFAULT_PROGRAM, StoredPrograms, WaitProgram
from rig.world.ur10e.modes import RobotMode, RuntimeState, SafetyMode
from rig.world.ur10e.robot import Robot

BASE = "/universal-robots/robot-api"
MIN_VERSION = (10, 11)  # older versions have no Robot API
REQUEST_BYTES = 1 << 20
END = b"\r\n\r\n"
PROGRAM_STATE = "/program/v1/state"
LENGTH = re.compile(rb"^content-length:\s*(\d{1,7})\s*$", re.IGNORECASE | re.MULTILINE)
PATIENCE_TICKS = 10 * TICKS_PER_SECOND  # time after which an order is answered, executed or not

Body = dict[str, Any]
Answer = Callable[[Robot], Body]
Order = Callable[[Robot], object]
Done = Callable[[Robot], bool]
PAUSE_STATES = (RuntimeState.PAUSING, RuntimeState.PAUSED)


def _program_state(robot: Robot) -> Body:
    stopped = "PAUSED" if robot.runtime_state in PAUSE_STATES else "STOPPED"
    return {"state": "PLAYING" if robot.robot_status_bits >> 1 & 1 else stopped}


def _safety_mode(robot: Robot) -> Body:
    is_emergency = robot.safety_mode == SafetyMode.ROBOT_EMERGENCY_STOP
    return {"mode": "EMERGENCY_STOP" if is_emergency else robot.safety_mode.name}


def _api_version(robot: Robot) -> str:
    """Return the version of the Robot API in this version of PolyScope X."""
    return "3.1.4" if robot.identity.polyscope >= (10, 12) else "3.0.0"


QUESTIONS: Mapping[str, tuple[tuple[int, int], Answer]] = {
    "/openapi.json": (
        MIN_VERSION,
        lambda robot: {"openapi": "3.0.0", "info": {"title": "Robot API", "version": _api_version(robot)}},
    ),
    PROGRAM_STATE: (MIN_VERSION, _program_state),
    "/program/v1/loaded": ((10, 12), lambda robot: {"name": robot.loaded_program or DEFAULT_PROGRAM}),
    "/robotstate/v1/robotmode": ((10, 12), lambda robot: {"mode": robot.robot_mode.name}),
    "/robotstate/v1/safetymode": ((10, 12), _safety_mode),
    "/system/v1/controlmode": ((10, 12), lambda robot: {"mode": "REMOTE" if robot.remote_control else "LOCAL"}),
    "/system/v1/operationalmode": ((10, 12), lambda robot: {"mode": "AUTOMATIC" if robot.remote_control else "MANUAL"}),
    "/system/v1/information": (
        (10, 14),
        lambda robot: {"serialNumber": robot.identity.serial_number, "robotType": robot.model.name},
    ),
}


def _play(robot: Robot) -> None:
    if robot.ready and robot.runtime_state == RuntimeState.STOPPED:
        robot.start_program(WaitProgram(robot.loaded_program or DEFAULT_PROGRAM))


ORDERS: Mapping[str, Mapping[str, tuple[Order, Done]]] = {
    PROGRAM_STATE: {
        "play": (_play, lambda robot: robot.runtime_state == RuntimeState.PLAYING),
        "pause": (Robot.pause, lambda robot: robot.runtime_state == RuntimeState.PAUSED),
        "resume": (Robot.resume, lambda robot: robot.runtime_state == RuntimeState.PLAYING),
        "stop": (
            lambda robot: robot.stop_program("stopped by the Robot API"),
            lambda robot: robot.runtime_state in (RuntimeState.STOPPING, RuntimeState.STOPPED),
        ),
    },
    "/robotstate/v1/state": {
        "POWER_ON": (Robot.power_on, lambda robot: robot.robot_mode >= RobotMode.IDLE),
        "POWER_OFF": (Robot.power_off, lambda robot: robot.robot_mode == RobotMode.POWER_OFF),
        "BRAKE_RELEASE": (Robot.brake_release, lambda robot: robot.robot_mode == RobotMode.RUNNING),
        "UNLOCK_PROTECTIVE_STOP": (
            Robot.unlock_protective_stop,
            lambda robot: robot.safety_mode != SafetyMode.PROTECTIVE_STOP,
        ),
        "RESTART_SAFETY": (Robot.restart_safety, lambda robot: robot.robot_mode == RobotMode.POWER_OFF),
    },
}
PROGRAM_PATHS = {"/program/v1/loaded": ("name", (10, 12)), "/program/v1/load": ("programName", MIN_VERSION)}
PROGRAMS = "/programs/v1/"


def has_robot_api(robot: Robot) -> bool:
    """Return whether the controller's software has a Robot API."""
    return robot.identity.polyscope >= MIN_VERSION


@dataclass(slots=True)
class _PendingOrder:
    """An order that is being carried out, and the tick at which the wait for its end is given up."""

    done: Done
    until_tick: int


class RobotApiSession:
    """The world's side of one connection, which ends after one request and its answer."""

    dialogue = False

    def __init__(self, robot: Robot, programs: StoredPrograms | None = None) -> None:
        self._robot = robot
        self._programs = programs or StoredPrograms()
        self._buffer = bytearray()
        self._order: _PendingOrder | None = None
        self.closing = False

    def greeting(self) -> bytes:
        return b""

    def receive(self, data: bytes) -> bytes:
        """Return the answer if the request is complete and is not an order that takes time; otherwise b""."""
        self._buffer += data
        head, has_end, body = bytes(self._buffer).partition(END)
        length = LENGTH.search(head)
        is_complete = has_end and len(body) >= (int(length[1]) if length else 0)
        if self.closing or self._order or (not is_complete and len(self._buffer) <= REQUEST_BYTES):
            return b""
        method, _, rest = head.partition(b"\r\n")[0].decode(errors="replace").partition(" ")
        answer = self._answer(method, unquote(rest.partition(" ")[0]), body)
        self.closing = self._order is None
        return answer

    def tick(self) -> bytes:
        if self._order is None or not (self._order.done(self._robot) or self._robot.tick >= self._order.until_tick):
            return b""
        is_done, self._order, self.closing = self._order.done(self._robot), None, True
        if is_done:
            return _http(HTTPStatus.OK, {"message": "ok"})
        return _http(HTTPStatus.CONFLICT, {"message": "the order was not carried out"})

    def handle_close(self) -> None:
        pass

    def _answer(self, method: str, path: str, body: bytes) -> bytes:
        """Return the answer to a request; empty if it is an order that takes time, which `tick` answers."""
        version = self._robot.identity.polyscope
        if not path.startswith(BASE):
            return _http(HTTPStatus.NOT_FOUND, {"message": "not found"})
        path = path.removeprefix(BASE)
        if path.startswith(PROGRAMS) and version >= (10, 12):
            return self._answer_about_programs(method, path.removeprefix(PROGRAMS), body)
        if method == "PUT" and (path in ORDERS or path in PROGRAM_PATHS):
            return self._obey(path, body)
        since, answer = QUESTIONS.get(path, (None, None))
        if answer is None or since is None or version < since:
            return _http(HTTPStatus.NOT_FOUND, {"message": "not found"})
        if method != "GET":
            return _http(HTTPStatus.METHOD_NOT_ALLOWED, {"message": "not simulated"})
        return _http(HTTPStatus.OK, answer(self._robot))

    def _answer_about_programs(self, method: str, name: str, body: bytes) -> bytes:
        if method == "GET":
            if not name:
                return _http(HTTPStatus.OK, {"programs": self._programs.describe()})
            if name not in self._programs:
                return _http(HTTPStatus.NOT_FOUND, {"message": "no such program"})
            return _http(HTTPStatus.OK, json.loads(self._programs.read(name)))
        try:
            return _http(HTTPStatus.OK, {"programName": self._programs.store(body, replace=method == "PUT")})
        except ValueError as error:
            return _http(HTTPStatus.BAD_REQUEST, {"message": str(error)[:200]})

    def _obey(self, path: str, body: bytes) -> bytes:
        """Begin to carry out an order; return the answer, or b"" if it is given only when the order is carried out."""
        if self._robot.local_control:
            return _http(HTTPStatus.FORBIDDEN, {"message": "the robot is in local control mode"})
        key, since = PROGRAM_PATHS.get(path, ("action", MIN_VERSION))
        word = _read_word(body, key)
        if word is None or self._robot.identity.polyscope < since:
            return _http(HTTPStatus.BAD_REQUEST, {"message": f"no {key}"})
        return self._load(word) if path in PROGRAM_PATHS else self._act(ORDERS[path], word)

    def _load(self, name: str) -> bytes:
        if name not in self._programs:
            return _http(HTTPStatus.NOT_FOUND, {"message": "no such program"})
        self._robot.loaded_program = name
        return _http(HTTPStatus.OK, {"message": "ok"})

    def _act(self, orders: Mapping[str, tuple[Order, Done]], word: str) -> bytes:
        if word not in orders:
            return _http(HTTPStatus.BAD_REQUEST, {"message": f"not simulated: {word}"[:200]})
        act, done = orders[word]
        act(self._robot)
        if done(self._robot):
            return _http(HTTPStatus.OK, {"message": "ok"})
        self._order = _PendingOrder(done, self._robot.tick + PATIENCE_TICKS)
        return b""


def _read_word(body: bytes, key: str) -> str | None:
    """Return the text under a key of a JSON document; None if the key has no text."""
    try:
        word = json.loads(body)[key]
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
    return word if isinstance(word, str) else None


def _http(status: HTTPStatus, body: Body) -> bytes:
    content = json.dumps(body).encode()
    head = f"HTTP/1.1 {status} {status.phrase}\r\nContent-Type: application/json\r\n"
    return f"{head}Content-Length: {len(content)}\r\nConnection: close\r\n\r\n".encode() + content
