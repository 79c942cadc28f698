"""The arm's states as they come over the wire, whole or in pieces, and controllers that do not send them."""

import socket
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress

import pytest

from rig.errors import Refused
from rig.turners.ur.driver import look
from rig.turners.ur.state_stream import HEADER, PACKET, PORT, VARIABLES, StateStream
from support.waiting import PATIENCE_S, wait_for
from support.worlds import fresh_host

TYPES = ",".join(VARIABLES.values()).encode()


def package(kind: str, payload: bytes) -> bytes:
    return HEADER.pack(HEADER.size + len(payload), ord(kind)) + payload


def data(time_s: float) -> bytes:
    return package("U", PACKET.pack(1, time_s, *range(12), 1.0, 1.0, 7, 1, 2, 3, 1, 0.35, 0.0, 0.0, 0.025))


MESSAGE = package("M", b"\2hi\4RTDE\1")
VERSION = package("v", struct.pack(">4I", 5, 14, 0, 0))
ANSWERS = {"V": package("V", b"\1"), "v": VERSION, "O": package("O", b"\1" + TYPES), "S": package("S", b"\1")}

Send = Callable[[bytes], None]


class Controller:
    """Answers the questions of one client by `answers`; `send` sends it what a test likes."""

    def __init__(self, answers: dict[str, bytes]) -> None:
        self.host = fresh_host()
        self._answers = answers
        self._listener = socket.create_server((self.host, PORT))
        self._client: socket.socket | None = None
        self._server = threading.Thread(target=self._serve, daemon=True)
        self._server.start()

    def _serve(self) -> None:
        self._client, _ = self._listener.accept()
        with suppress(OSError):  # a client that has heard enough hangs up, and a test that has seen enough
            for kind in "VvOS":
                asked = b""
                while len(asked) < HEADER.size or len(asked) < HEADER.unpack_from(asked)[0]:
                    if not (more := self._client.recv(4096)):
                        return
                    asked += more
                assert chr(asked[2]) == kind
                self._client.sendall(self._answers.get(kind, b""))

    def send(self, sent: bytes) -> None:
        assert self._client is not None
        self._client.sendall(sent)

    def keeps_nothing(self) -> None:
        """From now on what the client's system has no room for is not taken from the test."""
        assert self._client is not None
        self._client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1)
        self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # nor is it waited for more to send at once
        self._client.settimeout(PATIENCE_S)

    def hang_up(self) -> None:
        if self._client is not None:
            self._client.close()

    def close(self) -> None:
        self.hang_up()
        self._server.join(PATIENCE_S)
        self._listener.close()


@pytest.fixture
def controllers() -> Iterator[Callable[..., Controller]]:
    running: list[Controller] = []

    def start(**changed: bytes) -> Controller:
        running.append(Controller({**ANSWERS, **changed}))
        return running[-1]

    yield start
    for each in running:
        each.close()


Controllers = Callable[..., Controller]


def times_of(stream: StateStream, number: int) -> list[float]:
    """The time stamps of the next packets."""
    times_s: list[float] = []

    def enough() -> bool:
        times_s.extend(packet.state.time_s for packet in stream.read(0.01))
        return len(times_s) >= number

    wait_for(enough, f"{number} states")
    return times_s


def test_every_state_comes_in_order_also_in_pieces_and_among_messages(controllers: Controllers) -> None:
    controller = controllers(S=MESSAGE + ANSWERS["S"] + MESSAGE + data(1.0) + data(2.0))
    with StateStream(controller.host, 125.0, 5.0) as stream:
        assert stream.first.state.time_s == 1.0
        for byte in data(3.0) + MESSAGE + data(4.0):
            controller.send(bytes([byte]))
        assert times_of(stream, 3) == [2.0, 3.0, 4.0]


def test_states_wait_for_a_reader_that_is_held_up(controllers: Controllers) -> None:
    controller = controllers(S=ANSWERS["S"] + data(0.0))
    with StateStream(controller.host, 125.0, 5.0) as stream:
        controller.send(b"".join(data(float(k)) for k in range(1, 300)))
        assert times_of(stream, 299) == [float(k) for k in range(1, 300)]


@pytest.mark.skipif(sys.platform != "linux", reason="others may give less room")
def test_two_seconds_of_states_wait_also_where_the_controller_keeps_none(controllers: Controllers) -> None:
    controller = controllers(S=ANSWERS["S"] + data(0.0))
    with StateStream(controller.host, 500.0, 5.0) as stream:
        controller.keeps_nothing()
        for k in range(1, 1001):
            controller.send(data(float(k)))  # waits, and times out, where there is no more room
        assert times_of(stream, 1000) == [float(k) for k in range(1, 1001)]


@pytest.mark.slow
def test_a_silence_is_what_has_not_come_however_late_one_looks(controllers: Controllers) -> None:
    controller = controllers(S=ANSWERS["S"] + data(0.0))
    with StateStream(controller.host, 125.0, 5.0) as stream:
        controller.send(data(1.0))
        time.sleep(0.3)  # a reader that gets no processor
        began_s = time.monotonic()
        assert times_of(stream, 1) == [1.0] and stream.silent_s == 0.0
        time.sleep(0.3)
        assert stream.read(0.01) == [] and 0.3 <= stream.silent_s <= time.monotonic() - began_s
        controller.send(data(2.0)[:5])  # a part of a state is a sign of life, too
        assert stream.read(5.0) == [] and stream.silent_s == 0.0
        controller.hang_up()
        assert stream.read(0.01) == [] and stream.closed
        time.sleep(0.1)
        assert stream.read(0.0) == [] and stream.silent_s >= 0.1


