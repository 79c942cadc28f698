"""The Robot API of a PolyScope X, HTTP at port 80: asked for what nothing else tells, and told to stop the program.

(The maker's client library, `DashboardClientImplX`: programs are stopped from 10.11 on, the control mode is told from
10.12 on, the serial number from 10.14 on. In local control an order is answered by 403.)
"""

import json
from collections.abc import Mapping
from contextlib import closing
from http import HTTPStatus
from http.client import HTTPConnection, HTTPException
from urllib.parse import urlsplit

from rig.errors.quoting import printable

PORT = 80
BASE = "/universal-robots/robot-api"
SINCE = (10, 11)  # versions before it have none
PROGRAM = "/program/v1/state"
CONTROL_MODE, INFORMATION = "/system/v1/controlmode", "/system/v1/information"
ANSWER_BYTES = 1 << 16
REDIRECTED = 3  # times at most: some questions have moved from one version to the next
MOVED = (301, 302, 307, 308)
WORD, ANSWER = 60, 160  # characters of an answer


class RobotApi:
    """The Robot API at `host` and `port`; None for an answer where there is none within `timeout_s`."""

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        self._host, self._port, self._timeout_s = host, port, timeout_s

    def in_remote_control(self) -> bool | None:
        """Whether the pendant has handed control over."""
        return {"REMOTE": True, "LOCAL": False}.get(self._word(CONTROL_MODE, "mode") or "")

    def serial_number(self) -> str | None:
        """The arm's serial number."""
        return self._word(INFORMATION, "serialNumber")

    def _word(self, question: str, key: str) -> str | None:
        try:
            answer = json.loads(self._get(BASE + question))
        except (OSError, HTTPException, ValueError, RecursionError):
            return None
        word = answer.get(key) if isinstance(answer, dict) else None
        return printable(word[:WORD]) if isinstance(word, str) and word else None

    def _get(self, path: str) -> bytes:
        status, body = self.request("GET", path)
        if status != HTTPStatus.OK:
            raise HTTPException(f"status {status}")
        return body

    def request(self, method: str, path: str, order: Mapping[str, str] | None = None) -> tuple[int, bytes]:
        """Status and body of an answer; what has moved is followed on the same controller.

        Raises `OSError` and `HTTPException` where there is none.
        """
        body = None if order is None else json.dumps(order)
        headers = {"Accept": "application/json", **({} if body is None else {"Content-Type": "application/json"})}
        for _ in range(REDIRECTED + 1):
            with closing(HTTPConnection(self._host, self._port, timeout=self._timeout_s)) as connection:
                connection.request(method, path, body, headers)
                answer = connection.getresponse()
                place = answer.getheader("Location")
                if answer.status not in MOVED or not place:
                    return answer.status, answer.read(ANSWER_BYTES)
                path = urlsplit(place).path
        raise HTTPException("it is moved on and on")


class RobotApiStop:
    """The order to end the program, by the Robot API at `host` and `port`, as a way to stop an arm.

    What it says of programs is not asked: nobody has told whether it knows of those that clients send.
    """

    name = "Robot API"
    tells_of_programs = False

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        self.refusal: str | None = None
        self.acknowledged = False
        self._api = RobotApi(host, port, timeout_s)

    def stop_program(self) -> None:
        """Stop the running program, and with it the arm. Raises `OSError` where no answer comes."""
        try:
            status, body = self._api.request("PUT", BASE + PROGRAM, {"action": "stop"})
        except HTTPException as error:
            raise ConnectionError(f"no answer of a Robot API ({type(error).__name__})") from error
        self.acknowledged = status in (HTTPStatus.OK, HTTPStatus.ACCEPTED, HTTPStatus.NO_CONTENT)
        if not self.acknowledged:
            self.refusal = " ".join(filter(None, (f"HTTP status {status}", _message(body))))

    def program_running(self) -> bool:
        """Whether a program runs is not told. Raises `ConnectionError`."""
        raise ConnectionError("the Robot API is not asked")

    def close(self) -> None:
        """Every exchange has closed its connection."""


def _message(body: bytes) -> str:
    """What an answer says in words."""
    try:
        told = json.loads(body)
    except (ValueError, RecursionError):
        return ""
    message = told.get("message") if isinstance(told, dict) else None
    return printable(message[:ANSWER]) if isinstance(message, str) else ""
