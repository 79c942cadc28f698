"""The Robot API of a PolyScope X, HTTP at port 80: asked while nothing moves, for what nothing else tells.

(The maker's client library, `DashboardClientImplX`: the control mode is told from 10.12 on, the serial number from
10.14 on.)
"""

import json
from contextlib import closing
from http.client import HTTPConnection, HTTPException, HTTPResponse
from urllib.parse import urlsplit

from rig.errors.quoting import printable

PORT = 80
BASE = "/universal-robots/robot-api"
CONTROL_MODE, INFORMATION = "/system/v1/controlmode", "/system/v1/information"
ANSWER_BYTES = 1 << 16
REDIRECTED = 3  # times at most: some questions have moved from one version to the next
WORD = 60  # characters of an answer


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
        """What lies at a path; it is followed where it has moved to on the same controller."""
        for _ in range(REDIRECTED + 1):
            with closing(HTTPConnection(self._host, self._port, timeout=self._timeout_s)) as connection:
                connection.request("GET", path, headers={"Accept": "application/json"})
                answer = connection.getresponse()
                if answer.status == 200:
                    return answer.read(ANSWER_BYTES)
                path = _moved_to(answer)
        raise HTTPException("it is moved on and on")


def _moved_to(answer: HTTPResponse) -> str:
    """Raises `HTTPException` where the answer is no such word."""
    place = answer.getheader("Location")
    if answer.status not in (301, 302, 307, 308) or not place:
        raise HTTPException(f"status {answer.status}")
    return urlsplit(place).path
