"""What a PolyScope X is asked without a dashboard, by its Robot API and its primary interface, and who answers so."""

import socket
import struct
import threading
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress

import pytest

from rig.turners.ur.controller.primary_interface import PORT as PRIMARY_PORT
from rig.turners.ur.controller.primary_stop import MODE_DATA, PrimaryStop
from rig.turners.ur.controller.robot_api import RobotApi
from rig.turners.ur.identity import series_problem
from rig.turners.ur.stopping.stop import StopOrder
from rig.turners.ur.stopping.stop_paths import stop_paths
from support.laboratories.worlds import fresh_host
from support.processes.waiting import PATIENCE_S, wait_for

API_PORT = 8077
JSON = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n%s"
MOVED = b"HTTP/1.1 308 Permanent Redirect\r\nLocation: http://elsewhere/new/place\r\nContent-Length: 0\r\n\r\n"


@contextmanager
def saying(port: int, answers: Sequence[bytes]) -> Iterator[tuple[str, list[bytes]]]:
    """A controller that says one of these to each client in turn, and stays; its address, and what it was told."""
    heard: list[bytes] = []
    host = fresh_host()
    clients = []
    with socket.create_server((host, port)) as listener:

        def serve() -> None:
            with suppress(OSError):
                for answer in answers:
                    client, _ = listener.accept()
                    clients.append(client)
                    client.settimeout(PATIENCE_S)
                    heard.append(client.recv(4096))
                    client.sendall(answer)

        server = threading.Thread(target=serve)
        server.start()
        yield host, heard
        server.join(PATIENCE_S)
    for client in clients:
        client.close()


def said(body: bytes) -> bytes:
    return JSON % (len(body), body)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("answer", "remote"),
    [
        (said(b'{"mode": "REMOTE", "message": "ok"}'), True),
        (said(b'{"mode": "LOCAL"}'), False),
        (said(b'{"mode": "SERVICE"}'), None),
        (said(b'{"mode": 1}'), None),
        (said(b'["REMOTE"]'), None),
        (said(b"REMOTE"), None),
        (said(b"\xff"), None),
        (said(b"[" * 5000), None),
        (b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n", None),
        (b"Connected: Universal Robots Dashboard Server\n", None),
        (b"", None),
    ],
)
def test_the_control_mode_is_what_the_robot_api_says_or_not_known(answer: bytes, remote: bool | None) -> None:
    with saying(API_PORT, [answer]) as (host, heard):
        assert RobotApi(host, API_PORT, 0.5).is_in_remote_control() is remote
    assert heard[0].startswith(b"GET /universal-robots/robot-api/system/v1/controlmode HTTP/1.1\r\n")


def test_a_question_that_has_moved_is_followed_on_the_same_controller_but_not_for_ever() -> None:
    with saying(API_PORT, [MOVED, said(b'{"serialNumber": "2026\\u001b1"}')]) as (host, heard):
        assert RobotApi(host, API_PORT, 5.0).serial_number() == "2026\\x1b1"
    assert heard[1].startswith(b"GET /new/place HTTP/1.1\r\n")
    with saying(API_PORT, [MOVED] * 4) as (host, _):
        assert RobotApi(host, API_PORT, 5.0).serial_number() is None


def test_no_robot_api_is_no_answer() -> None:
    assert RobotApi(fresh_host(), API_PORT, 0.5).is_in_remote_control() is None


def package(kind: int, payload: bytes) -> bytes:
    return struct.pack(">iB", 5 + len(payload), kind) + payload


def state(runs: bool, paused: bool = False) -> bytes:
    return package(16, package(0, MODE_DATA.pack(0, True, True, True, False, False, runs, paused) + bytes(20)))


@pytest.mark.parametrize(
    ("states", "running"),
    [
        ([state(False), state(True)], True),
        ([state(True), state(False)], False),
        ([state(False), state(False, paused=True)], True),
        ([state(False), package(20, bytes(20)), package(16, package(0, b"")), state(True)], True),
    ],
    ids=["runs", "ended", "paused", "among others"],
)
def test_a_state_newer_than_the_stop_tells_whether_a_program_runs(states: Sequence[bytes], running: bool) -> None:
    with saying(PRIMARY_PORT, [b"".join(states)]) as (host, heard), closing(PrimaryStop(host, 5.0)) as primary:
        primary.stop_program()
        assert primary.program_running() is running
    assert heard == [b"stop program\n"]