def test_a_state_says_what_the_controller_sent(controllers: Controllers) -> None:
    with StateStream(controllers(S=ANSWERS["S"] + data(1.5)).host, 125.0, 5.0) as stream:
        first = stream.first
    state = first.state
    assert (state.q_rad, state.qd_rad_s) == (tuple(range(6)), tuple(range(6, 12)))
    assert (state.robot_mode, state.safety_mode, state.runtime_state) == (7, 1, 2)
    assert (state.robot_status_bits, state.safety_status_bits) == (3, 1)
    assert (first.payload_kg, first.payload_centre_m) == (0.35, (0.0, 0.0, 0.025))


def test_a_connection_that_closes_gives_no_more_states(controllers: Controllers) -> None:
    controller = controllers(S=ANSWERS["S"] + data(1.0))
    with StateStream(controller.host, 125.0, 5.0) as stream:
        controller.hang_up()
        wait_for(lambda: stream.read(0.01) == [] and stream.closed, "the end")
        began_s = time.monotonic()
        assert stream.read(0.05) == [] and time.monotonic() - began_s > 0.04, "it must not spin"


@pytest.mark.parametrize(
    "changed", [{2: 14.0}, {8: -21.0}, {14: 1.5}, {14: float("nan")}, {17: 256}, {1: float("inf")}], ids=str
)
def test_a_state_that_no_arm_can_be_in_is_a_lost_link(controllers: Controllers, changed: dict[int, float]) -> None:
    """Bytes that were lost or damaged on the way would otherwise be believed, and blamed on slider or safety mode."""
    values = [1, 2.0, *range(12), 1.0, 1.0, 7, 1, 2, 3, 1, 0.35, 0.0, 0.0, 0.025]
    for place, value in changed.items():
        values[place] = value
    controller = controllers(S=ANSWERS["S"] + data(1.0))
    with StateStream(controller.host, 125.0, 5.0) as stream:
        controller.send(package("U", PACKET.pack(*values)) + data(3.0))
        wait_for(lambda: stream.read(0.01) == [] and stream.closed, "the end")


@pytest.mark.parametrize("changed", [{2: 0.2}, {5: 2.85}], ids=str)
def test_a_way_that_no_arm_goes_is_a_lost_link(controllers: Controllers, changed: dict[int, float]) -> None:
    """A flipped bit may leave a state that an arm can be in, but hardly one that it comes to from the last."""
    values = [1, 1.008, *(k + 0.008 * (k + 6) for k in range(6)), *range(6, 12), 1.0, 1.0, 7, 1, 2, 3, 1, 0.35]
    values += [0.0, 0.0, 0.025]
    for sound in (True, False):
        for place, value in changed.items():
            values[place] = values[place] if sound else value
        controller = controllers(S=ANSWERS["S"] + data(1.0))
        with StateStream(controller.host, 125.0, 5.0) as stream:
            controller.send(package("U", PACKET.pack(*values)))
            assert times_of(stream, int(sound)) == [1.008] * sound and stream.read(0.2) == []
            assert stream.closed != sound


@pytest.mark.parametrize(
    ("answers", "said"),
    [
        ({"V": package("V", b"\0")}, "version 2"),
        ({"O": package("O", b"\1" + TYPES.replace(b"VECTOR3D", b"NOT_FOUND"))}, "payload_cog"),
        ({"O": package("O", b"\0")}, "timestamp"),
        ({"S": package("S", b"\0")}, "does not start"),
        ({"S": ANSWERS["S"]}, "does not answer"),
        ({"V": b"HTTP/1.1 400 Bad Request\r\n"}, "does not answer|RTDE"),
        ({"V": b"\0\0\0\0"}, "no RTDE"),
    ],
    ids=["version", "a variable", "no recipe", "start", "silence", "another protocol", "zeros"],
)
def test_a_controller_that_sends_no_states_is_an_error_that_says_why(
    controllers: Controllers, answers: dict[str, bytes], said: str
) -> None:
    with pytest.raises(OSError, match=said):
        StateStream(controllers(**answers).host, 125.0, 0.5)


@pytest.mark.parametrize(
    ("changed", "unknown"),
    [
        ({"V": package("V", b"\0")}, "version 2 of RTDE"),
        ({"O": package("O", b"\1" + TYPES.replace(b"VECTOR3D", b"NOT_FOUND"))}, "payload_cog"),
    ],
    ids=["protocol", "field"],
)
@pytest.mark.parametrize(
    ("version", "name"), [((5, 3, 0, 1), "controller_too_old"), ((3, 2, 1, 0), "cb3_not_supported")]
)
def test_a_controller_that_is_too_old_is_told_so_and_not_to_look_at_its_firewall(
    controllers: Controllers, changed: dict[str, bytes], unknown: str, version: tuple[int, ...], name: str
) -> None:
    controller = controllers(**changed, v=package("v", struct.pack(">4I", *version)))
    with socket.create_server((controller.host, 29999)), pytest.raises(Refused) as refused:
        look(controller.host)
    assert refused.value.name == name and "firewall" not in refused.value.remedy
    assert ".".join(map(str, version[:3])) in refused.value.what
    assert name != "controller_too_old" or unknown in refused.value.what
