"""What a PolyScope X is asked without a dashboard, by its Robot API and its primary interface, and who answers so."""

import socket
import struct
import threading
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress

import pytest

from rig.turners.ur.identity import series_problem
from rig.turners.ur.primary import PORT as PRIMARY_PORT
from rig.turners.ur.primary_stop import MODE_DATA, PrimaryStop
from rig.turners.ur.robot_api import RobotApi
from rig.turners.ur.stopping import Order, independent_ways
from support.waiting import PATIENCE_S, wait_for
from support.worlds import fresh_host

API_PORT = 8077
JSON = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n%s"
MOVED = b"HTTP/1.1 308 Permanent Redirect\r\nLocation: http://elsewhere/new/place\r\nContent-Length: 0\r\n\r\n"


@contextmanager
def saying(port: int, answers: Sequence[bytes]) -> Iterator[tuple[str, list[bytes]]]:
    """A controller that says one of these to each client in turn, and stays; its address, and what it was told."""
    heard: list[bytes] = []
    host, clients = fresh_host(), []
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
        assert RobotApi(host, API_PORT, 0.5).in_remote_control() is remote
    assert heard[0].startswith(b"GET /universal-robots/robot-api/system/v1/controlmode HTTP/1.1\r\n")


def test_a_question_that_has_moved_is_followed_on_the_same_controller_but_not_for_ever() -> None:
    with saying(API_PORT, [MOVED, said(b'{"serialNumber": "2026\\u001b1"}')]) as (host, heard):
        assert RobotApi(host, API_PORT, 5.0).serial_number() == "2026\\x1b1"
    assert heard[1].startswith(b"GET /new/place HTTP/1.1\r\n")
    with saying(API_PORT, [MOVED] * 4) as (host, _):
        assert RobotApi(host, API_PORT, 5.0).serial_number() is None


def test_no_robot_api_is_no_answer() -> None:
    assert RobotApi(fresh_host(), API_PORT, 0.5).in_remote_control() is None


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


@pytest.mark.parametrize("states", [b"", state(False), b"Connected: Universal Robots Dashboard Server\n"])
def test_a_primary_interface_that_does_not_tell_confirms_no_stop(states: bytes) -> None:
    with saying(PRIMARY_PORT, [states]) as (host, _):
        order = Order(host, independent_ways((10, 12, 0, 0)), 0.5)
        assert not order.program_ended()
    assert order.words == "the controller was told to stop"


def test_an_order_is_given_however_late_its_thread_begins() -> None:
    with saying(PRIMARY_PORT, [state(False)]) as (host, heard):
        Order(host, independent_ways((10, 12, 0, 0)), 0.0)
        wait_for(lambda: heard, "the order")
    assert heard == [b"stop program\n"]


def test_an_order_that_nobody_takes_names_every_way() -> None:
    order = Order(fresh_host(), independent_ways((5, 14, 0, 0)), 5.0)
    assert not order.program_ended()
    assert "dashboard: [Errno " in order.words and "primary interface: [Errno " in order.words


@pytest.mark.parametrize(
    ("version", "refused"),
    [((10, 7, 0, 0), "polyscope_x"), ((10, 10, 0, 0), None), ((11, 0, 0, 0), None), ((5, 14, 0, 0), None)],
)
def test_a_polyscope_x_is_taken_from_10_10_on(version: tuple[int, ...], refused: str | None) -> None:
    problem = series_problem("10.0.0.2", version)
    assert (problem.name if problem else None) == refused