def order_to(host: str, version: tuple[int, ...], timeout_s: float) -> StopOrder:
    return StopOrder(stop_paths(host, version, API_PORT), timeout_s)


X_WITHOUT_API, X, SERIES_5 = (10, 10, 0, 0), (10, 12, 0, 0), (5, 14, 0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("states", [b"", state(False), b"Connected: Universal Robots Dashboard Server\n"])
def test_a_primary_interface_that_does_not_tell_confirms_no_stop(states: bytes) -> None:
    with saying(PRIMARY_PORT, [states]) as (host, _):
        order = order_to(host, X_WITHOUT_API, 0.5)
        assert not order.await_program_end()
    assert order.words == "the primary interface was sent the stop and did not acknowledge it"


def test_an_order_is_given_however_late_its_thread_begins() -> None:
    with saying(PRIMARY_PORT, [state(False)]) as (host, heard):
        order_to(host, X_WITHOUT_API, 0.0)
        wait_for(lambda: heard, "the order")
    assert heard == [b"stop program\n"]


@pytest.mark.parametrize(
    ("version", "ways"),
    [(SERIES_5, ["dashboard", "primary interface"]), (X, ["primary interface", "Robot API"])],
)
def test_an_order_that_nobody_takes_names_every_way(version: tuple[int, ...], ways: list[str]) -> None:
    order = order_to(fresh_host(), version, 5.0)
    assert not order.await_program_end()
    for way in ways:
        assert f"the {way} did not take the stop ([Errno " in order.words


READ_ONLY = package(20, struct.pack(">QbBiiiII", 0, -1, 6, 210, 0, 2, 0, 0) + b"read-only")
NOT_ALLOWED = "Command is not allowed due to safety reasons, please switch robot to Remote Control mode"
RUNS = b"Program running: %s\n"


def dashboard(answer: str, running: bytes = b"true") -> list[bytes]:
    """What it says to one client, that goes on to ask whether the program runs."""
    return [b"Connected: Universal Robots Dashboard Server\n" + answer.encode() + b"\n" + RUNS % running]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("version", "port", "answers", "refusal"),
    [
        (SERIES_5, 29999, dashboard(NOT_ALLOWED), f'the dashboard refused the stop ("{NOT_ALLOWED}")'),
        (SERIES_5, 29999, dashboard("Failed to execute: stop"), "refused the stop (\"Failed to execute: stop\")"),
        (SERIES_5, 29999, dashboard("Failed to execute: stop", b"false"), None),
        (SERIES_5, 29999, dashboard("Stopped"), None),
        (X_WITHOUT_API, PRIMARY_PORT, [READ_ONLY + state(True) * 2], "refused the stop (C210A0 read-only: it is "),
        (X, API_PORT, [b"HTTP/1.1 403 Forbidden\r\nContent-Length: 20\r\n\r\n{\"message\": \"local\"}"],
         "the Robot API refused the stop (HTTP status 403 local)"),
        (X, API_PORT, [said(b"{}")], None),
    ],
    ids=["not allowed", "failed", "nothing runs", "stopped", "read-only", "forbidden", "ok"],
)  # fmt: skip
def test_who_refuses_a_stop_is_told_with_his_words(
    version: tuple[int, ...], port: int, answers: list[bytes], refusal: str | None
) -> None:
    with saying(port, answers) as (host, _):
        order = order_to(host, version, 0.5)
        assert order.await_delivery()
        order.await_program_end()
    assert (refusal or "") in order.words
    assert bool(order.refusals) == bool(refusal)


@pytest.mark.parametrize(
    ("version", "refused"),
    [((10, 7, 0, 0), "polyscope_x"), ((10, 10, 0, 0), None), ((11, 0, 0, 0), None), ((5, 14, 0, 0), None)],
)
def test_a_polyscope_x_is_taken_from_10_10_on(version: tuple[int, ...], refused: str | None) -> None:
    problem = series_problem("10.0.0.2", version)
    assert (problem.name if problem else None) == refused
