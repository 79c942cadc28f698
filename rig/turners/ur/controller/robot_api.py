"""The Robot API of a PolyScope X, HTTP at port 80, for items that no other interface reports, and for the stop.

It can stop programs since version 10.11, and reports the control mode since 10.12, the serial number since 10.14. In
local control it answers an order with 403. Source: the maker's client library, `DashboardClientImplX`.
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
MIN_VERSION = (10, 11)  # the first version that has one
PROGRAM = "/program/v1/state"
CONTROL_MODE, INFORMATION = "/system/v1/controlmode", "/system/v1/information"
ANSWER_BYTES = 1 << 16
MAX_REDIRECTIONS = 3  # some paths have moved between versions
REDIRECTION_STATUSES = (301, 302, 307, 308)
MAX_WORD_CHARACTERS, MAX_ANSWER_CHARACTERS = 60, 160  # of an answer


class RobotApi:
    """The Robot API at `host` and `port`; methods return None if no answer comes within `timeout_s`."""

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        self._host, self._port, self._timeout_s = host, port, timeout_s

    def is_in_remote_control(self) -> bool | None:
        """Return whether the pendant is in remote control, None if the software does not report it."""
        return {"REMOTE": True, "LOCAL": False}.get(self._word(CONTROL_MODE, "mode") or "")

    def serial_number(self) -> str | None:
        """Return the arm's serial number, None if the software does not report it."""
        return self._word(INFORMATION, "serialNumber")

    def _word(self, question: str, key: str) -> str | None:
        try:
            answer = json.loads(self._get(BASE + question))
        except (OSError, HTTPException, ValueError, RecursionError):
            return None
        word = answer.get(key) if isinstance(answer, dict) else None
        return printable(word[:MAX_WORD_CHARACTERS]) if isinstance(word, str) and word else None

    def _get(self, path: str) -> bytes:
        status, body = self.request("GET", path)
        if status != HTTPStatus.OK:
            raise HTTPException(f"status {status}")
        return body

    def request(self, method: str, path: str, order: Mapping[str, str] | None = None) -> tuple[int, bytes]:
        """Send a request and return status and body of the answer; follow redirections on the same controller.

        Raise `OSError` and `HTTPException` if no answer comes.
        """
        body = None if order is None else json.dumps(order)
        headers = {"Accept": "application/json", **({} if body is None else {"Content-Type": "application/json"})}
        for _ in range(MAX_REDIRECTIONS + 1):
            with closing(HTTPConnection(self._host, self._port, timeout=self._timeout_s)) as connection:
                connection.request(method, path, body, headers)
                answer = connection.getresponse()
                location = answer.getheader("Location")
                if answer.status not in REDIRECTION_STATUSES or not location:
                    return answer.status, answer.read(ANSWER_BYTES)
                path = urlsplit(location).path
        raise HTTPException("it redirects again and again")


class RobotApiStop:
    """The order to end the program by the Robot API at `host` and `port`, one path of a stop.

    The API's report on programs is not used, because it may not include clients' programs (undocumented).
    """

    name = "Robot API"
    reports_programs = False

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        self.refusal: str | None = None
        self.acknowledged = False
        self._api = RobotApi(host, port, timeout_s)

    def stop_program(self) -> None:
        """Stop the running program, and with it the arm. Raise `OSError` if no answer comes."""
        try:
            status, body = self._api.request("PUT", BASE + PROGRAM, {"action": "stop"})
        except HTTPException as error:
            raise ConnectionError(f"no answer of a Robot API ({type(error).__name__})") from error
        self.acknowledged = status in (HTTPStatus.OK, HTTPStatus.ACCEPTED, HTTPStatus.NO_CONTENT)
        if not self.acknowledged:
            self.refusal = " ".join(filter(None, (f"HTTP status {status}", _message(body))))

    def program_running(self) -> bool:
        """Raise `ConnectionError`, because the Robot API is not asked about programs."""
        raise ConnectionError("the Robot API is not asked")

    def close(self) -> None:
        """Do nothing, because every exchange closes its own connection."""


def _message(body: bytes) -> str:
    """Return the message in an answer's body, or ""."""
    try:
        answer = json.loads(body)
    except (ValueError, RecursionError):
        return ""
    message = answer.get("message") if isinstance(answer, dict) else None
    return printable(message[:MAX_ANSWER_CHARACTERS]) if isinstance(message, str) else ""
